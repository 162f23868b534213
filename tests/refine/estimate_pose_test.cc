#include "circline/refine/estimate_pose.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "circline/estimators/basics.h"
#include "tests/basics.h"
#include "tests/paper_scene.h"
#include "tests/plane_scene.h"
#include "tests/refine/simulated_options.h"
#include "tests/trials.h"

namespace circline {
namespace {

TEST(EstimatePoseTest, OneCircleHasTwoPosesOfEqualProbability) {
  PlaneScene scene(0.7, 0.2);
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("c0", 0.5, 0.2, 1.0)};
  const PoseEstimate estimate = Ok(EstimatePose(observations, Exact()));
  ASSERT_EQ(estimate.hypotheses.size(), 2U);
  EXPECT_NEAR(estimate.hypotheses[0].probability, 0.5, 0.02);
  EXPECT_NEAR(estimate.hypotheses[0].probability + estimate.hypotheses[1].probability, 1.0, 1e-12);
  EXPECT_LT(std::min(NormalError(estimate.hypotheses[0], scene),
                     NormalError(estimate.hypotheses[1], scene)),
            0.02);
  EXPECT_TRUE(estimate.hypotheses[0].RotationIsFree());
  EXPECT_NE(estimate.decided_by.find("nothing"), std::string::npos);
}

TEST(EstimatePoseTest, MoreEvidenceDecides) {
  PlaneScene scene(0.7, 0.2);
  Observations circle = scene.Empty();
  circle.circles = {scene.Circle("c0", 0.5, 0.2, 1.0)};
  Observations with_center = circle, with_lines = circle, with_ring = circle,
               with_diameters = circle;
  with_center.circles[0].center = scene.Pixel(0.5, 0.2);
  with_lines.pencils = {scene.Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX()),
                        scene.Pencil("L2", PencilDirection::kY, Eigen::Vector3d::UnitY())};
  with_ring.circles.push_back(scene.Circle("c1", 0.5, 0.2, 1.8));
  for (CircleObservation& c : with_ring.circles) c.concentric = "g0";
  with_diameters.circles[0].diameters = {Segment{scene.Pixel(-0.5, 0.2), scene.Pixel(1.5, 0.2)},
                                         Segment{scene.Pixel(0.5, -0.8), scene.Pixel(0.5, 1.2)}};
  for (const Observations& observations : {with_center, with_lines, with_ring, with_diameters}) {
    const PoseHypothesis best = Best(EstimatePose(observations, Exact()));
    EXPECT_LT(NormalError(best, scene), 0.02);
    EXPECT_GT(best.probability, 0.95);
  }
}

// The points of a contour share an error and count less for it; a pose that has none of them within
// reach of a redescending loss, and the few ends of the lines exactly, must not win by that.
TEST(EstimatePoseTest, ExplainingNoContourIsDear) {
  for (const LossType loss : {LossType::kTukey, LossType::kGemanMcClure}) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      PlaneScene scene(0.8, 0.05, seed);
      Observations observations = scene.Empty();
      observations.circles = {scene.Circle("c0", 0.0, 0.0, 0.5, 80)};
      observations.circles[0].sigma_px = 0.0;
      observations.pencils = {scene.Pencil("x", PencilDirection::kX, Eigen::Vector3d::UnitX(), 2),
                              scene.Pencil("y", PencilDirection::kY, Eigen::Vector3d::UnitY(), 2)};
      // Drawn by hand: half a pixel off.
      for (PencilObservation& pencil : observations.pencils) {
        pencil.sigma_px = 0.2;
        for (LineObservation& line : pencil.lines) {
          for (Eigen::Vector2d& p : line.points) p += Noise2(0.5, &scene.random);
        }
      }
      const PoseHypothesis best = Best(EstimatePose(observations, Exact(loss)));
      EXPECT_LT(NormalError(best, scene), 0.05) << LossName(loss) << ", seed " << seed;
    }
  }
}

// Rotation and translation covariance against the errors of many trials, all kinds of evidence at
// once.
TEST(EstimatePoseTest, CovarianceIsHonest) {
  constexpr int kTrials = Trials(200);
  PlaneScene scene(0.7, 0.3, 5);
  double rotation_nees = 0.0, translation_nees = 0.0;
  for (int i = 0; i < kTrials; ++i) {
    Observations observations = scene.Empty();
    observations.circles = {scene.Circle("c0", 0.0, 0.0, 1.5), scene.Circle("c1", 0.0, 0.0, 0.8)};
    for (CircleObservation& c : observations.circles) c.concentric = "g0";
    observations.circles[0].radius = 1.5;
    observations.pencils = {
        scene.Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX()),
        scene.Pencil("L2", PencilDirection::kFree, Eigen::Vector3d(0.6, 0.8, 0.0)),
        scene.Pencil("L3", PencilDirection::kZ, Eigen::Vector3d::UnitZ())};
    const auto& axis = observations.pencils[0].lines[1].points;
    observations.frame.x_axis = Segment{axis[0], axis[1]};
    observations.frame.origin_is_center = "c0";
    const PoseHypothesis h = Best(EstimatePose(observations, LeastSquares()));
    EXPECT_EQ(h.rank, 6);
    rotation_nees += RotationNees(h, scene.pose) / kTrials;
    const Eigen::Vector3d translation = scene.pose.translation - h.cam_from_world.translation;
    translation_nees +=
        translation.dot(h.Covariance().bottomRightCorner<3, 3>().inverse() * translation) / kTrials;
  }
  if (kSanitized) return;
  EXPECT_NEAR(rotation_nees, 3.0, 0.5);
  EXPECT_NEAR(translation_nees, 3.0, 0.5);
}

// Circles alone leave the spin about their normal free.
TEST(EstimatePoseTest, OfCirclesAloneTheNormalIsWithinItsSigma) {
  PlaneScene scene(0.7, 0.3);
  const int trials = Trials(200);
  double nees = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    Observations observations = scene.Empty();
    observations.circles = {scene.Circle("c0", -0.6, 0.2, 0.5), scene.Circle("c1", 1.0, -0.3, 0.7)};
    nees += RotationNees(Best(EstimatePose(observations, LeastSquares())), scene.pose) / trials;
  }
  EXPECT_TRUE(std::isfinite(nees));
  if (kSanitized) return;
  EXPECT_NEAR(nees, 2.0, 0.5);
}

// Scattered ones; a whole arc that lies off is for FitObservations to find.
TEST(EstimatePoseTest, RobustLossSurvivesOutliers) {
  PlaneScene scene(0.7, 0.3, 9);
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("c0", 0.0, 0.0, 1.5, 100)};
  observations.circles[0].center = scene.Pixel(0, 0);
  const Eigen::Vector2d middle = *observations.circles[0].center;
  for (std::size_t i = 0; i < 15; ++i) {
    Eigen::Vector2d& p = observations.circles[0].points[6 * i];
    p += 4.0 * (p - middle).normalized();
  }
  EstimationOptions options = Exact();
  options.conic_loss.type = LossType::kTukey;
  const PoseHypothesis best = Best(EstimatePose(observations, options));
  EXPECT_LT(NormalError(best, scene), 0.02);
  // 85 points and the centre, but for a few beyond the gate by chance.
  EXPECT_LE(best.num_inliers, 86);
  EXPECT_GE(best.num_inliers, 83);
  EXPECT_EQ(best.num_observations, 101);
}

TEST(EstimatePoseTest, RefusalsAndBadInputHaveASentence) {
  PlaneScene scene;
  Observations observations = scene.Empty();
  PoseEstimate estimate = EstimatePose(observations, Exact());
  EXPECT_EQ(estimate.status.code, StatusCode::kRefused);
  EXPECT_FALSE(estimate.status.message.empty());
  observations.pencils = {scene.Pencil("L1", PencilDirection::kFree, Eigen::Vector3d::UnitX())};
  estimate = EstimatePose(observations, Exact());
  EXPECT_EQ(estimate.status.code, StatusCode::kRefused);
  EXPECT_NE(estimate.status.message.find("L1"), std::string::npos);
  observations.circles = {scene.Circle("c0", 0.0, 0.0, 1.0)};
  observations.circles.push_back(observations.circles[0]);
  EXPECT_NE(EstimatePose(observations, Exact()).status.message.find("c0"), std::string::npos);
  observations.circles.pop_back();
  observations.circles[0].second = ConicReading{{}, {1}};
  EXPECT_NE(EstimatePose(observations, Exact()).status.message.find("second ellipse"),
            std::string::npos);
  EstimationOptions options = Exact();
  options.conic_loss.scale_px = -1.0;
  estimate = EstimatePose(scene.Empty(), options);
  EXPECT_EQ(estimate.status.code, StatusCode::kInvalidArgument);
  EXPECT_NE(estimate.status.message.find("conic_loss.scale_px"), std::string::npos);
  options = Exact();
  options.pose_prior = PosePrior{scene.pose, {}};
  options.pose_prior->covariance.fill(std::nan(""));
  estimate = EstimatePose(scene.Empty(), options);
  EXPECT_EQ(estimate.status.code, StatusCode::kInvalidArgument);
  EXPECT_NE(estimate.status.message.find("pose_prior"), std::string::npos);
}

// The sense of an X axis that points straight down in the photo is a toss-up; that makes no second
// pose.
TEST(EstimatePoseTest, AVerticalAxisMakesNoSecondPose) {
  for (int i = 0; i < 20; ++i) {
    PlaneScene scene(0.7, 0.3, static_cast<std::uint64_t>(i + 1));
    scene.pose.rotation = ExpRotation({0.7, 0.0, 0.0}) * ExpRotation({0.0, 0.0, 1.5707963}) *
                          Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
    scene.pose.translation.x() = 0.0;
    Observations observations = scene.Empty();
    observations.circles = {scene.Circle("c0", 0.0, 0.0, 1.0)};
    observations.pencils = {scene.Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX()),
                            scene.Pencil("L2", PencilDirection::kY, Eigen::Vector3d::UnitY())};
    const PoseEstimate estimate = Ok(EstimatePose(observations, Exact()));
    for (std::size_t k = 1; k < estimate.hypotheses.size(); ++k) {
      // Of the same evidence; without some of the lines it may be nearly the same pose.
      if (estimate.hypotheses[k].left_out != estimate.hypotheses[0].left_out) continue;
      EXPECT_GT(NormalError(estimate.hypotheses[k], scene), 0.02);
    }
    EXPECT_GT(estimate.hypotheses[0].probability, 0.9);
  }
}

TEST(EstimatePoseTest, EvidenceLeftOutIsNamed) {
  PlaneScene scene(0.7, 0.1);
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("c0", 0.0, 0.0, 1.5)};
  observations.circles[0].center = scene.Pixel(0.0, 0.0) + Eigen::Vector2d(9.0, -6.0);
  observations.pencils = {scene.Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX()),
                          scene.Pencil("L2", PencilDirection::kY, Eigen::Vector3d::UnitY())};
  const PoseEstimate estimate = Ok(EstimatePose(observations, Exact(LossType::kTukey)));
  EXPECT_LT(NormalError(estimate.hypotheses[0], scene), 0.01);
  ASSERT_FALSE(estimate.notes.empty());
  EXPECT_NE(estimate.notes.back().find("the centre of circle 'c0'"), std::string::npos);
}

// Half of the points of every feature spread over a band: the mask finds most, the loss the rest,
// and the covariance says what those cost that lie among the inliers.
double NeesOfBands(LossType loss) {
  constexpr int kTrials = Trials(150);
  double nees = 0.0;
  for (int i = 0; i < kTrials; ++i) {
    Random random(static_cast<std::uint64_t>(i + 1));
    Observations observations = PaperScene(2.0, &random);
    const auto spoil = [&](std::vector<Eigen::Vector2d>* points, std::vector<std::uint8_t>* inliers,
                           const auto& across) {
      inliers->assign(points->size(), 1);
      for (std::size_t k = 0; k < points->size(); k += 2) {
        const double by = random.Uniform(-40.0, 40.0);
        (*points)[k] += by * across((*points)[k]);
        (*inliers)[k] = std::abs(by) < 6.0 ? 1 : 0;
      }
    };
    CircleObservation& circle = observations.circles[0];
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& p : circle.points) middle += p / 100.0;
    spoil(&circle.points, &circle.inliers,
          [&](const Eigen::Vector2d& p) -> Eigen::Vector2d { return (p - middle).normalized(); });
    for (PencilObservation& pencil : observations.pencils) {
      for (LineObservation& line : pencil.lines) {
        const Eigen::Vector2d along = (line.points.back() - line.points.front()).normalized();
        spoil(&line.points, &line.inliers,
              [&](const Eigen::Vector2d&) { return Eigen::Vector2d(-along.y(), along.x()); });
      }
    }
    observations.frame.x_axis = Segment{observations.pencils[0].lines[0].points[1],
                                        observations.pencils[0].lines[0].points[49]};
    observations.frame.y_axis = Segment{observations.pencils[1].lines[0].points[1],
                                        observations.pencils[1].lines[0].points[49]};
    nees += RotationNees(Best(EstimatePose(observations, Exact(loss))), PaperPose()) / kTrials;
  }
  return nees;
}

TEST(EstimatePoseTest, CovarianceKnowsOfOutliersAmongTheInliers) {
  for (const LossType loss : {LossType::kTukey, LossType::kCauchy}) {
    const double nees = NeesOfBands(loss);
    if (kSanitized) continue;
    std::printf("half of the points in bands, %s: NEES %.2f\n", LossName(loss), nees);
    EXPECT_GT(nees, 2.4) << LossName(loss);
    EXPECT_LT(nees, 3.9) << LossName(loss);
  }
}

// Lines that state a large noise of their own, and have it, say nothing of that of the others.
TEST(EstimatePoseTest, StatedLinesDoNotRaiseTheScaleOfOthers) {
  PlaneScene scene(0.7, 0.1, 3);
  Observations observations = scene.Empty();
  observations.pencils = {scene.Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX(), 5, 9),
                          scene.Pencil("L2", PencilDirection::kY, Eigen::Vector3d::UnitY(), 5, 9)};
  for (PencilObservation& pencil : observations.pencils) {
    pencil.sigma_px = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      LineObservation& line = pencil.lines[i];
      line.sigma_px = 3.0;
      for (Eigen::Vector2d& p : line.points) {
        const double dx = scene.random.Normal(), dy = scene.random.Normal();
        p += line.sigma_px * Eigen::Vector2d(dx, dy);
      }
    }
  }
  Observations others = observations;
  for (PencilObservation& pencil : others.pencils)
    pencil.lines.erase(pencil.lines.begin(), pencil.lines.begin() + 3);
  const auto variance = [](const Observations& o) {
    const PoseEstimate estimate = EstimatePose(o, Exact());
    EXPECT_TRUE(estimate.status.ok()) << estimate.status.message;
    return estimate.hypotheses[0].Covariance().topLeftCorner<3, 3>().trace();
  };
  EXPECT_LT(variance(observations), 1.05 * variance(others));
}

// The first pose may be the more probable one although its residuals are the larger: then it is not
// these that decide.
TEST(EstimatePoseTest, WhatDecidesIsSaidTruly) {
  int by_residuals = 0, by_nothing = 0, larger_residuals = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    PlaneScene scene(0.1 + 0.004 * static_cast<double>(seed), 0.5, seed);
    Observations observations = scene.Empty();
    observations.circles = {scene.Circle("c0", 0.5, 0.2, 0.6), scene.Circle("c1", -1.5, 0.2, 0.5)};
    observations.circles[1].plane.clear();
    observations.circles[0].center = scene.Pixel(0.5, 0.2);
    const PoseEstimate estimate = Ok(EstimatePose(observations, Exact()));
    if (estimate.hypotheses.size() < 2) continue;
    const PoseHypothesis &first = estimate.hypotheses[0], &second = estimate.hypotheses[1];
    larger_residuals += first.cost > second.cost ? 1 : 0;
    if (estimate.decided_by.find("residuals") != std::string::npos) {
      ++by_residuals;
      EXPECT_GT(second.cost - first.cost, 0.49) << estimate.decided_by;
    } else {
      ++by_nothing;
      EXPECT_NE(estimate.decided_by.find("nothing"), std::string::npos) << estimate.decided_by;
      EXPECT_LT(first.probability, 3.0 * second.probability);
    }
  }
  EXPECT_GT(by_residuals, 0);
  EXPECT_GT(by_nothing, 0);
  EXPECT_GT(larger_residuals, 0);
}

TEST(EstimatePoseTest, SameInputSameBits) {
  PlaneScene scene(0.7, 0.3);
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("c0", 0.5, 0.2, 1.0), scene.Circle("c1", -1.5, -0.5, 0.9)};
  observations.pencils = {scene.Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX())};
  const PoseEstimate a = EstimatePose(observations, Exact()),
                     b = EstimatePose(observations, Exact());
  ASSERT_EQ(a.hypotheses.size(), b.hypotheses.size());
  for (std::size_t i = 0; i < a.hypotheses.size(); ++i) {
    EXPECT_EQ(a.hypotheses[i].cam_from_world.rotation, b.hypotheses[i].cam_from_world.rotation);
    EXPECT_EQ(a.hypotheses[i].covariance, b.hypotheses[i].covariance);
    EXPECT_EQ(a.hypotheses[i].probability, b.hypotheses[i].probability);
  }
}

}  // namespace
}  // namespace circline
