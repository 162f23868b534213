#include "circline/refine/image_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/camera.h"

namespace circline {
namespace {

// A camera of which a point at the rim of the photo is no ray, as one of a shorter focal length may
// be whose lens turns back: the point is as far from what is seen there as it is in the photo,
// whether its feature is seen through the camera once or asked point by point.
TEST(ImagePointsTest, APointBeyondTheLensIsAsFarOffAsInThePhoto) {
  Camera camera;
  camera.model = CameraModel::kOpenCV;
  camera.fx = camera.fy = 600.0;
  camera.cx = 500.0;
  camera.cy = 400.0;
  camera.distortion[0] = -0.25;
  // Where the lens turns: x + k1 x^3 is largest.
  const double turn = 1.0 / std::sqrt(0.75), turn_px = 600.0 * 2.0 / 3.0 * turn;
  const Eigen::Vector2d pixel(camera.cx + turn_px - 1.0, camera.cy);
  ImagePoints points(camera, {pixel}, {}, {});
  ASSERT_EQ(points.size(), 1U);
  const Eigen::Vector3d line(1.0, 0.0, -turn);
  for (double log_focal = -0.005; log_focal > -0.1; log_focal -= 0.001) {
    double shifts[kCameraSize] = {log_focal};
    const double expected = turn_px - 1.0 - turn_px * std::exp(log_focal);
    for (const bool once : {false, true}) {
      if (once) points.SeeThrough(shifts);
      std::vector<double> distances;
      points.LineDistances(line, shifts, &distances);
      EXPECT_NEAR(distances.front(), expected, 0.6) << log_focal << (once ? ", once" : "");
    }
  }
  CalibratedPoint unused;
  const double shorter[kCameraSize] = {-0.1};
  EXPECT_FALSE(PixelToCalibrated(ShiftedCamera(camera, shorter), pixel, &unused));
}

// The same of a fisheye, whose rays end at a right angle, 5 px beyond one of 89 degrees.
TEST(ImagePointsTest, NorIsAPointBeyondAFisheye) {
  Camera camera;
  camera.model = CameraModel::kFisheye;
  camera.fx = camera.fy = 300.0;
  camera.cx = camera.cy = 500.0;
  const double last = 89.0 * kDegree;
  const Eigen::Vector3d line(0.0, 1.0, std::tan(last));
  for (const double beyond_px : {-0.5, 10.0, 20.0, 50.0}) {
    const double radius_px = 300.0 * last + beyond_px;
    // Of a camera that sees it; shifted to the one that does not.
    Camera longer = camera;
    longer.fx = longer.fy = 400.0;
    ImagePoints points(longer, {{500.0, 500.0 - radius_px}}, {}, {});
    ASSERT_EQ(points.size(), 1U);
    const double shifts[kCameraSize] = {std::log(300.0 / 400.0)};
    std::vector<double> distances;
    points.LineDistances(line, shifts, &distances);
    constexpr double kFirstOrder = 1.5;  // Pixels; a degree there is 5.
    EXPECT_NEAR(distances.front(), -beyond_px, kFirstOrder) << beyond_px;
  }
}

}  // namespace
}  // namespace circline
