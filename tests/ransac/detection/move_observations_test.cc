#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/ransac/detection/follow/follow_observations.h"
#include "tests/pinhole_camera.h"

namespace circline {
namespace {

// Lines that are followed have no vanishing point of their own in the frame; what a new look finds
// must not take their name if it runs otherwise.
TEST(MoveObservations, PencilsThatNobodyHasFittedRunAsTheTrackSays) {
  Observations held;
  held.camera = PinholeCamera();
  held.pencils.resize(2);
  held.pencils[0].id = "L0";
  held.pencils[1].id = "L1";  // Not known to the track.
  PoseHypothesis last;
  last.cam_from_world.translation = {0.0, 0.0, 5.0};
  const Eigen::Vector3d direction = Eigen::Vector3d(1.0, 0.2, -0.4).normalized();
  last.pencils = {{"L0", direction, 0.5}};
  CameraPose next = last.cam_from_world;
  next.rotation = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const Observations moved = MoveObservations(held, last, next);
  ASSERT_TRUE(moved.pencils[0].fit);
  const VanishingPointFit& fit = *moved.pencils[0].fit;
  EXPECT_LT((fit.direction - next.rotation * direction).norm(), 1e-12);
  // Two components of half a degree, across the direction.
  EXPECT_NEAR(fit.covariance.trace(), 2.0 * 0.25 * kDegree * kDegree, 1e-12);
  EXPECT_LT((fit.covariance * fit.direction).norm(), 1e-12);
  EXPECT_FALSE(moved.pencils[1].fit);
}

// A pose is that of the camera that was found with it, pixels are calibrated by the one given.
TEST(MoveObservations, PointsMoveAsTheCameraFoundSeesThem) {
  Observations held;
  held.camera = PinholeCamera();
  constexpr double kScale = 1.6;
  Camera own = held.camera;
  own.fx *= kScale;
  own.fy *= kScale;
  PoseHypothesis last;
  last.focal_scale = kScale;
  last.cam_from_world.rotation =
      Eigen::AngleAxisd(2.6, Eigen::Vector3d(1.0, 0.2, 0.0).normalized()).toRotationMatrix();
  last.cam_from_world.translation = {0.3, -0.2, 5.0};
  CameraPose next = last.cam_from_world;
  next.rotation = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()) * next.rotation;
  next.translation += Eigen::Vector3d(0.1, 0.2, -0.3);
  const auto seen = [&](const CameraPose& pose, double x) {
    Eigen::Vector2d pixel;
    EXPECT_TRUE(CameraToPixel(own, pose.rotation * Eigen::Vector3d(x, 0.4, 0.0) + pose.translation,
                              &pixel));
    return pixel;
  };
  held.frame.plane = "p0";
  held.pencils.resize(1);
  held.pencils[0].plane = "p0";
  held.pencils[0].lines.resize(1);
  held.pencils[0].lines[0].points = {seen(last.cam_from_world, -1.0),
                                     seen(last.cam_from_world, 1.0)};
  const Observations moved = MoveObservations(held, last, next);
  const std::vector<Eigen::Vector2d>& points = moved.pencils[0].lines[0].points;
  EXPECT_LT((points[0] - seen(next, -1.0)).norm(), 1e-9);
  EXPECT_LT((points[1] - seen(next, 1.0)).norm(), 1e-9);
}

}  // namespace
}  // namespace circline
