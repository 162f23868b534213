// Features that contradict the rest: which of them are left out, what the others then say, and that
// nothing that agrees is.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/closed_form_solvers.h"
#include "circline/refine/refined_solvers.h"
#include "tests/plane_scene.h"
#include "tests/refine/simulated_options.h"
#include "tests/trials.h"

namespace circline {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Ids = std::vector<std::string>;

// About an axis of the plane, from the X axis by `about`; from angle 0 to `arc`.
CircleObservation Tilted(PlaneScene* scene, const std::string& id, const Vector2d& center,
                         double radius, double tilt, double about, double arc = 360.0 * kDegree,
                         int points = 60) {
  const Eigen::Matrix3d turn = ExpRotation(tilt * Vector3d(std::cos(about), std::sin(about), 0.0));
  CircleObservation circle;
  circle.id = id;
  circle.plane = "p0";
  circle.sigma_px = scene->sigma();
  for (int i = 0; i < points; ++i) {
    const double a = about + arc * i / points;
    const Vector3d on = Vector3d(center.x(), center.y(), 0.0) +
                        turn * (radius * Vector3d(std::cos(a), std::sin(a), 0.0));
    circle.points.push_back(scene->Pixel(on.x(), on.y(), on.z()));
  }
  return circle;
}

// The two others say what they say without it.
void ExpectPoseOfTheOthers(const PoseHypothesis& h, const PoseEstimate& others) {
  double nearest = 4.0;
  for (const PoseHypothesis& other : others.hypotheses) {
    nearest = std::min(
        nearest, (h.cam_from_world.rotation.col(2) - other.cam_from_world.rotation.col(2)).norm());
  }
  EXPECT_LT(nearest, 0.01 * SigmaNormal(h));
}

class TiltedCircleTest : public ::testing::TestWithParam<double> {};

TEST_P(TiltedCircleTest, OneOfThreeIsNamedAndTheOthersKeepTheirPose) {
  constexpr int kScenes = Trials(60);
  int named = 0, right = 0;
  for (int i = 0; i < kScenes; ++i) {
    PlaneScene scene(0.7, 0.2, static_cast<std::uint64_t>(i + 1));
    Observations observations = scene.Empty();
    observations.circles = {
        scene.Circle("c0", -1.8, -0.8, 1.0),
        Tilted(&scene, "c1", {1.6, -0.5}, 0.9, GetParam(), scene.random.Uniform(0.0, 6.28)),
        scene.Circle("c2", 0.2, 1.6, 0.8)};
    const PoseEstimate estimate = Ok(EstimatePose(observations, Exact()));
    const PoseHypothesis& h = estimate.hypotheses[0];
    right += NormalError(h, scene) < 3.5 * SigmaNormal(h) ? 1 : 0;
    if (h.left_out != Ids{"c1"}) continue;
    ++named;
    EXPECT_TRUE(HasNote(estimate, "circle 'c1'"));
    Observations others = observations;
    others.circles.erase(others.circles.begin() + 1);
    ExpectPoseOfTheOthers(h, EstimatePose(others, Exact()));
  }
  std::printf("tilted by %.0f degrees: named in %d of %d, the pose right in %d\n",
              GetParam() / kDegree, named, kScenes, right);
  EXPECT_GE(named, 0.95 * kScenes);
  EXPECT_GE(right, 0.95 * kScenes);
}

INSTANTIATE_TEST_SUITE_P(Tilts, TiltedCircleTest,
                         ::testing::Values(5.0 * kDegree, 10.0 * kDegree, 15.0 * kDegree));

// The lines tell the plane without it.
TEST(ReadingsTest, ThePlanesOnlyCircleIsLeftOut) {
  constexpr int kScenes = Trials(60);
  int named = 0, right = 0;
  for (int i = 0; i < kScenes; ++i) {
    PlaneScene scene(0.7, 0.2, static_cast<std::uint64_t>(i + 1));
    Observations observations = scene.Empty();
    observations.circles = {
        Tilted(&scene, "c0", {0.5, 0.2}, 1.0, 20.0 * kDegree, scene.random.Uniform(0.0, 6.28))};
    observations.pencils = {scene.Pencil("rows", PencilDirection::kX, Vector3d::UnitX(), 4, 20),
                            scene.Pencil("columns", PencilDirection::kY, Vector3d::UnitY(), 4, 20)};
    const PoseEstimate estimate = Ok(EstimatePose(observations, Exact()));
    const PoseHypothesis& h = estimate.hypotheses[0];
    right += NormalError(h, scene) < 3.5 * SigmaNormal(h) ? 1 : 0;
    named += h.left_out == Ids{"c0"} && HasNote(estimate, "circle 'c0'") ? 1 : 0;
  }
  std::printf("named in %d of %d, the pose right in %d\n", named, kScenes, right);
  EXPECT_GE(named, 0.95 * kScenes);
  EXPECT_GE(right, 0.95 * kScenes);
}

// With the centre and without it would be the same pose twice, each with half of its probability.
TEST(ReadingsTest, TheCenterOfACircleThatIsLeftOutMakesNoOtherHypothesis) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    PlaneScene scene(0.7, 0.3, seed);
    Observations observations = scene.Empty();
    observations.circles = {scene.Circle("c0", -0.6, 0.0, 0.7), scene.Circle("c1", 0.9, 0.3, 0.4)};
    observations.circles[0].radius = 0.7;
    observations.circles[1].radius = 1.3 * 0.4;
    observations.circles[0].center = scene.Pixel(-0.6, 0.0);
    observations.circles[1].center = scene.Pixel(0.9, 0.3);
    const PoseEstimate estimate = Ok(EstimatePose(observations, Exact()));
    for (std::size_t k = 1; k < estimate.hypotheses.size(); ++k) {
      const PoseHypothesis &a = estimate.hypotheses[k - 1], &b = estimate.hypotheses[k];
      EXPECT_FALSE(a.left_out == b.left_out &&
                   RotationAngle(a.cam_from_world.rotation, b.cam_from_world.rotation) < 1e-3)
          << seed;
    }
  }
}

// More of them than readings are looked at one by one: all at once, and what agrees comes back.
TEST(ReadingsTest, ManyTiltedCirclesAmongManyAreNamed) {
  constexpr double kNoise = 0.3;
  PlaneScene scene(0.7, kNoise, 5);
  Observations observations;
  observations.camera = scene.camera;
  Ids tilted;
  for (int i = 0; i < 40; ++i) {
    const std::string id = "c" + std::to_string(i);
    const Vector2d center(-2.1 + 0.6 * (i % 8), -1.2 + 0.6 * (i / 8));
    const bool is_tilted = i % 3 == 0;
    observations.circles.push_back(
        Tilted(&scene, id, center, 0.25, is_tilted ? 20.0 * kDegree : 0.0, 0.4 * i));
    if (is_tilted) tilted.push_back(id);
  }
  const PoseHypothesis best = Best(EstimatePose(observations, Exact()));
  Ids left_out = best.left_out;
  std::sort(left_out.begin(), left_out.end());
  std::sort(tilted.begin(), tilted.end());
  EXPECT_EQ(left_out, tilted);
  EXPECT_LT(NormalError(best, scene), 4.0 * SigmaNormal(best));
}

TEST(ReadingsTest, AWrongRadiusIsNamed) {
  constexpr int kScenes = Trials(60);
  int named = 0;
  for (int i = 0; i < kScenes; ++i) {
    PlaneScene scene(0.7, 0.2, static_cast<std::uint64_t>(i + 1));
    Observations observations = scene.Empty();
    observations.circles = {scene.Circle("c0", -1.8, -0.8, 1.0), scene.Circle("c1", 1.6, -0.5, 0.9),
                            scene.Circle("c2", 0.2, 1.6, 0.8)};
    observations.circles[0].radius = 1.0;
    observations.circles[1].radius = 0.9 * 1.05;
    observations.circles[2].radius = 0.8;
    const PoseHypothesis h = Best(EstimatePose(observations, Exact()));
    if (h.left_out != Ids{"c1"}) continue;
    ++named;
    EXPECT_TRUE(h.metric);
    Observations others = observations;
    others.circles.erase(others.circles.begin() + 1);
    ExpectPoseOfTheOthers(h, EstimatePose(others, Exact()));
    ASSERT_EQ(h.circles.size(), 2U);
    EXPECT_LT((h.circles[0].center - scene.pose.rotation * Vector3d(-1.8, -0.8, 0.0) -
               scene.pose.translation)
                  .norm(),
              0.05);
  }
  EXPECT_GE(named, 0.95 * kScenes);
}

// Of two nothing says which is right.
TEST(ReadingsTest, TwoContradictingCirclesGiveBothReadings) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    PlaneScene scene(0.7, 0.2, seed);
    Observations observations = scene.Empty();
    observations.circles = {
        scene.Circle("c0", -1.5, -0.5, 1.0),
        Tilted(&scene, "c1", {1.5, 0.5}, 1.0, 15.0 * kDegree, scene.random.Uniform(0.0, 6.28))};
    const PoseEstimate estimate = Ok(EstimatePose(observations, Exact()));
    double without_first = 0.0, without_second = 0.0, nearest = 4.0;
    for (const PoseHypothesis& h : estimate.hypotheses) {
      without_first += h.left_out == Ids{"c0"} ? h.probability : 0.0;
      without_second += h.left_out == Ids{"c1"} ? h.probability : 0.0;
      if (h.left_out == Ids{"c1"}) nearest = std::min(nearest, NormalError(h, scene));
    }
    EXPECT_GT(without_first, 0.1) << seed;
    EXPECT_GT(without_second, 0.1) << seed;
    EXPECT_LT(nearest, 0.03) << seed;
    EXPECT_LT(estimate.hypotheses[0].probability, 0.9) << seed;
  }
}

// The ellipse through the contour's points from `begin` on.
ConicReading Reading(const PlaneScene& scene, const CircleObservation& circle, std::size_t begin,
                     std::size_t end) {
  std::vector<Vector2d> pixels(circle.points.begin() + static_cast<std::ptrdiff_t>(begin),
                               circle.points.begin() + static_cast<std::ptrdiff_t>(end));
  std::vector<CalibratedPoint> points;
  PixelsToCalibrated(scene.camera, pixels, &points);
  ConicReading reading;
  EXPECT_TRUE(FitConic(points, scene.sigma(), &reading.fit).ok());
  reading.inliers.assign(circle.points.size(), 0);
  std::fill_n(reading.inliers.begin() + static_cast<std::ptrdiff_t>(begin), end - begin, 1);
  return reading;
}

// A contour of two rims, of which the fit has taken the one that is not of the plane.
CircleObservation TwoRims(PlaneScene* scene) {
  CircleObservation circle =
      Tilted(scene, "c1", {1.5, 0.5}, 1.0, 15.0 * kDegree, scene->random.Uniform(0.0, 6.28));
  const std::size_t count = circle.points.size();
  for (const Vector2d& p : scene->Circle("", 1.5, 0.5, 0.7, 40).points) circle.points.push_back(p);
  const ConicReading first = Reading(*scene, circle, 0, count);
  circle.fit = first.fit;
  circle.inliers = first.inliers;
  circle.second = Reading(*scene, circle, count, circle.points.size());
  return circle;
}

// Where the second ellipse agrees with the rest, the first is known to be misread.
TEST(ReadingsTest, TheSecondRimIsReadWhereTheFirstContradicts) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    PlaneScene scene(0.7, 0.2, seed);
    Observations observations = scene.Empty();
    observations.circles = {scene.Circle("c0", -1.5, -0.5, 1.0), TwoRims(&scene)};
    const PoseEstimate estimate = Ok(EstimatePose(observations, Exact()));
    EXPECT_TRUE(HasNote(estimate,
                        "circle 'c1': tried as the second ellipse through its points, too, which "
                        "the best pose takes"));
    EXPECT_FALSE(HasNote(estimate, "c1': left out"));
    double read = 0.0;
    for (const PoseHypothesis& h : estimate.hypotheses)
      read += h.structure == "p0 + second of c1" && h.left_out.empty() ? h.probability : 0.0;
    EXPECT_GT(read, 0.9) << seed;
    const PoseHypothesis& h = estimate.hypotheses[0];
    EXPECT_LT(NormalError(h, scene), 5.0 * SigmaNormal(h)) << seed;
    ASSERT_EQ(h.circles.size(), 2U);
    EXPECT_NEAR(h.circles[1].radius / h.circles[0].radius, 0.7, 0.01) << seed;
  }
}

// The free conic of a short arc says nothing of its centre and radius; all four agree.
TEST(ReadingsTest, ThreeCirclesAndAShortArcAgree) {
  constexpr int kScenes = Trials(100);
  int gross = 0, left_out = 0;
  for (int i = 0; i < kScenes; ++i) {
    PlaneScene scene(0.7, 0.3, static_cast<std::uint64_t>(i + 1));
    const double arc = scene.random.Uniform(45.0, 60.0) * kDegree;
    Observations observations = scene.Empty();
    observations.circles = {
        Tilted(&scene, "arc", {1.5, 1.2}, 1.0, 0.0, scene.random.Uniform(0.0, 6.28), arc, 40),
        scene.Circle("c0", -1.8, -0.8, 1.0), scene.Circle("c1", 1.6, -1.3, 0.9),
        scene.Circle("c2", -0.8, 1.6, 0.8)};
    const PoseHypothesis h = Best(EstimatePose(observations, Exact()));
    gross += NormalError(h, scene) > 5.0 * SigmaNormal(h) ? 1 : 0;
    left_out += h.left_out.empty() ? 0 : 1;
  }
  EXPECT_EQ(gross, 0);
  EXPECT_LE(left_out, kScenes / 100);
}

// A sixth of a rim and one pencil may lie in planes of which the rim's ellipse says nothing.
TEST(ReadingsTest, AShortArcAndAPencilHaveAllTheirPlanes) {
  constexpr int kScenes = Trials(200);
  int missing = 0, sure_and_wrong = 0;
  for (int i = 0; i < kScenes; ++i) {
    Random random(static_cast<std::uint64_t>(i + 1));
    PlaneScene scene(random.Uniform(0.3, 1.2), 0.3, static_cast<std::uint64_t>(i + 1));
    Observations observations = scene.Empty();
    observations.circles = {Tilted(&scene, "arc", {0.2, 0.1}, 2.5, 0.0, random.Uniform(0.0, 6.28),
                                   60.0 * kDegree, 100)};
    observations.pencils = {scene.Pencil("L1", PencilDirection::kX, Vector3d::UnitX(), 4, 30)};
    const PoseEstimate estimate = Ok(EstimatePose(observations, Exact()));
    const auto is_near = [&](const PoseHypothesis& h) {
      return NormalError(h, scene) < std::max(2.0 * kDegree, 4.0 * SigmaNormal(h));
    };
    const std::vector<PoseHypothesis>& all = estimate.hypotheses;
    missing += std::none_of(all.begin(), all.end(), is_near) ? 1 : 0;
    sure_and_wrong += all[0].probability >= 0.99 && !is_near(all[0]) ? 1 : 0;
  }
  EXPECT_LE(missing, kScenes / 100);
  EXPECT_LE(sure_and_wrong, kScenes / 100);
}

// Stated noise is believed; that most points then are outliers is said.
TEST(ReadingsTest, ASmallShareOfInliersIsNamed) {
  for (const bool is_small : {false, true}) {
    PlaneScene scene(0.7, 0.5, 3);
    Observations observations = scene.Empty();
    observations.circles = {scene.Circle("c0", 0.5, 0.2, 1.0, 100)};
    observations.pencils = {scene.Pencil("L1", PencilDirection::kX, Vector3d::UnitX(), 4, 30)};
    observations.circles[0].sigma_px = observations.pencils[0].sigma_px = is_small ? 0.03 : 0.5;
    const PoseEstimate estimate = Ok(EstimatePose(observations, Exact()));
    EXPECT_EQ(HasNote(estimate, "of 220 points agree with the pose"), is_small);
  }
}

TEST(ReadingsTest, NothingIsLeftOutOfWhatAgrees) {
  constexpr int kScenes = Trials(150);
  int left_out = 0;
  for (int i = 0; i < kScenes; ++i) {
    PlaneScene scene(0.7, 0.5, static_cast<std::uint64_t>(i + 1));
    Observations observations = scene.Empty();
    observations.circles = {scene.Circle("c0", -1.8, -0.8, 1.0), scene.Circle("c1", 1.6, -0.5, 0.9),
                            scene.Circle("c2", 0.2, 1.6, 0.8)};
    observations.circles[0].center = scene.Pixel(-1.8, -0.8);
    observations.pencils = {scene.Pencil("L1", PencilDirection::kX, Vector3d::UnitX()),
                            scene.Pencil("L2", PencilDirection::kY, Vector3d::UnitY())};
    const PoseHypothesis best = Best(EstimatePose(observations, Exact()));
    left_out += best.left_out.empty() ? 0 : 1;
    EXPECT_LT(NormalError(best, scene), 5.0 * SigmaNormal(best));
  }
  // One of the centre's gate in 120 by chance, of features as a whole none.
  EXPECT_LE(left_out, kScenes / 25);
}

// One circle alone: nothing tells its two poses apart, and noise must not order them either.
TEST(ReadingsTest, TiesKeepTheOrderOfTheClosedForm) {
  SolverRegistry registry;
  ClosedFormOptions closed_form;
  closed_form.noise_model = NoiseModel::Exact();
  AddClosedFormSolvers(&registry, closed_form);
  AddRefinedSolvers(&registry, Exact());
  const auto closed = registry.Find("single_circle", SolverStage::kClosedForm),
             refined = registry.Find("single_circle", SolverStage::kRefined),
             joint = registry.Find("joint", SolverStage::kRefined);
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    PlaneScene scene(0.2 + 0.01 * static_cast<double>(seed), 0.3, seed);
    Observations observations = scene.Empty();
    observations.circles = {scene.Circle("c0", 0.5, 0.2, 1.0)};
    const PoseEstimate expected = closed->Solve(observations);
    ASSERT_EQ(expected.hypotheses.size(), 2U);
    const Vector3d first = expected.hypotheses[0].cam_from_world.rotation.col(2),
                   second = expected.hypotheses[1].cam_from_world.rotation.col(2);
    for (const auto& solver : {refined, joint}) {
      const PoseEstimate estimate = solver->Solve(observations);
      ASSERT_EQ(estimate.hypotheses.size(), 2U) << estimate.status.message;
      const Vector3d normal = estimate.hypotheses[0].cam_from_world.rotation.col(2);
      EXPECT_GT(normal.dot(first), normal.dot(second)) << solver->name() << ", seed " << seed;
    }
  }
}

}  // namespace
}  // namespace circline
