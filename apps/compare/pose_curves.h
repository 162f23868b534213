// What a pose looks like on its photo: curves in pixels, for pictures and for pages.
#ifndef CIRCLINE_APPS_COMPARE_POSE_CURVES_H_
#define CIRCLINE_APPS_COMPARE_POSE_CURVES_H_

#include <Eigen/Core>
#include <array>
#include <functional>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"

namespace circline::apps {

using PixelCurve = std::vector<Eigen::Vector2d>;  // Pixels; not finite where it cannot be seen.

// A curve of the camera frame, curve(t) for t from t0 to t1, in so many straight pieces.
PixelCurve ProjectCurve(const Camera& camera, int pieces, double t0, double t1,
                        const std::function<Eigen::Vector3d(double)>& curve);

struct PoseCurves {
  std::vector<PixelCurve> grid;  // Of the part of the plane that carries evidence.
  PixelCurve vanishing_line;     // Of the plane.
  // Of the axes: where the world's is, if that is in the photo.
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();
  std::array<PixelCurve, 3> axes;  // Empty where the camera does not see them.
  std::vector<PixelCurve> box;     // A cube as long as the axes that stands on the plane.
};

// `width` and `height`: of the photo, pixels.
PoseCurves CurvesOfPose(const Observations& observations, const PoseHypothesis& hypothesis,
                        int width, int height);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_POSE_CURVES_H_
