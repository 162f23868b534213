#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>

#include "circline/refine/estimate_pose.h"
#include "tests/plane_scene.h"
#include "tests/refine/simulated_options.h"

namespace circline {
namespace {

EstimationOptions Guessed() {
  EstimationOptions options;
  options.camera_sigma = CameraSigma();
  options.camera_sigma->log_focal = 0.5;
  return options;
}

// A camera that faces a wall sees its uprights and its levels at right angles at nearly any focal
// length: what walls lean says nothing of that, and what is stated of it is the prior.
TEST(GuessedFocalLength, IsKnownToItsPriorWhereRightAnglesSayNothing) {
  for (const double tilt : {0.05, 0.1, 0.2}) {
    PlaneScene scene(tilt, 0.6);
    Observations observations = scene.Empty();
    observations.pencils = {scene.Pencil("x", PencilDirection::kX, Eigen::Vector3d::UnitX()),
                            scene.Pencil("y", PencilDirection::kY, Eigen::Vector3d::UnitY())};
    const PoseHypothesis best = Best(EstimatePose(observations, Guessed()));
    const double sigma = best.focal_sigma / best.focal_scale;
    EXPECT_LT(sigma, std::hypot(0.5, std::log(best.focal_scale))) << tilt;
    EXPECT_GT(sigma, 0.01) << tilt;
  }
}

// The short edges of a front among the many that a photo has: each misses the direction by degrees,
// as its ends are noisy, and not because the walls lean.
Observations Front(PlaneScene* scene) {
  constexpr double kHalf = 0.25;  // 30 pixels long.
  Observations observations = scene->Empty();
  for (const auto direction : {PencilDirection::kX, PencilDirection::kY}) {
    const bool is_x = direction == PencilDirection::kX;
    PencilObservation pencil = scene->Pencil(is_x ? "x" : "y", direction, Eigen::Vector3d::Zero());
    pencil.plane = "p0";
    pencil.lines.clear();
    const Eigen::Vector3d along =
        kHalf * (is_x ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY());
    for (int k = 0; k < 40; ++k) {
      const double u = scene->random.Uniform(-3.0, 3.0), v = scene->random.Uniform(-3.0, 3.0);
      pencil.lines.push_back(
          scene->Line(Eigen::Vector3d(u, v, 0.0) - along, Eigen::Vector3d(u, v, 0.0) + along));
    }
    observations.pencils.push_back(pencil);
  }
  return observations;
}

TEST(GuessedFocalLength, IsKnownAsWellAsShortEdgesTellIt) {
  constexpr int kScenes = 60;
  int within = 0;
  double squares = 0.0;
  for (std::uint64_t seed = 1; seed <= kScenes; ++seed) {
    PlaneScene scene(0.7, 1.0, seed);
    scene.camera.distortion = {};
    const PoseHypothesis best = Best(EstimatePose(Front(&scene), Guessed()));
    const double off = std::log(best.focal_scale) / (best.focal_sigma / best.focal_scale);
    within += std::abs(off) < 2.0 ? 1 : 0;
    squares += off * off;
  }
  const double rms = std::sqrt(squares / kScenes);
  std::printf("focal length of short edges: error over deviation %.2f, within two in %d of %d\n",
              rms, within, kScenes);
  EXPECT_GE(within, 54);
  EXPECT_GT(rms, 0.5);
}

// The photo has as much room for a circle at every focal length, so that a circle given three
// times, each with the square root of three times the noise, says no more than once: not that a
// short one is likelier, under which circles fill more of what can be seen.
TEST(GuessedFocalLength, IsNoShorterForMoreCircles) {
  constexpr std::uint64_t kScenes = 40;
  int compared = 0;
  for (std::uint64_t seed = 1; seed <= kScenes; ++seed) {
    Random draw(seed);
    PlaneScene scene(draw.Uniform(0.2, 0.6), 0.5, seed);
    scene.camera.distortion = {};
    Observations once = scene.Empty();
    const double x = draw.Uniform(-1.0, 1.0), y = draw.Uniform(-1.0, 1.0);
    const double turn = draw.Uniform(0.0, kPi);
    once.circles = {scene.Circle("c0", x, y, 1.0)};
    once.pencils = {scene.Pencil("x", PencilDirection::kX,
                                 Eigen::Vector3d(std::cos(turn), std::sin(turn), 0.0))};
    Observations thrice = once;
    thrice.circles.assign(3, once.circles[0]);
    for (std::size_t k = 0; k < 3; ++k) {
      thrice.circles[k].id = "c" + std::to_string(k);
      thrice.circles[k].sigma_px *= std::sqrt(3.0);
    }
    EstimationOptions options = Guessed();
    options.noise_model = NoiseModel::Exact();
    // Of the longer one of two; the logarithm.
    const auto odds = [&](const Observations& observations) {
      const PoseEstimate estimate = EstimatePose(observations, options);
      if (estimate.hypotheses.size() != 2) return std::nan("");
      const PoseHypothesis &a = estimate.hypotheses[0], &b = estimate.hypotheses[1];
      return std::copysign(std::log(a.probability / b.probability), a.focal_scale - b.focal_scale);
    };
    const double one = odds(once);
    constexpr double kSure = 6.0;  // The other one may be given up.
    if (!(std::abs(one) < kSure)) continue;
    ++compared;
    EXPECT_NEAR(odds(thrice), one, 1.0) << seed;
  }
  EXPECT_GE(compared, 5);
}

// Evidence that knows the focal length of another camera than the one given says so.
TEST(GuessedFocalLength, FarFromWhatWasGivenIsSaid) {
  for (const bool is_far : {false, true}) {
    PlaneScene scene(0.7, 0.1);
    scene.camera.distortion = {};
    Observations observations = Front(&scene);
    if (is_far) observations.camera.fx = observations.camera.fy = 8.0 * scene.camera.fx;
    const PoseEstimate estimate = Ok(EstimatePose(observations, Guessed()));
    EXPECT_EQ(estimate.notes.front().find("focal length: "), 0U) << estimate.notes.front();
    EXPECT_EQ(HasNote(estimate, "the camera given, or the evidence, is not what it seems"), is_far);
  }
}

// Of several poses that are humps of one, too.
TEST(GuessedFocalLength, IsStatedInWordsAsItIsReturned) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    PlaneScene scene(0.7, 2.0, seed);
    scene.camera.distortion = {};
    Observations observations = scene.Empty();
    observations.circles = {scene.Circle("c0", 0.3, 0.2, 0.8)};
    observations.pencils = {scene.Pencil("x", PencilDirection::kX, Eigen::Vector3d::UnitX())};
    const PoseEstimate estimate = Ok(EstimatePose(observations, Guessed()));
    const PoseHypothesis& best = estimate.hypotheses.front();
    char expected[80];
    std::snprintf(expected, sizeof(expected), "focal length: %.4f times the camera's, +- %.4f",
                  best.focal_scale, best.focal_sigma);
    EXPECT_TRUE(HasNote(estimate, expected)) << seed << ": " << expected;
  }
}

// Of the hypotheses in which these pencils are along no axis.
double ProbabilityOfFree(const PoseEstimate& estimate, const std::string& freed) {
  double sum = 0.0;
  for (const PoseHypothesis& h : estimate.hypotheses)
    sum += h.structure == "p0" + freed ? h.probability : 0.0;
  return sum;
}

// Where the axes may be none, nothing but the prior is left.
TEST(GuessedFocalLength, IsThatOfTheGuessWhereTheAxesAreNone) {
  PlaneScene scene(0.7, 0.1);
  scene.camera.distortion = {};  // A known lens would tell its focal length.
  Observations observations = Front(&scene);
  observations.camera.fx = observations.camera.fy = 1.3 * scene.camera.fx;
  const PoseHypothesis sure = Best(EstimatePose(observations, Guessed()));
  EXPECT_LT(std::abs(std::log(1.3 * sure.focal_scale)), 3.0 * sure.focal_sigma);
  EXPECT_LT(sure.focal_sigma, 0.25);
  for (const double probability : {0.8, 0.2}) {
    observations.pencils[1].axis_probability = probability;
    const PoseEstimate estimate = Ok(EstimatePose(observations, Guessed()));
    const std::size_t with = probability > 0.5 ? 0 : 1;
    ASSERT_EQ(estimate.hypotheses.size(), 2U);
    const PoseHypothesis &square = estimate.hypotheses[with], &free = estimate.hypotheses[1 - with];
    EXPECT_NEAR(square.probability, probability, 1e-9);
    EXPECT_NEAR(square.focal_scale, sure.focal_scale, 1e-9);
    EXPECT_NEAR(square.focal_sigma, sure.focal_sigma, 1e-9);
    EXPECT_NEAR(ProbabilityOfFree(estimate, " + free y"), 1.0 - probability, 1e-9);
    EXPECT_NEAR(free.focal_scale, 1.0, 0.2);
    EXPECT_GT(free.focal_sigma, 0.3);
    EXPECT_EQ(estimate.decided_by, "how probably the axes are at right angles");
    char note[64];
    std::snprintf(note, sizeof(note), "with probability %.2f only", probability);
    EXPECT_NE(estimate.notes.back().find(note), std::string::npos) << estimate.notes.back();
  }
  observations.pencils[1].axis_probability = 1.5;
  const Status status = EstimatePose(observations, Guessed()).status;
  EXPECT_EQ(status.code, StatusCode::kInvalidArgument) << status.message;
}

// The likelier of two axes is one wherever the other is, too.
TEST(GuessedFocalLength, CountsBothDoubtedAxes) {
  PlaneScene scene(0.7, 0.1);
  scene.camera.distortion = {};
  Observations observations = Front(&scene);
  observations.pencils.push_back(
      scene.Pencil("z", PencilDirection::kZ, Eigen::Vector3d::UnitZ(), 4));
  observations.pencils[1].axis_probability = 0.9;
  observations.pencils[2].axis_probability = 0.6;
  const PoseEstimate doubted = Ok(EstimatePose(observations, Guessed()));
  EXPECT_NEAR(ProbabilityOfFree(doubted, ""), 0.6, 1e-9);
  EXPECT_NEAR(ProbabilityOfFree(doubted, " + free z"), 0.3, 1e-9);
  EXPECT_NEAR(ProbabilityOfFree(doubted, " + free z + free y"), 0.1, 1e-9);
  // Through a camera that is known a right angle is seen.
  const PoseEstimate known = Ok(EstimatePose(observations));
  EXPECT_NEAR(ProbabilityOfFree(known, ""), 1.0, 1e-9);
}

// Whatever the axes are doubted by: to its prior, about where the estimate would be then.
TEST(GuessedFocalLength, IsNeverKnownWorseThanBeforehand) {
  constexpr int kScenes = 150;
  for (std::uint64_t seed = 1; seed <= kScenes; ++seed) {
    PlaneScene scene(0.1 + 0.007 * static_cast<double>(seed), 0.5, seed);
    scene.camera.distortion = {};
    Observations observations = Front(&scene);
    observations.pencils.push_back(
        scene.Pencil("z", PencilDirection::kZ, Eigen::Vector3d::UnitZ(), 4));
    for (PencilObservation& pencil : observations.pencils)
      pencil.axis_probability = scene.random.Uniform(0.5, 1.0);
    observations.camera.fx *= 1.4;
    observations.camera.fy *= 1.4;
    const PoseHypothesis best = Best(EstimatePose(observations, Guessed()));
    const double before = std::hypot(0.5, std::log(best.focal_scale));
    EXPECT_LT(best.focal_sigma / best.focal_scale, 1.1 * before) << seed;
  }
}

// Half the focal length of a strong lens has no room for what it shows at the side: that is what is
// said, not that nothing was given.
TEST(GuessedFocalLength, IsToBlameWhereNoPointCanHaveBeenSeen) {
  PlaneScene scene(0.8);
  scene.camera.fx = scene.camera.fy = 420.0;
  scene.camera.distortion = {-0.45, 0.0, 0.0, 0.0, 0.0};  // One-to-one up to 241 px.
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("rim", 0.0, 5.4, 0.4, 60)};
  observations.camera.fx *= 0.5;
  observations.camera.fy *= 0.5;
  const Status status = EstimatePose(observations, Guessed()).status;
  EXPECT_EQ(status.code, StatusCode::kRefused);
  EXPECT_NE(status.message.find("none that is given could be fitted: the camera cannot have seen "
                                "some of the points"),
            std::string::npos)
      << status.message;
}

}  // namespace
}  // namespace circline
