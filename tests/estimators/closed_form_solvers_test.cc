#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <string>

#include "circline/estimators/basics.h"
#include "tests/estimators/closed_form_call.h"

namespace circline {
namespace {

// Adds the drawn axes, on lines of their own.
void DrawAxes(PlaneScene* scene, Observations* observations) {
  observations->frame.x_axis = Segment{scene->Pixel(0, 0), scene->Pixel(2, 0)};
  observations->frame.y_axis = Segment{scene->Pixel(0, 0), scene->Pixel(0, 2)};
}

TEST(ClosedFormSolversTest, SingleCircleReturnsBothPosesAsEquals) {
  PlaneScene scene;
  Observations observations = OneCircle(&scene);
  const PoseEstimate estimate = SolveClosedForm("single_circle", observations);
  ASSERT_TRUE(estimate.status.ok());
  ASSERT_EQ(estimate.hypotheses.size(), 2U);
  EXPECT_LT(std::min(NormalError(estimate.hypotheses[0], scene),
                     NormalError(estimate.hypotheses[1], scene)),
            kExact);
  EXPECT_NEAR(estimate.hypotheses[0].probability, 0.5, 1e-9);
  for (const PoseHypothesis& h : estimate.hypotheses) {
    EXPECT_TRUE(h.RotationIsFree());
    EXPECT_TRUE(std::isinf(h.SigmaRotation().maxCoeff()));
    EXPECT_EQ(h.rank, 4);  // The normal, and the direction of the centre.
    EXPECT_FALSE(h.metric);
    EXPECT_NEAR(h.cam_from_world.translation.norm(), 1.0, 1e-12);
    EXPECT_LT(h.cam_from_world.rotation.col(2).dot(h.cam_from_world.translation), 0.0);
  }
}

TEST(ClosedFormSolversTest, CenterDecidesAndRadiusMakesItMetric) {
  PlaneScene scene;
  Observations observations = OneCircle(&scene);
  observations.circles[0].center = scene.Pixel(0.5, 0.2);
  observations.circles[0].radius = 1.0;
  const PoseEstimate estimate = SolveClosedForm("circle_center", observations);
  ASSERT_EQ(estimate.hypotheses.size(), 2U);
  const PoseHypothesis& best = estimate.hypotheses[0];
  EXPECT_LT(NormalError(best, scene), kExact);
  EXPECT_GT(best.probability, 0.999);
  EXPECT_TRUE(best.metric);
  const Eigen::Vector3d center =
      scene.pose.rotation * Eigen::Vector3d(0.5, 0.2, 0.0) + scene.pose.translation;
  EXPECT_LT((best.cam_from_world.translation - center).norm(), 1e-6);
  ASSERT_EQ(best.circles.size(), 1U);
  EXPECT_NEAR(best.circles[0].radius, 1.0, 1e-6);
  EXPECT_LT((best.circles[0].center_px - *observations.circles[0].center).norm(), 1e-5);
}

TEST(ClosedFormSolversTest, DiametersAreAsGoodAsTheCenter) {
  PlaneScene scene;
  Observations observations = OneCircle(&scene);
  observations.circles[0].diameters = {Segment{scene.Pixel(-0.5, 0.2), scene.Pixel(1.5, 0.2)},
                                       Segment{scene.Pixel(0.5, -0.8), scene.Pixel(0.5, 1.2)}};
  const PoseEstimate estimate = SolveClosedForm("circle_diameters", observations);
  ASSERT_EQ(estimate.hypotheses.size(), 2U) << estimate.status.message;
  EXPECT_LT(NormalError(estimate.hypotheses[0], scene), kExact);
  EXPECT_GT(estimate.hypotheses[0].probability, 0.99);
}

TEST(ClosedFormSolversTest, CirclesOfOnePlaneDecideTogether) {
  PlaneScene scene;
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("c0", 1.0, 0.5, 0.8), scene.Circle("c1", -1.5, -0.5, 0.9)};
  PoseEstimate estimate = SolveClosedForm("parallel_circles", observations);
  ASSERT_EQ(estimate.hypotheses.size(), 2U) << estimate.status.message;
  EXPECT_LT(NormalError(estimate.hypotheses[0], scene), kExact);
  EXPECT_GT(estimate.hypotheses[0].probability, 0.99);
  observations.circles = {scene.Circle("c0", 0.5, 0.2, 1.2), scene.Circle("c1", 0.5, 0.2, 0.7)};
  for (CircleObservation& circle : observations.circles) circle.concentric = "g0";
  estimate = SolveClosedForm("concentric_circles", observations);
  ASSERT_EQ(estimate.hypotheses.size(), 2U) << estimate.status.message;
  EXPECT_LT(NormalError(estimate.hypotheses[0], scene), kExact);
  EXPECT_GT(estimate.hypotheses[0].probability, 0.99);
}

TEST(ClosedFormSolversTest, CircleFrameRecoversTheDrawnFrame) {
  PlaneScene scene;
  Observations observations = OneCircle(&scene);
  DrawAxes(&scene, &observations);
  const PoseEstimate estimate = SolveClosedForm("circle_frame", observations);
  ASSERT_TRUE(estimate.status.ok()) << estimate.status.message;
  const PoseHypothesis& best = estimate.hypotheses[0];
  EXPECT_LT(RotationAngle(best.cam_from_world.rotation, scene.pose.rotation), 1e-7);
  EXPECT_TRUE(best.origin_observed);
  EXPECT_LT((best.cam_from_world.translation - scene.pose.translation.normalized()).norm(), 1e-7);
}

// The drawn pieces of the axes are seen; where they meet lies behind the camera.
TEST(ClosedFormSolversTest, TheOriginMayLieBehindTheCamera) {
  PlaneScene scene(1.2);
  scene.camera.distortion = {};
  // Seen at a flat angle; the origin is on the plane, 8 behind the camera's centre.
  scene.pose.translation = Eigen::Vector3d(0.5, 2.0, -8.0);
  const auto along = [&](double x, double y) {
    const Eigen::Vector3d X = scene.pose.rotation * Eigen::Vector3d(x, y, 0.0);
    return (X + scene.pose.translation).z();
  };
  // A step along each axis that moves forwards.
  const double sx = along(1, 0) > along(0, 0) ? 1.0 : -1.0;
  const double sy = along(0, 1) > along(0, 0) ? 1.0 : -1.0;
  const double near = 60.0;
  ASSERT_GT(along(near * sx, 0.0), 1.0);
  ASSERT_GT(along(0.0, near * sy), 1.0);
  Observations observations = scene.Empty();
  observations.frame.x_axis =
      Segment{scene.Pixel(near * sx, 0.0), scene.Pixel((near + 9.0 * sx) * sx, 0.0)};
  observations.frame.y_axis =
      Segment{scene.Pixel(0.0, near * sy), scene.Pixel(0.0, (near + 9.0 * sy) * sy)};
  PencilObservation x, y;
  x.id = "x";
  x.direction = PencilDirection::kX;
  y.id = "y";
  y.direction = PencilDirection::kY;
  x.plane = y.plane = "p0";
  for (double offset : {0.0, 1.0, 2.0}) {
    x.lines.push_back(scene.Line({near * sx, offset, 0.0}, {(near + 9.0) * sx, offset, 0.0}));
    y.lines.push_back(scene.Line({offset, near * sy, 0.0}, {offset, (near + 9.0) * sy, 0.0}));
  }
  observations.pencils = {x, y};
  const PoseEstimate estimate = SolveClosedForm("line_pairs", observations);
  ASSERT_EQ(estimate.hypotheses.size(), 1U) << estimate.status.message;
  const CameraPose& pose = estimate.hypotheses[0].cam_from_world;
  EXPECT_LT(RotationAngle(pose.rotation, scene.pose.rotation), 1e-6);
  EXPECT_LT((pose.translation - scene.pose.translation.normalized()).norm(), 1e-6);
}

// Axes drawn the other way round, or so that Z points away from the camera, are taken as drawn.
TEST(ClosedFormSolversTest, AxesDecideTheSigns) {
  PlaneScene scene;
  Observations observations = OneCircle(&scene);
  observations.frame.x_axis = Segment{scene.Pixel(0, 0), scene.Pixel(-2, 0)};
  observations.frame.y_axis = Segment{scene.Pixel(0, 0), scene.Pixel(0, 2)};
  const PoseEstimate estimate = SolveClosedForm("circle_frame", observations);
  ASSERT_TRUE(estimate.status.ok());
  const Eigen::Matrix3d drawn = scene.pose.rotation * Eigen::Vector3d(-1.0, 1.0, -1.0).asDiagonal();
  EXPECT_LT(RotationAngle(estimate.hypotheses[0].cam_from_world.rotation, drawn), 1e-7);
}

// Lines that run along the axes serve as well as the axes; where they cross says nothing of the
// origin.
TEST(ClosedFormSolversTest, CircleFrameTakesLinesAlongTheAxes) {
  PlaneScene scene;
  Observations observations = OneCircle(&scene);
  observations.pencils = {AlongX(&scene, 2), AlongY(&scene, 2)};
  observations.frame.origin_is_center = "c0";
  const PoseEstimate estimate = SolveClosedForm("circle_frame", observations);
  ASSERT_TRUE(estimate.status.ok()) << estimate.status.message;
  EXPECT_LT(NormalError(estimate.hypotheses[0], scene), kExact);
}

TEST(ClosedFormSolversTest, LinePairsForAnyTwoDirections) {
  PlaneScene scene;
  // Orthogonal, with roles; then oblique and free; then along X and the normal.
  Observations observations = scene.Empty();
  observations.pencils = {AlongX(&scene), AlongY(&scene)};
  DrawAxes(&scene, &observations);
  for (const char* name : {"line_pairs", "orthogonal_vanishing_points"}) {
    const PoseEstimate estimate = SolveClosedForm(name, observations);
    ASSERT_EQ(estimate.hypotheses.size(), 1U) << estimate.status.message;
    EXPECT_LT(RotationAngle(estimate.hypotheses[0].cam_from_world.rotation, scene.pose.rotation),
              1e-7);
  }
  observations.pencils = {
      scene.Pencil("L1", PencilDirection::kFree, Eigen::Vector3d::UnitX()),
      scene.Pencil("L2", PencilDirection::kFree, Eigen::Vector3d(0.6, 0.8, 0.0))};
  observations.frame = FrameObservation();
  PoseEstimate estimate = SolveClosedForm("line_pairs", observations);
  ASSERT_EQ(estimate.hypotheses.size(), 1U) << estimate.status.message;
  EXPECT_LT(NormalError(estimate.hypotheses[0], scene), kExact);
  EXPECT_LT(estimate.hypotheses[0]
                .cam_from_world.rotation.col(0)
                .cross(scene.pose.rotation.col(0))
                .norm(),
            kExact);
  ASSERT_FALSE(estimate.notes.empty());
  EXPECT_NE(estimate.notes.back().find("'L1' and 'L2' are 53.13 +- "), std::string::npos)
      << estimate.notes.back();
  EXPECT_FALSE(SolveClosedForm("orthogonal_vanishing_points", observations).status.ok());

  observations.pencils = {scene.Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX()),
                          scene.Pencil("L3", PencilDirection::kZ, Eigen::Vector3d::UnitZ())};
  estimate = SolveClosedForm("line_pairs", observations);
  ASSERT_EQ(estimate.hypotheses.size(), 1U) << estimate.status.message;
  EXPECT_LT(NormalError(estimate.hypotheses[0], scene), kExact);
}

// One standard deviation of a short arc's conic may lead beyond the ellipses: that is no reason to
// leave out what it says.
TEST(ClosedFormSolversTest, MoreNoiseIsNeverMoreCertain) {
  PlaneScene scene;
  Observations observations = scene.Empty();
  CircleObservation arc = scene.Circle("c0", 0.5, 0.2, 1.0, 60);
  arc.points.resize(15);
  double before = 0.0;
  for (const double sigma_px : {0.03, 0.1, 0.3, 1.0, 3.0, 10.0}) {
    arc.sigma_px = sigma_px;
    observations.circles = {arc};
    const PoseEstimate estimate = SolveClosedForm("single_circle", observations);
    ASSERT_TRUE(estimate.status.ok()) << estimate.status.message;
    const double variance = estimate.hypotheses[0].Covariance().topLeftCorner<3, 3>().trace();
    EXPECT_GT(variance, before) << sigma_px;
    before = variance;
  }
}

// Directions have no sense: 70 degrees are 110, -70 and 250.
TEST(ClosedFormSolversTest, KnownAnglesHaveNoSense) {
  const Eigen::Vector3d oblique(std::cos(1.2), std::sin(1.2), 0.0);
  PlaneScene scene(0.7, 0.3);
  Observations observations = scene.Empty();
  observations.pencils = {scene.Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX(), 4),
                          scene.Pencil("L2", PencilDirection::kFree, oblique, 4)};
  std::vector<Eigen::Matrix3d> rotations;
  for (const double angle : {1.2, -1.2, kPi - 1.2, kPi + 1.2, 2.0 * kPi - 1.2}) {
    observations.known_angles = {KnownAngle{{"L1", "L2"}, angle, 0.0}};
    const PoseEstimate estimate = SolveClosedForm("line_pairs", observations);
    ASSERT_TRUE(estimate.status.ok()) << estimate.status.message;
    rotations.push_back(estimate.hypotheses[0].cam_from_world.rotation);
    EXPECT_LT((rotations.back() - rotations.front()).norm(), 1e-12) << angle;
  }
}

// A line that is not parallel to the others of its pencil has no say.
TEST(ClosedFormSolversTest, OddLinesAreLeftOut) {
  PlaneScene scene(0.7, 0.3);
  Observations observations = scene.Empty();
  observations.pencils = {AlongX(&scene, 4), AlongY(&scene, 4)};
  Observations odd = observations;
  LineObservation line = scene.Line({-1.5, 0.3, 0.0}, {1.5, 1.1, 0.0});
  line.is_parallel = false;
  odd.pencils[0].lines.push_back(line);
  for (const char* name : {"orthogonal_vanishing_points", "line_pairs"}) {
    const PoseHypothesis with = SolveClosedForm(name, odd).hypotheses[0];
    const PoseHypothesis without = SolveClosedForm(name, observations).hypotheses[0];
    EXPECT_EQ(with.cam_from_world.rotation, without.cam_from_world.rotation);
    EXPECT_EQ(with.num_inliers, without.num_inliers);
    EXPECT_EQ(with.num_observations, without.num_observations + 2);
  }
}

}  // namespace
}  // namespace circline
