// A circle on a tilted plane with the image of its centre, through a lens with distortion: is its
// pose found? The exit code says so.
#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>

#include "circline/estimators/camera.h"
#include "circline/estimators/observations.h"
#include "circline/ransac/fit_observations.h"
#include "circline/refine/estimate_pose.h"
#include "circline/version.h"

static_assert(CIRCLINE_VERSION >= 100 && sizeof(CIRCLINE_VERSION_STRING) > 5);

int main() {
  circline::Observations observations;
  circline::Camera& camera = observations.camera;
  camera.id = "cam0";
  camera.model = circline::CameraModel::kOpenCV;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 500.0;
  camera.cx = 320.0;
  camera.cy = 240.0;
  camera.distortion = {-0.2, 0.05};

  const double radius = 0.5;
  const Eigen::Vector3d center(0.3, -0.2, 3.0);
  const Eigen::Vector3d normal = Eigen::Vector3d(0.5, 0.3, -1.0).normalized();
  const Eigen::Vector3d u = normal.unitOrthogonal();
  const Eigen::Vector3d v = normal.cross(u);

  circline::CircleObservation circle;
  circle.id = "plate";
  circle.radius = radius;
  circle.sigma_px = 0.1;
  for (int i = 0; i < 100; ++i) {
    const double angle = 2.0 * 3.14159265358979 * i / 100.0;
    Eigen::Vector2d pixel;
    if (!circline::CameraToPixel(
            camera, center + radius * (std::cos(angle) * u + std::sin(angle) * v), &pixel)) {
      std::fprintf(stderr, "a point of the circle is not in view\n");
      return 1;
    }
    circle.points.push_back(pixel);
  }
  Eigen::Vector2d center_pixel;
  if (!circline::CameraToPixel(camera, center, &center_pixel)) return 1;
  circle.center = center_pixel;
  observations.circles.push_back(circle);

  const circline::Status fitted = circline::FitObservations(circline::FitOptions(), &observations);
  if (!fitted.ok()) {
    std::fprintf(stderr, "%s\n", fitted.message.c_str());
    return 1;
  }
  const circline::PoseEstimate estimate = circline::EstimatePose(observations);
  if (!estimate.status.ok() || estimate.hypotheses.empty()) {
    std::fprintf(stderr, "no pose: %s\n", estimate.status.message.c_str());
    return 1;
  }
  const circline::PoseHypothesis& best = estimate.hypotheses.front();
  const double normal_error =
      std::acos(std::fmin(1.0, std::fabs(best.cam_from_world.rotation.col(2).dot(normal))));
  const double translation_error = (best.cam_from_world.translation - center).norm();
  std::printf("normal: %.2e rad off, centre: %.2e of %.2f off\n", normal_error, translation_error,
              center.norm());
  return best.metric && normal_error < 1e-4 && translation_error < 1e-3 ? 0 : 1;
}
