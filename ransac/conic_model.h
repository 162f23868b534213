// The ellipse as a model for RANSAC: five points a sample, or three points with the direction of
// the edge there; distances in pixels of the photo. robust_conic.h has the fits.
#ifndef CIRCLINE_RANSAC_CONIC_MODEL_H_
#define CIRCLINE_RANSAC_CONIC_MODEL_H_

#include <Eigen/Core>
#include <array>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic_fit.h"
#include "circline/estimators/export.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/status.h"
#include "circline/ransac/ransac.h"

namespace CIRCLINE_EXPORT circline {

// Directions of the edge at the points, for those who have them (EdgePoint of edges.h has).
struct EdgeDirections {
  // None, or one per point: unit gradient, across the contour, on the photo; its sense has no
  // meaning. Zero where it is not known.
  std::vector<Eigen::Vector2d> normals;
  double sigma_rad = 0.1;  // Standard deviation of a normal's angle, radians; in (0, 0.5].

  // Ok, or a sentence that names the field which is wrong.
  Status Validate(std::size_t num_points) const;
};

// The model for the engine. Coordinates are shifted and scaled so that the points fill [-1, 1];
// residuals are first-order (Sampson) distances in pixels of the photo. Where directions are given,
// the sine of the angle between a point's normal and the ellipse's is a second residual, squared
// and added, such that sigma_rad counts as much as one standard deviation of the distance does
// (threshold / kInlierSigmas). Directions choose the points; they do not pull at the ellipse.
class ConicModel {
 public:
  // a x^2 + 2 b x y + c y^2 + 2 d x + 2 e y + f, unit norm, an ellipse that is negative inside.
  using Value = std::array<double, 6>;
  static constexpr int kMinSamples = 5;  // Points of a conic.

  // `directions` (with none, or one for each point) are read here only; `threshold` as the
  // engine's.
  explicit ConicModel(const std::vector<CalibratedPoint>& points,
                      const EdgeDirections& directions = {}, double threshold = kInlierSigmas);

  int NumData() const { return static_cast<int>(index_.size()); }  // All points.
  // Index into the constructor's points of the datum at position i.
  int PointIndex(int i) const { return index_[static_cast<std::size_t>(i)]; }
  // The ellipse in calibrated coordinates, any scale.
  Eigen::Matrix3d ToConic(const Value& value) const;
  // The reverse; false, where it is not a real ellipse, or is too small or too large for the
  // points.
  bool FromConic(const Eigen::Matrix3d& conic, Value* value) const;

  // As the engine asks for it (ransac.h).
  bool Fit(const int* sample, Value* value) const;
  // 0.6 ns a point, 0.9 with directions.
  void SquaredResiduals(const Value& value, int begin, int end, float* r2) const;
  // As the engine asks for it (ransac.h).
  bool Refine(const float* weights, Value* value) const;
  // Whether the points within the threshold spread over 30 degrees (of the eccentric anomaly; under
  // about 60 the shape of an ellipse is open, and only its covariance says so) and are no straight
  // edge.
  bool Accept(const Value& value, double threshold) const;

  // Area within the threshold of the ellipse, as far as it lies in the points' box, over that of
  // the box: the chance that a stray point is an inlier.
  double BandShare(const Value& value, double threshold) const;

  // Squared distances of the data begin..end-1 whatever their directions, squared pixels.
  void SquaredDistances(const Value& value, int begin, int end, float* r2) const;
  // Position of datum i in the model's coordinates.
  const Eigen::Vector2d& Position(int i) const { return Point(i).x; }
  // Standard deviation of the directions, radians; 0 where none are given.
  double sigma_rad() const { return sigma_rad_; }
  // Whether the direction at datum i is known.
  bool HasDirection(int i) const {
    return !normals_.empty() && !normals_[static_cast<std::size_t>(i)].isZero(0.0);
  }
  // Distance of two data, pixels, roughly (a pixel of average size).
  double PixelsBetween(int i, int j) const { return (Position(i) - Position(j)).norm() / pixel_; }
  // Squared sine residual of datum i, in standard deviations; 0 where its direction is not known.
  double DirectionMiss(const Value& value, int i) const;

 private:
  friend class OrientedConicModel;  // Derived: another way to draw samples.

  const CalibratedPoint& Point(int i) const { return points_[static_cast<std::size_t>(i)]; }
  template <bool kOriented>
  void Residuals(const Value& value, int begin, int end, float* r2) const;
  void ReadDirections(const EdgeDirections& directions);
  static Eigen::Matrix3d ToMatrix(const Value& value);
  static Value ToValue(const Eigen::Matrix3d& conic);
  // Whether it is an ellipse as FromConic gives them; makes it negative inside, of unit norm.
  bool Normalize(Value* value) const;

  std::vector<int> index_;
  // x, y, the four entries of x_from_pixel and, with directions, the normal scaled to pixels per
  // unit sine: six or eight flat arrays.
  std::vector<float> data_;
  std::vector<CalibratedPoint> points_;   // In the model's coordinates and order.
  std::vector<Eigen::Vector2d> normals_;  // On the photo; empty without directions.
  double sigma_rad_ = 0.0;
  double sigma_px_ = 1.0;  // threshold / kInlierSigmas.
  Eigen::Vector2d center_ = Eigen::Vector2d::Zero();
  double scale_ = 1.0;
  // Of the points, in the model's coordinates.
  Eigen::Vector2d half_box_ = Eigen::Vector2d::Zero();
  double box_area_ = 0.0;
  double pixel_ = 1.0;  // Size of a pixel in the model's coordinates, on average.
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_CONIC_MODEL_H_
