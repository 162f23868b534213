// Known radii, lengths and angles.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/estimators/closed_form_solvers.h"
#include "circline/refine/refined_solvers.h"
#include "tests/plane_scene.h"
#include "tests/refine/simulated_options.h"

namespace circline {
namespace {

TEST(KnownMeasuresTest, KnownSizesMakeItMetric) {
  PlaneScene scene(0.7, 0.05);
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("c0", 0.0, 0.0, 1.5)};
  observations.circles[0].center = scene.Pixel(0, 0);
  Observations with_length = observations;
  observations.circles[0].radius = 1.5;
  with_length.known_lengths = {
      KnownLength{Segment{scene.Pixel(-1, 0), scene.Pixel(1, 0.5)}, "", std::hypot(2.0, 0.5)}};
  for (const Observations& o : {observations, with_length}) {
    const PoseHypothesis best = Best(EstimatePose(o, Exact()));
    EXPECT_TRUE(best.metric);
    EXPECT_LT((best.cam_from_world.translation - scene.pose.translation).norm(), 0.03);
    EXPECT_NEAR(best.circles[0].radius, 1.5, 0.01);
    EXPECT_EQ(best.rank, 5);  // All but the spin about the normal.
  }
}

TEST(KnownMeasuresTest, KnownAngleSharpensTheRotation) {
  PlaneScene scene(0.7, 0.5);
  Observations observations = scene.Empty();
  observations.pencils = {
      scene.Pencil("L1", PencilDirection::kFree, Eigen::Vector3d::UnitX()),
      scene.Pencil("L2", PencilDirection::kFree, Eigen::Vector3d(0.6, 0.8, 0.0))};
  const EstimationOptions options = LeastSquares();
  const PoseEstimate without = EstimatePose(observations, options);
  observations.known_angles = {KnownAngle{{"L1", "L2"}, std::acos(0.6), 0.0}};
  const PoseEstimate with = EstimatePose(observations, options);
  ASSERT_TRUE(without.status.ok() && with.status.ok());
  const auto variance = [](const PoseEstimate& e) {
    return e.hypotheses[0].Covariance().topLeftCorner(3, 3).trace();
  };
  EXPECT_LT(variance(with), 0.9 * variance(without));
  ASSERT_EQ(with.hypotheses[0].pencils.size(), 2U);
  const double cosine = std::abs(
      with.hypotheses[0].pencils[0].direction.dot(with.hypotheses[0].pencils[1].direction));
  EXPECT_NEAR(cosine, 0.6, 1e-4);
}

// A circle and its centre tell the plane; what is said of two of its pencils contradicts it.
TEST(KnownMeasuresTest, AWrongAngleIsLeftOut) {
  PlaneScene scene(0.7, 0.2);
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("c0", 0.5, 0.2, 1.5)};
  observations.circles[0].center = scene.Pixel(0.5, 0.2);
  observations.pencils = {
      scene.Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX(), 6, 20),
      scene.Pencil("L2", PencilDirection::kFree, Eigen::Vector3d(0.6, 0.8, 0.0), 6, 20)};
  observations.known_angles = {KnownAngle{{"L1", "L2"}, std::acos(0.6) + 0.3, 0.0}};
  const PoseEstimate estimate = Ok(EstimatePose(observations, Exact()));
  const PoseHypothesis& h = estimate.hypotheses[0];
  EXPECT_EQ(h.left_out, std::vector<std::string>{"angle[0]"});
  EXPECT_TRUE(HasNote(estimate, "the known angle between 'L1' and 'L2'"));
  EXPECT_LT(NormalError(h, scene), 4.0 * SigmaNormal(h));
}

// The least cost of a photo whose focal length is told by what is known exactly, from a camera that
// has so many times it.
double LeastCost(Observations observations, double guess) {
  EstimationOptions options = Exact();
  options.camera_sigma = CameraSigma::Exact();
  options.camera_sigma->log_focal = 0.5;
  observations.stated_focal_px = observations.camera.fx;
  observations.camera.fx *= guess;
  observations.camera.fy *= guess;
  double least = std::numeric_limits<double>::infinity();
  for (const PoseHypothesis& h : EstimatePose(observations, options).hypotheses)
    least = std::min(least, h.cost);
  return least;
}

// What is exact and a focal length that is free leave a bent valley of poses: the refinement does
// not come to rest half-way in it.
TEST(KnownMeasuresTest, ExactOnesLeadToOneMinimumFromAnyGuess) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    PlaneScene scene(0.2, 0.5, seed);  // Half a pixel: as ends drawn by hand have it.
    scene.camera.distortion = {};
    Observations lengths = scene.Empty();
    lengths.circles = {scene.Circle("c0", 0.3, 0.2, 1.2)};
    lengths.pencils = {scene.Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX())};
    Observations angle = lengths;
    for (const auto& [x, y] : {std::pair(3.0, 2.0), {-1.0, 2.5}}) {
      lengths.known_lengths.push_back(KnownLength{
          Segment{scene.Pixel(-2.0, -1.5), scene.Pixel(x, y)}, "p0", std::hypot(x + 2.0, y + 1.5)});
    }
    angle.pencils.push_back(
        scene.Pencil("L2", PencilDirection::kFree, Eigen::Vector3d(0.6, 0.8, 0.0)));
    angle.known_angles = {KnownAngle{{"L1", "L2"}, std::acos(0.6), 0.0}};
    for (const Observations& observations : {lengths, angle}) {
      const double least = LeastCost(observations, 1.0);
      for (const double guess : {0.5, 0.7, 1.4, 2.0})
        EXPECT_NEAR(LeastCost(observations, guess), least, 0.5)
            << seed << " " << guess << " " << observations.known_angles.size();
    }
  }
}

// What is known of features that a solver does not take is not its business.
TEST(KnownMeasuresTest, PairsLeaveOutWhatIsKnownOfOthers) {
  PlaneScene scene(0.7, 0.2);
  Observations observations = scene.Empty();
  observations.pencils = {
      scene.Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX()),
      scene.Pencil("L2", PencilDirection::kFree, Eigen::Vector3d(0.6, 0.8, 0.0)),
      scene.Pencil("L3", PencilDirection::kFree, Eigen::Vector3d(-0.8, 0.6, 0.0))};
  observations.circles = {scene.Circle("c0", 1.0, 1.0, 0.5)};
  observations.circles[0].plane = "p1";
  observations.frame.plane = "p0";
  observations.known_angles = {KnownAngle{{"L2", "L3"}, 0.5 * kPi, 0.0}};
  observations.known_lengths = {
      KnownLength{Segment{scene.Pixel(0, 0), scene.Pixel(1, 0)}, "p1", 1.0}};
  SolverRegistry registry;
  AddClosedFormSolvers(&registry);
  AddRefinedSolvers(&registry, Exact());
  const PoseHypothesis best =
      Best(registry.Find("line_pairs", SolverStage::kRefined)->Solve(observations));
  EXPECT_LT(NormalError(best, scene), 0.02);
}

// What cannot be used, or contradicts every pose, is named.
TEST(KnownMeasuresTest, KnowledgeThatHasNoPartIsNamed) {
  PlaneScene scene(1.1, 0.1);
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("c0", 0.5, 0.2, 1.0), scene.Circle("c1", 2.0, 1.0, 0.4)};
  observations.circles[1].plane = "p1";
  observations.pencils = {scene.Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX()),
                          scene.Pencil("L2", PencilDirection::kY, Eigen::Vector3d::UnitY())};
  observations.known_angles = {KnownAngle{{"L1", "L2"}, 1.5, 0.0}};
  observations.known_lengths = {
      KnownLength{Segment{scene.Pixel(0, 0), scene.Pixel(1, 0)}, "p1", 1.0}};
  PoseEstimate estimate = EstimatePose(observations, Exact());
  ASSERT_TRUE(estimate.status.ok()) << estimate.status.message;
  EXPECT_TRUE(HasNote(estimate, "'L1' and 'L2': not used, both run along axes"));
  EXPECT_TRUE(HasNote(estimate, "a known length of the plane 'p1': not used"));
  EXPECT_TRUE(HasNote(estimate, "circle 'c1': not used, not in the world's plane 'p0'"));
}

// Degrees, above all.
TEST(KnownMeasuresTest, AnAngleOfMoreThanATurnIsRefused) {
  PlaneScene scene(1.1, 0.1);
  Observations observations = scene.Empty();
  observations.pencils = {scene.Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX()),
                          scene.Pencil("L2", PencilDirection::kFree, Eigen::Vector3d::UnitY())};
  for (const double wrong : {90.0, 6.3, -7.0, std::nan("")}) {
    observations.known_angles = {KnownAngle{{"L1", "L2"}, wrong, 0.0}};
    const PoseEstimate estimate = EstimatePose(observations, Exact());
    EXPECT_EQ(estimate.status.code, StatusCode::kInvalidArgument) << wrong;
    EXPECT_NE(estimate.status.message.find("'L1' and 'L2': value must be within 2 pi"),
              std::string::npos)
        << estimate.status.message;
  }
  for (const double right : {0.0, -kPi, 180.0 * kDegree}) {
    observations.known_angles = {KnownAngle{{"L1", "L2"}, right, 0.0}};
    EXPECT_TRUE(observations.Validate().ok()) << right;
  }
}

// A circle that names no plane lies in none of the world, and nothing does in one misspelt.
TEST(KnownMeasuresTest, WhatIsOutsideTheWorldsPlaneIsNamed) {
  PlaneScene scene(1.1, 0.1);
  Observations observations = scene.Empty();
  for (const char* id : {"c0", "c1", "c2", "c3", "c4"}) {
    observations.circles.push_back(scene.Circle(id, 0.5, 0.2, 1.0));
    observations.circles.back().plane.clear();
  }
  observations.pencils = {scene.Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX()),
                          scene.Pencil("L2", PencilDirection::kY, Eigen::Vector3d::UnitY())};
  const PoseEstimate beside = Ok(EstimatePose(observations, Exact()));
  EXPECT_TRUE(HasNote(beside, "circles 'c0', 'c1', 'c2' and 2 more: not used, not in the world's"));

  for (CircleObservation& circle : observations.circles) circle.plane = "p0";
  observations.pencils.push_back(
      scene.Pencil("L3", PencilDirection::kFree, Eigen::Vector3d(0.6, 0.8, 0.0)));
  EXPECT_FALSE(HasNote(EstimatePose(observations, Exact()), "not used"));
  observations.frame.plane = "P0";
  const PoseEstimate misspelt = EstimatePose(observations, Exact());
  EXPECT_TRUE(HasNote(misspelt, "plane 'P0', which no circle or pencil names"));
  EXPECT_TRUE(HasNote(misspelt, "pencil 'L3': not used"));
}

// A length says nothing of which of the two poses of a circle is right.
TEST(KnownMeasuresTest, ACircleAndALengthLeaveTwoEquallyLikelyPoses) {
  for (const double tilt : {0.5, 0.7, 0.9}) {
    PlaneScene scene(tilt, 0.3);
    Observations observations = scene.Empty();
    observations.circles = {scene.Circle("c0", 0.5, 0.2, 1.0)};
    observations.known_lengths = {
        KnownLength{Segment{scene.Pixel(0, 0), scene.Pixel(1, 0)}, "p0", 1.0}};
    const PoseEstimate estimate = EstimatePose(observations, Exact());
    ASSERT_EQ(estimate.hypotheses.size(), 2U) << estimate.status.message;
    EXPECT_NEAR(estimate.hypotheses[0].probability, 0.5, 0.05) << tilt;
    EXPECT_TRUE(estimate.hypotheses[0].metric);
  }
}

// One end of a known length is in the sky: that turns no pose over, it is left out and named.
TEST(KnownMeasuresTest, ALengthBeyondTheHorizonIsLeftOut) {
  PlaneScene scene(1.1, 0.1);
  const Eigen::Vector3d normal = scene.pose.rotation.col(2), ahead = Eigen::Vector3d::UnitZ();
  Eigen::Vector2d sky;
  ASSERT_TRUE(CameraToPixel(scene.camera, ahead - (normal.dot(ahead) - 0.1) * normal, &sky));
  Observations circle = scene.Empty(), lines = scene.Empty();
  circle.circles = {scene.Circle("c0", 0.5, 0.2, 1.0)};
  circle.circles[0].center = scene.Pixel(0.5, 0.2);
  lines.pencils = {scene.Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX()),
                   scene.Pencil("L2", PencilDirection::kY, Eigen::Vector3d::UnitY())};
  Observations both = circle;
  both.pencils = lines.pencils;
  for (Observations observations : {circle, lines, both}) {
    observations.known_lengths = {KnownLength{Segment{scene.Pixel(0, 0), sky}, "p0", 1.0}};
    const PoseEstimate wrong = Ok(EstimatePose(observations, Exact()));
    // Of the circle alone another pose may explain the length and not the centre.
    if (!observations.pencils.empty()) {
      EXPECT_LT(NormalError(wrong.hypotheses[0], scene), 0.05);
      EXPECT_FALSE(wrong.hypotheses[0].metric);
      EXPECT_NE(wrong.notes.back().find("known length"), std::string::npos);
    } else {
      EXPECT_GT(wrong.hypotheses.size(), 1U);
    }
    // Another that is right makes it metric.
    observations.known_lengths.push_back(
        KnownLength{Segment{scene.Pixel(-1, 0), scene.Pixel(1, 0)}, "p0", 2.0});
    const PoseHypothesis best = Best(EstimatePose(observations, Exact()));
    EXPECT_LT(NormalError(best, scene), 0.05);
    EXPECT_TRUE(best.metric);
    EXPECT_TRUE(best.Covariance().allFinite());
  }
}

}  // namespace
}  // namespace circline
