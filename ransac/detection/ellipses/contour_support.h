// What edges there are along the image of an ellipse.
#ifndef CIRCLINE_RANSAC_DETECTION_ELLIPSES_CONTOUR_SUPPORT_H_
#define CIRCLINE_RANSAC_DETECTION_ELLIPSES_CONTOUR_SUPPORT_H_

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic.h"
#include "circline/ransac/detection/edges.h"

namespace circline {

// An edge point supports a contour if its gradient is within 25 degrees of the contour's normal.
constexpr double kMinNormalCosine = 0.906;

struct ContourSample {
  Eigen::Vector2d pixel, normal;  // On the photo; outward, unit.
  double length = 0.0;            // Of the contour that it stands for, pixels.
  double turn = 0.0;              // Of the normal over that length, radians.
};

// The image of a calibrated ellipse on the photo, whatever the lens makes of it.
class Contour {
 public:
  // `camera` must outlive the contour.
  explicit Contour(const Camera& camera) : camera_(camera) {}

  // False where the conic is no ellipse, parts of it cannot be projected, or it is too small
  // (semi-minor axis) or too large (semi-major axis).
  bool Project(const Eigen::Matrix3d& conic, double min_axis_px, double max_axis_px);

  // The following require Project. False where parts of the contour cannot be projected. Samples
  // are evenly spaced in the eccentric anomaly.
  bool SampleEvery(double spacing_px, std::vector<ContourSample>* samples,
                   int max_samples = 20000) const;
  bool SampleCount(int n, std::vector<ContourSample>* samples) const;

  double major_px() const { return major_px_; }  // Semi-axes on the photo, approximate.
  double minor_px() const { return minor_px_; }

 private:
  bool ToPixel(const Eigen::Vector2d& x, Eigen::Vector2d* pixel) const;

  const Camera& camera_;
  Eigen::Vector2d center_, major_, minor_;  // Of the ellipse, calibrated: centre and semi-axes.
  double major_px_ = 0.0, minor_px_ = 0.0;
};

struct Support {
  std::vector<int> points;  // Of the edge map, once around.
  double perimeter_px = 0.0;
  double length_px = 0.0;      // Of the parts of the contour that edges support.
  double turn = 0.0;           // Of the contour over those parts, radians.
  double normal_median = 0.0;  // Angle between the gradients and the contour's normal, radians.
  double gradient = 0.0;       // Mean over the points, grey levels per pixel.
  double sigma_px = 0.0;       // Of the points, expected from the noise alone; median.

  // Share of the contour.
  double Coverage() const { return perimeter_px > 0.0 ? length_px / perimeter_px : 0.0; }
};

// Finds the edge points along a sampled contour, and keeps book of which are already taken.
class EdgeCollector {
 public:
  // `map` must outlive the collector.
  explicit EdgeCollector(const EdgeMap& map)
      : map_(map), taken_(map.points.size(), 0), in_support_(map.points.size(), 0) {}

  // Marks points as belonging to an accepted ellipse: they support no other.
  void Take(const std::vector<int>& points);
  // Undoes that.
  void Release(const std::vector<int>& points);
  bool IsTaken(int i) const { return taken_[static_cast<std::size_t>(i)] != 0; }

  // A first look with few samples: the share of them near which there are edge points with the
  // gradient across the contour. (Here and below a reach over 7 pixels is cut to that.)
  double QuickLook(const std::vector<ContourSample>& samples, BrightSide bright,
                   double reach) const;

  // The strongest points along the contour with the right bright side, as far as they come in runs.
  void Collect(const std::vector<ContourSample>& samples, BrightSide bright, double reach,
               Support* support);

 private:
  int Strongest(const ContourSample& s, BrightSide bright, double reach) const;

  const EdgeMap& map_;
  std::vector<std::uint8_t> taken_;
  // Scratch: for each sample its point or -1, and whether it lies in a run; for each point of the
  // map whether it is in the support.
  std::vector<int> nearest_;
  std::vector<std::uint8_t> in_run_, in_support_;
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_ELLIPSES_CONTOUR_SUPPORT_H_
