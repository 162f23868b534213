// The features by which the structure of a photo is judged, through its lens at any focal length.
// Internal: not installed.
//
// How a lens bends a feature depends on the angle at which it is seen, and so on the focal length:
// but for a camera without distortion, what was fitted at one focal length says little of another.
// So points are undistorted and fitted anew over the focal lengths, some of them, as that is what
// takes the time; what lies between follows from its two neighbours.
#ifndef CIRCLINE_RANSAC_DETECTION_FOCUSED_FEATURES_H_
#define CIRCLINE_RANSAC_DETECTION_FOCUSED_FEATURES_H_

#include <Eigen/Core>
#include <map>
#include <optional>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic_fit.h"
#include "circline/ransac/detection/observe_evidence.h"
#include "circline/ransac/detection/uncertain_direction.h"

namespace circline {

// At one focal length. None where the camera cannot undistort a feature's points.
struct FocusedFeatures {
  std::vector<std::optional<ConicFit>> circles;
  std::vector<std::optional<UncertainDirection>> pencils;
  std::vector<std::optional<UncertainDirection>> edges;  // As of LineFit: their lines.
};

class FeaturesByFocal {
 public:
  // The best circles, and the directions of the longest pencils. Where there is one pencil and
  // nothing else: the edges around it. `pencils` are those of DetectPencilsApart.
  FeaturesByFocal(const PhotoEvidence& evidence, const std::vector<DetectedPencil>& pencils,
                  const Camera& camera, const CameraSigma& sigma, double diagonal_px);

  // Whether all focal lengths are alike to them.
  bool IsEmpty() const { return circles_.size() < 2 && pencils_.size() < 2 && edges_.size() < 2; }

  // At a focal length, its logarithm over that of the camera.
  FocusedFeatures At(double log_focal);

 private:
  // Pixels, with the variance of each at which a fit is known as well as the detection's.
  struct Points {
    std::vector<Eigen::Vector2d> pixels;
    double variance;
  };
  static Points Some(const std::vector<Eigen::Vector2d>& all, std::size_t most, double variance);

  void AddCircles(const PhotoEvidence& evidence);
  void AddPencils(const std::vector<DetectedPencil>& pencils);
  void AddEdges(const std::vector<DetectedLine>& edges);

  bool FitCircle(const Camera& camera, const Points& points, ConicFit* fit);
  bool FitEdge(const Camera& camera, const Points& points, LineFit* fit);
  FocusedFeatures Fit(double log_focal);
  const FocusedFeatures& Node(int node);

  const Camera& camera_;
  const CameraSigma& sigma_;
  std::vector<Points> circles_, edges_;
  std::vector<std::vector<Points>> pencils_;  // Of each its lines.
  std::map<int, FocusedFeatures> nodes_;      // Fitted so far.
  std::vector<CalibratedPoint> calibrated_;   // Scratch.
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_FOCUSED_FEATURES_H_
