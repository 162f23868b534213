// What closed forms say where the evidence is missing, degenerate or broken, or no ray reaches it.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>
#include <string>

#include "tests/estimators/closed_form_call.h"

namespace circline {
namespace {

TEST(ClosedFormRefusalsTest, RefusalsNameWhatIsMissing) {
  PlaneScene scene;
  Observations observations = scene.Empty();
  const auto message = [&](const std::string& name) {
    const PoseEstimate estimate = SolveClosedForm(name, observations);
    EXPECT_EQ(estimate.status.code, StatusCode::kRefused) << name;
    EXPECT_TRUE(estimate.hypotheses.empty());
    return estimate.status.message;
  };
  EXPECT_NE(message("single_circle").find("circle"), std::string::npos);
  EXPECT_NE(message("line_pairs").find("pencil"), std::string::npos);
  observations.circles = {scene.Circle("c0", 0.0, 0.0, 1.0)};
  EXPECT_NE(message("circle_center").find("centre"), std::string::npos);
  EXPECT_NE(message("circle_frame").find("axis"), std::string::npos);
  EXPECT_NE(message("parallel_circles").find("two"), std::string::npos);
  EXPECT_NE(message("concentric_circles").find("concentric"), std::string::npos);
  observations.pencils = {scene.Pencil("L1", PencilDirection::kFree, Eigen::Vector3d::UnitX())};
  EXPECT_NE(message("line_pairs").find("L1"), std::string::npos);
  // The same direction twice.
  observations.pencils.push_back(observations.pencils[0]);
  observations.pencils[1].id = "L2";
  EXPECT_NE(message("line_pairs").find("same direction"), std::string::npos);
}

// Axes on one line span no plane.
TEST(ClosedFormRefusalsTest, NothingIsDecidedWhereNoPoseFits) {
  PlaneScene scene;
  Observations observations = OneCircle(&scene);
  observations.frame.x_axis = Segment{scene.Pixel(0, 0), scene.Pixel(2, 0)};
  observations.frame.y_axis = observations.frame.x_axis;
  const PoseEstimate estimate = SolveClosedForm("circle_frame", observations);
  EXPECT_EQ(estimate.status.code, StatusCode::kRefused);
  EXPECT_TRUE(estimate.hypotheses.empty());
  EXPECT_EQ(estimate.decided_by, "");
}

// Where the camera cannot undistort the origin another point takes its place, as where none is
// given; a length whose ends it cannot undistort leaves the word to the next one.
TEST(ClosedFormRefusalsTest, PixelsThatNoRayReachesSayNothing) {
  PlaneScene scene;
  scene.camera.distortion = {-0.2};  // The image ends where a ray is bent back.
  const Eigen::Vector2d outside(2000.0, 2000.0);
  CalibratedPoint point;
  ASSERT_FALSE(PixelToCalibrated(scene.camera, outside, &point));
  Observations observations = OneCircle(&scene);
  observations.circles[0].center = scene.Pixel(0.5, 0.2);
  observations.pencils = {AlongX(&scene), AlongY(&scene)};
  observations.known_lengths = {
      KnownLength{Segment{scene.Pixel(0, 0), outside}, "p0", 5.0},
      KnownLength{Segment{scene.Pixel(0, 0), scene.Pixel(2, 0)}, "p0", 2.0}};
  for (const char* name : {"circle_center", "line_pairs"}) {
    observations.frame.origin = scene.Pixel(0, 0);
    PoseEstimate estimate = SolveClosedForm(name, observations);
    ASSERT_FALSE(estimate.hypotheses.empty()) << estimate.status.message;
    EXPECT_TRUE(estimate.hypotheses[0].origin_observed) << name;
    EXPECT_TRUE(estimate.hypotheses[0].metric) << name;
    EXPECT_LT((estimate.hypotheses[0].cam_from_world.translation - scene.pose.translation).norm(),
              1e-6)
        << name;
    observations.frame.origin = outside;
    estimate = SolveClosedForm(name, observations);
    ASSERT_FALSE(estimate.hypotheses.empty()) << estimate.status.message;
    EXPECT_FALSE(estimate.hypotheses[0].origin_observed) << name;
  }
}

TEST(ClosedFormRefusalsTest, BrokenInputIsInvalidNotFatal) {
  PlaneScene scene;
  Observations observations = OneCircle(&scene, 0.0, 0.0);
  observations.circles[0].points[3].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(SolveClosedForm("single_circle", observations).status.code,
            StatusCode::kInvalidArgument);
  observations = scene.Empty();
  observations.camera.fx = 0.0;
  EXPECT_EQ(SolveClosedForm("single_circle", observations).status.code,
            StatusCode::kInvalidArgument);
}

TEST(ClosedFormRefusalsTest, ALengthOfAPlaneThatIsNotThereIsNamed) {
  PlaneScene scene;
  Observations observations = OneCircle(&scene, 0.0, 0.0);
  observations.known_lengths = {KnownLength{Segment{scene.Pixel(0, 0), scene.Pixel(1, 0)}, "", 1}};
  EXPECT_TRUE(observations.Validate().ok());
  observations.known_lengths[0].plane = observations.circles[0].plane;
  EXPECT_TRUE(observations.Validate().ok());
  observations.known_lengths[0].plane = "table";
  EXPECT_NE(SolveClosedForm("circle_frame", observations).status.message.find("'table'"),
            std::string::npos);
}

}  // namespace
}  // namespace circline
