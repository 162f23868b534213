// Points of one contour or one line in a photo, prepared once for all evaluations: undistorted,
// with their noise and robust loss; and the sums over them that a curve through them costs.
//
// The residual of a point is its distance from the curve in pixels of the photo as taken, over its
// standard deviation, under the loss. Curves are conics and lines in calibrated coordinates of the
// camera. Allocates when it is made, takes more points than ever before, or is first seen through
// another camera, and else never.
#ifndef CIRCLINE_REFINE_IMAGE_POINTS_H_
#define CIRCLINE_REFINE_IMAGE_POINTS_H_

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/export.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/robust_loss.h"
#include "circline/refine/camera_shifts.h"

namespace CIRCLINE_EXPORT circline {

// How far a contour point is from a circle's image: to first order (Sampson), or orthogonally, in
// twice the time. By itself: orthogonally where the first order does not suffice, that is where the
// ellipse's smallest radius of curvature is below 20 standard deviations of a point.
enum class ConicDistanceType { kAuto, kSampson, kOrthogonal };

// How residuals count. All of them under their loss, its tuning constant `stretch` times as wide
// (graduated refinement lowers it to 1); or, for covariances, inliers only, without loss, all times
// `scale`.
struct Weighing {
  bool inliers_only = false;    // Without loss, for covariances.
  double gate = kInlierSigmas;  // Standard deviations.
  double scale = 1.0;           // Of residuals, with inliers_only.
  double stretch = 1.0;         // Of the tuning constant; 1 or more.
};

// A sum of robust costs about the present place in the local variables of a curve: `twice_cost` =
// sum rho, g its gradient (of the half), h the Hessian, never indefinite: the losses' curvature is
// exact or bounded from below, that of the curve is left out.
struct CurveModel {
  static constexpr int kMaxSize = 6 + 1 + kCameraSize;  // Of a conic, its offset, a camera.
  // They do not allocate.
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxSize, 1>;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxSize, kMaxSize>;

  double twice_cost = 0.0;  // Sum rho.
  Vector g;                 // Gradient of half of it.
  Matrix h;                 // Its Hessian.
};

// The points of a feature, as its cost function holds them.
class ImagePoints {
 public:
  // How they are weighed.
  struct Options {
    double sigma_px = 1.0;               // Standard deviation of each coordinate, pixels; > 0.
    double weight = 1.0;                 // What all points together count (NoiseModel::Weight).
    LossType loss = LossType::kTrivial;  // Of each point.
    ConicDistanceType distance = ConicDistanceType::kAuto;  // Of contours.
    int num_distortion = 1;  // Distortion coefficients with derivatives; the others are constant.
  };

  // Points with inliers[i] == 0 are left out, those beyond the end of `inliers` too (it may be
  // empty, for all points), and so are those that the camera cannot undistort. None may be left:
  // residuals are zero then. Shifted cameras see them all (SeenThrough).
  ImagePoints(const Camera& camera, const std::vector<Eigen::Vector2d>& pixels,
              const std::vector<std::uint8_t>& inliers, const Options& options) {
    Reset(camera, pixels, inliers, options);
  }
  ImagePoints() = default;  // None.
  // Takes these in place of its own, in their memory.
  void Reset(const Camera& camera, const std::vector<Eigen::Vector2d>& pixels,
             const std::vector<std::uint8_t>& inliers, const Options& options);

  // Moves them back to where they would lie on average without noise, along the normals of a fit
  // (calibrated, negative inside). Points of an ellipse whose both coordinates have noise lie
  // outside of it by kappa sigma^2 / 2, kappa the curvature: noise along the contour leads away
  // from it. In one photo that is little against the noise; over many frames, which average the
  // noise out, it tilts small and steep ellipses by up to a standard deviation.
  void RemoveCurvatureBias(const Eigen::Matrix3d& conic, double sigma_px);

  std::size_t size() const { return points_.size(); }  // Of those that were not left out.
  const std::vector<CalibratedPoint>& points() const { return points_; }  // Undistorted.
  const std::vector<Eigen::Vector2d>& pixels() const { return pixels_; }  // Of the same points.
  const Camera& camera() const { return camera_; }                        // As given.
  const Options& options() const { return options_; }  // As given; no distortion of a pinhole.
  // Whether lines in space are bent in the photo, so that they tell of the focal length.
  bool has_lens() const { return camera_.model != CameraModel::kPinhole; }
  void set_weight(double weight) { options_.weight = weight; }  // Options::weight.
  // Undistorts the points once, as the camera with these kCameraSize shifts has them, for all that
  // is asked with the same shifts later; with others each is undistorted anew, to the same values.
  void SeeThrough(const double* camera);
  // The points as the camera of the last SeeThrough has them; before any, as the camera given has.
  const std::vector<CalibratedPoint>& seen() const { return seen_.empty() ? points_ : seen_; }
  // Of the kCameraSize shifts these come first and have derivatives; those of the others are zero.
  int num_camera() const { return 4 + options_.num_distortion; }

  // Which unknowns have derivatives, beside the curve.
  struct Variables {
    bool offset = false, camera = false;  // Contour offset; camera shifts.
  };

  // Sum over the points' distances from `conic` (3x3, negative inside an ellipse; its scale has no
  // meaning), moved outwards by `offset_px`. `camera`: kCameraSize shifts, or null for none. Local
  // variables: ConicToVector of Normalized(conic) (6), the offset (1; with offset_variable), the
  // camera's first num_camera() shifts (with camera). `model` may be null. Returns sum rho; not
  // finite where a residual is not.
  double SumConic(const Eigen::Matrix3d& conic, double offset_px, const double* camera,
                  const Weighing& weighing, const Variables& variables, CurveModel* model) const;

  // The same for a line (3). Local variables: the line (3), the camera's shifts.
  double SumLine(const Eigen::Vector3d& line, const double* camera, const Weighing& weighing,
                 bool camera_variable, CurveModel* model) const;

  // Signed distances, pixels.
  void ConicDistances(const Eigen::Matrix3d& conic, double offset_px, const double* camera,
                      std::vector<double>* distances) const;
  void LineDistances(const Eigen::Vector3d& line, const double* camera,
                     std::vector<double>* distances) const;

  // Mean of the points as the camera with these shifts has them; z is 1.
  Eigen::Vector3d Middle(const double* camera) const;

  // The conic in coordinates about the points' middle, in which its shape is large against
  // rounding.
  Eigen::Matrix3d Normalized(const Eigen::Matrix3d& conic) const {
    return normalization_.transpose() * conic * normalization_;
  }

 private:
  class View;
  class ToConic;
  CalibratedPoint Normalize(CalibratedPoint p) const;
  bool IsOrthogonal(const Eigen::Matrix3d& conic, double* level) const;

  Camera camera_;
  Options options_;
  std::vector<Eigen::Vector2d> pixels_;
  std::vector<CalibratedPoint> points_, normalized_;  // The latter about the points' middle.
  std::vector<CalibratedPoint> seen_;                 // SeeThrough, and its shifts.
  double seen_by_[kCameraSize] = {};
  std::vector<LensSlope> lens_;                                  // By distortion coefficient.
  Eigen::Matrix3d normalization_ = Eigen::Matrix3d::Identity();  // Calibrated from normalised.
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_IMAGE_POINTS_H_
