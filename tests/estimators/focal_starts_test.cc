#include "circline/estimators/focal_starts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "tests/basics.h"
#include "tests/plane_scene.h"
#include "tests/trials.h"

namespace circline {
namespace {

// One kind of evidence, added to what is empty.
struct Kind {
  std::string name;
  std::function<void(PlaneScene*, Observations*)> add;
};

CircleObservation Named(CircleObservation circle, const std::string& plane) {
  circle.plane = plane;
  return circle;
}

std::vector<Kind> Kinds() {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), z = Eigen::Vector3d::UnitZ(),
                        free(0.6, 0.8, 0.0);
  const auto axes = [](PlaneScene* scene, Observations* o) { o->pencils = scene->Axes(); };
  return {
      {"two axes", axes},
      {"three axes",
       [=](PlaneScene* scene, Observations* o) {
         axes(scene, o);
         o->pencils.push_back(scene->Pencil("z", PencilDirection::kZ, z));
       }},
      {"known angle",
       [=](PlaneScene* scene, Observations* o) {
         o->pencils = {scene->Pencil("a", PencilDirection::kFree, x),
                       scene->Pencil("b", PencilDirection::kFree, free)};
         o->known_angles = {{{"a", "b"}, std::acos(0.6), 0.0}};
       }},
      {"centre",
       [](PlaneScene* scene, Observations* o) {
         o->circles = {Named(scene->Circle("c", 0.5, 0.2, 2.0), "")};
         o->circles[0].center = scene->Pixel(0.5, 0.2);
       }},
      {"diameters",
       [](PlaneScene* scene, Observations* o) {
         o->circles = {Named(scene->Circle("c", 0.5, 0.2, 2.0), "")};
         o->circles[0].diameters = {Segment{scene->Pixel(-1.5, 0.2), scene->Pixel(2.5, 0.2)},
                                    Segment{scene->Pixel(0.5, -1.8), scene->Pixel(0.5, 2.2)}};
       }},
      {"concentric",
       [](PlaneScene* scene, Observations* o) {
         o->circles = {scene->Circle("c", 0.5, 0.2, 2.5), scene->Circle("d", 0.5, 0.2, 1.2)};
         for (CircleObservation& circle : o->circles) {
           circle.concentric = "rings";
           circle.plane = "p0";  // Which adds nothing to what the centre says.
         }
       }},
      {"two of a plane",
       [](PlaneScene* scene, Observations* o) {
         o->circles = {scene->Circle("c", -2.0, 0.2, 1.4), scene->Circle("d", 2.0, -0.4, 1.0)};
       }},
      {"of one size",
       [](PlaneScene* scene, Observations* o) {
         o->circles = {scene->Circle("c", -2.0, 0.2, 1.0), scene->Circle("d", 2.0, -0.4, 1.0),
                       scene->Circle("e", 0.0, 2.0, 1.0)};
         for (CircleObservation& circle : o->circles) circle.radius_group = "dots";
       }},
      {"of known radii",
       [](PlaneScene* scene, Observations* o) {
         o->circles = {scene->Circle("c", -2.0, 0.2, 1.0), scene->Circle("d", 2.0, -0.4, 1.5)};
         for (CircleObservation& circle : o->circles) circle.radius = circle.id == "c" ? 0.2 : 0.3;
       }},
      {"circle and pencil",
       [=](PlaneScene* scene, Observations* o) {
         o->circles = {scene->Circle("c", 0.5, 0.2, 2.0)};
         o->pencils = {scene->Pencil("a", PencilDirection::kFree, free)};
       }},
      {"lattice",
       [=](PlaneScene* scene, Observations* o) {
         axes(scene, o);
         o->circles = {scene->Circle("c", -2.0, 0.0, 1.0), scene->Circle("d", 2.0, 0.0, 1.0),
                       scene->Circle("e", -2.0, 2.0, 1.0)};
         for (CircleObservation& circle : o->circles) circle.radius_group = "dots";
       }},
  };
}

// The scene's camera without a lens, and with square pixels.
PlaneScene Scene(double sigma_px = 0.0, std::uint64_t seed = 1) {
  PlaneScene scene(0.7, sigma_px, seed);
  scene.camera.distortion = {};
  scene.camera.fy = scene.camera.fx;
  return scene;
}

Observations Guessed(const Kind& kind, double factor, PlaneScene* scene) {
  Observations observations = scene->Empty();
  kind.add(scene, &observations);
  observations.camera.fx *= factor;
  observations.camera.fy *= factor;
  FitDirect(0.1, &observations, nullptr, NoiseModel::Exact());
  return observations;
}

const FocalStart* Nearest(const std::vector<FocalStart>& starts, double focal) {
  const auto found = std::min_element(
      starts.begin(), starts.end(), [focal](const FocalStart& a, const FocalStart& b) {
        return std::abs(std::log(a.focal_px / focal)) < std::abs(std::log(b.focal_px / focal));
      });
  return found == starts.end() ? nullptr : &*found;
}

TEST(FocalStartsTest, HoldTheTruthWhateverTheGuess) {
  for (const Kind& kind : Kinds()) {
    for (const double factor : {0.5, 0.7, 1.0, 1.4, 2.0}) {
      PlaneScene scene = Scene();
      const Observations observations = Guessed(kind, factor, &scene);
      std::vector<std::string> problems;
      const auto starts = FocalLengthStarts(observations, 0.1, NoiseModel::Exact(), &problems);
      const FocalStart* best = Nearest(starts, scene.camera.fx);
      ASSERT_NE(best, nullptr) << kind.name << ": " << (problems.empty() ? "" : problems[0]);
      EXPECT_NEAR(best->focal_px, scene.camera.fx, 1e-7 * scene.camera.fx) << kind.name;
      EXPECT_FALSE(best->evidence.empty());
      EXPECT_GT(best->sigma_log, 0.0);
      for (std::size_t i = 1; i < starts.size(); ++i) {
        EXPECT_LE(starts[i - 1].sigma_log, starts[i].sigma_log);
      }
    }
  }
}

TEST(FocalStartsTest, SigmaIsTheSpread) {
  for (const Kind& kind : Kinds()) {
    double nees = 0.0;
    const int trials = Trials(200);
    for (int i = 0; i < trials; ++i) {
      PlaneScene scene = Scene(0.05, static_cast<std::uint64_t>(i));
      const auto starts = FocalLengthStarts(Guessed(kind, 1.3, &scene), 0.05, NoiseModel::Exact());
      const FocalStart* best = Nearest(starts, scene.camera.fx);
      ASSERT_NE(best, nullptr) << kind.name;
      nees += std::pow(std::log(best->focal_px / scene.camera.fx) / best->sigma_log, 2) / trials;
    }
    if (kSanitized) continue;
    // Of 200 draws: standard deviation 0.1.
    EXPECT_GT(nees, 0.7) << kind.name;
    EXPECT_LT(nees, 1.35) << kind.name;
  }
}

TEST(FocalStartsTest, DistortionIsTakenAsGiven) {
  PlaneScene scene;
  for (const Kind& kind : Kinds()) {
    Observations observations = Guessed(kind, 1.0, &scene);
    const auto starts = FocalLengthStarts(observations, 0.1, NoiseModel::Exact());
    const FocalStart* best = Nearest(starts, scene.camera.fx);
    ASSERT_NE(best, nullptr) << kind.name;
    EXPECT_NEAR(best->focal_px, scene.camera.fx, 1e-6 * scene.camera.fx) << kind.name;
  }
}

// With a lens, a wrong guess bends the answer: by no more than its sigma says.
TEST(FocalStartsTest, UnderDistortionTheGuessIsCountedIn) {
  NoiseModel noise = NoiseModel::Exact();
  noise.camera.log_focal = 0.3;
  int too_sure = 0;
  for (const Kind& kind : Kinds()) {
    for (const double factor : {0.8, 1.25}) {
      PlaneScene scene;
      scene.camera.fy = scene.camera.fx;
      scene.camera.distortion = {-0.2, 0.05, 0.0, 0.0, 0.0};
      const Observations observations = Guessed(kind, factor, &scene);
      const auto starts = FocalLengthStarts(observations, 0.1, noise);
      const FocalStart* best = Nearest(starts, scene.camera.fx);
      ASSERT_NE(best, nullptr) << kind.name;
      const double error = std::abs(std::log(best->focal_px / scene.camera.fx));
      EXPECT_LT(error, 2.0 * best->sigma_log) << kind.name;
      const auto held = FocalLengthStarts(observations, 0.1, NoiseModel::Exact());
      too_sure += error > 2.0 * Nearest(held, scene.camera.fx)->sigma_log ? 1 : 0;
    }
  }
  EXPECT_GE(too_sure, 5);  // Where the guess was not counted in.
}

TEST(FocalStartsTest, NoiseModelWidensTheSigma) {
  for (const Kind& kind : Kinds()) {
    PlaneScene scene = Scene(0.05);
    const Observations observations = Guessed(kind, 1.0, &scene);
    const auto sigma = [&](const NoiseModel& noise) {
      const auto starts = FocalLengthStarts(observations, 0.05, noise);
      const FocalStart* best = Nearest(starts, scene.camera.fx);
      return best == nullptr ? 0.0 : best->sigma_log;
    };
    NoiseModel shifted = NoiseModel::Exact();
    shifted.camera.principal_point_px = 20.0;
    EXPECT_GT(sigma(shifted), 1.05 * sigma(NoiseModel::Exact())) << kind.name;
    if (kind.name == "centre" || kind.name == "diameters" || kind.name == "known angle") continue;
    NoiseModel bent = NoiseModel::Exact();
    bent.circle_tilt_rad = bent.pencil_axis_rad = 0.02;
    EXPECT_GT(sigma(bent), 1.5 * sigma(NoiseModel::Exact())) << kind.name;
  }
}

TEST(FocalStartsTest, SaysWhatCouldNotSay) {
  NoiseModel exact = NoiseModel::Exact();
  std::vector<std::string> problems;
  EXPECT_TRUE(FocalLengthStarts(Scene().Empty(), 0.1, exact, &problems).empty());
  EXPECT_TRUE(problems.empty());

  // A frontal plane tells nothing, whatever is seen in it.
  for (const Kind& kind : Kinds()) {
    if (kind.name == "three axes") continue;
    PlaneScene scene = Scene(0.05);
    scene.pose.rotation = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
    problems.clear();
    const auto starts = FocalLengthStarts(Guessed(kind, 1.0, &scene), 0.05, exact, &problems);
    for (const FocalStart& start : starts) EXPECT_GT(start.sigma_log, 0.3) << kind.name;
    EXPECT_TRUE(!starts.empty() || !problems.empty()) << kind.name;
    for (const std::string& problem : problems) EXPECT_GT(problem.size(), 40U) << problem;
  }

  Observations blind = Scene().Empty();
  blind.camera.fx = 0.0;
  EXPECT_TRUE(FocalLengthStarts(blind, 0.1, exact, &problems).empty());
  EXPECT_CONTAINS(problems.back(), "fx");

  // A circle alone, with the plane that it names.
  PlaneScene scene = Scene();
  Observations alone = scene.Empty();
  alone.circles = {scene.Circle("c", 0.5, 0.2, 2.0)};
  FitDirect(0.1, &alone);
  problems.clear();
  EXPECT_TRUE(FocalLengthStarts(alone, 0.1, exact, &problems).empty());
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_CONTAINS(problems[0], "'c'");
}

TEST(FocalStartsTest, NumbersThatAreNotFiniteAreRefused) {
  for (const Kind& kind : Kinds()) {
    PlaneScene scene = Scene();
    Observations observations = Guessed(kind, 1.0, &scene);
    for (CircleObservation& circle : observations.circles) {
      circle.fit->conic(0, 1) = std::numeric_limits<double>::quiet_NaN();
    }
    for (PencilObservation& pencil : observations.pencils) {
      pencil.fit->direction.x() = std::numeric_limits<double>::infinity();
    }
    std::vector<std::string> problems;
    EXPECT_TRUE(FocalLengthStarts(observations, 0.1, NoiseModel(), &problems).empty());
    EXPECT_FALSE(problems.empty());
  }
}

}  // namespace
}  // namespace circline
