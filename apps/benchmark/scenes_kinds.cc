// The scenes of each experiment.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "apps/benchmark/scenes_experiments.h"
#include "apps/common/text.h"
#include "circline/estimators/basics.h"

namespace circline::apps {
namespace {

constexpr double kMaxRotationRad = 2.0 * kDegree;  // Bounds of a scene that is determined.
constexpr double kMaxLogFocal = 0.1;
constexpr double kMinSemiMinor = 20.0;  // In standard deviations of the noise.
constexpr double kMinDeviation = 10.0;  // Of odd features from what they should be, likewise.
constexpr double kRadiusError = 0.05;   // Of a stated radius that is wrong, relative.
constexpr double kLogFocalSigma = 0.5;  // Of a focal length that is not known.

// Draws until all is seen and the pose is determined. `change` adds to what is drawn, or refuses
// it.
template <typename Change>
Scene DrawScene(const Recipe& recipe, double noise_px, Random* random, const Change& change) {
  while (true) {
    Scene scene;
    scene.request.noise_px = noise_px;
    scene.world = DrawWorld(recipe, random);
    if (!change(&scene) || !IsVisible(scene.world)) continue;
    if (SmallestSemiMinorPx(scene.world) < kMinSemiMinor * noise_px) continue;
    scene.bound = ComputeBound(scene.world, scene.request);
    const bool is_determined = scene.request.log_focal_sigma > 0.0
                                   ? scene.bound.log_focal <= kMaxLogFocal
                                   : scene.bound.rotation_rad <= kMaxRotationRad;
    if (scene.bound.finite && is_determined) return scene;
  }
}

// Whole circles and nothing else, seen neither frontally nor edge-on.
Recipe WholeCircles(int min_circles, int max_circles) {
  Recipe recipe;
  recipe.min_circles = min_circles;
  recipe.max_circles = max_circles;
  recipe.max_pencils = 0;
  recipe.ring_share = recipe.partial_share = 0.0;
  recipe.min_tilt_deg = 15.0;
  recipe.max_tilt_deg = 75.0;
  recipe.min_points = 50;
  recipe.max_points = 200;
  return recipe;
}

// A circle and pencils along x, then y, seen by a lens that is not extreme.
Recipe CircleAndPencils(int min_pencils, int max_pencils, int min_lines, int max_lines) {
  Recipe recipe = WholeCircles(1, 1);
  recipe.num_lenses = 2;
  recipe.min_pencils = min_pencils;
  recipe.max_pencils = max_pencils;
  recipe.min_lines = min_lines;
  recipe.max_lines = max_lines;
  recipe.pencils_only_too = recipe.free_pencils = false;
  return recipe;
}

// Why a scene is not like the others: the first reason that applies.
std::string KindOf(const Scene& scene) {
  const double tilt = Tilt(scene.world);
  if (scene.bound.rotation_rad > kMaxRotationRad) return "bound > 2 deg";
  if (SmallestSemiMinorPx(scene.world) < kMinSemiMinor * scene.request.noise_px)
    return "semi-minor < 20 sigma";
  if (tilt < 15.0 * kDegree) return "tilt < 15 deg";
  if (tilt > 75.0 * kDegree) return "tilt > 75 deg";
  if (SmallestArc(scene.world) < kPi) return "arc < 180 deg";
  return "regular";
}

Scene DrawAnything(double noise_px, Random* random) {
  Scene scene;
  scene.request.noise_px = noise_px;
  while (!scene.bound.finite) {
    scene.world = DrawWorld(Recipe(), random);
    scene.bound = ComputeBound(scene.world, scene.request);
  }
  scene.kind = KindOf(scene);
  return scene;
}

Scene DrawShortArc(double noise_px, Random* random) {
  return DrawScene(WholeCircles(4, 4), noise_px, random, [&](Scene* scene) {
    scene->world.circles[3].arc = random->Uniform(45.0, 60.0) * kDegree;
    return true;
  });
}

// Arcs and a pencil of four lines; the bound says how well the plane is known.
Scene DrawLoneArcs(int num_arcs, double arc_deg, double noise_px, Random* random) {
  constexpr double kHardlyDetermined = 20.0 * kDegree;
  Recipe recipe = CircleAndPencils(1, 1, 4, 4);
  recipe.min_circles = recipe.max_circles = num_arcs;
  Scene scene;
  scene.request.noise_px = noise_px;
  do {
    scene.world = DrawWorld(recipe, random);
    for (WorldCircle& circle : scene.world.circles) circle.arc = arc_deg * kDegree;
    scene.bound = ComputeBound(scene.world, scene.request);
  } while (!IsVisible(scene.world) || !scene.bound.finite ||
           scene.bound.rotation_rad > kHardlyDetermined);
  if (scene.bound.rotation_rad > kMaxRotationRad) scene.kind = ", bound > 2 deg";
  return scene;
}

// Twelve equal discs on a lattice, whose print bleeds.
Scene DrawDiscs(double bleed_px, double noise_px, Random* random) {
  return DrawScene(WholeCircles(1, 1), noise_px, random, [&](Scene* scene) {
    scene->disturbance.bleed_px = bleed_px;
    std::vector<WorldCircle>& circles = scene->world.circles;
    WorldCircle disc = circles[0];
    const double pitch = 1.4 * disc.radius;
    disc.radius = 0.35 * pitch;
    circles.clear();
    for (int k = 0; k < 12; ++k) {
      const int column = k % 4, row = k / 4;
      disc.center = pitch * Eigen::Vector2d(column - 1.5, row - 1.0);
      circles.push_back(disc);
    }
    scene->world.equal_radii = true;
    return SmallestSemiMinorPx(scene->world) > 10.0;
  });
}

// By how many standard deviations the plane or the radius by one circle alone and by all others
// differ.
double Contradiction(const Scene& scene, const WorldCircle& odd, const Bound& others,
                     const Bound& alone) {
  if (odd.tilt.isZero()) return kRadiusError / std::hypot(others.log_distance, alone.log_distance);
  const Eigen::Matrix<double, 3, 2> in_plane = scene.world.pose.rotation.leftCols<2>();
  const Eigen::Matrix2d covariance =
      in_plane.transpose() * (others.covariance + alone.covariance) * in_plane;
  return std::sqrt(odd.tilt.dot(covariance.inverse() * odd.tilt));
}

// One circle has a plane of its own or, where `tilt_deg` is 0, a radius that is stated wrongly.
Scene DrawOddCircle(int num_circles, double tilt_deg, double noise_px, Random* random) {
  return DrawScene(WholeCircles(num_circles, num_circles), noise_px, random, [&](Scene* scene) {
    std::vector<WorldCircle>& circles = scene->world.circles;
    const auto at = static_cast<std::size_t>(random->UniformInt(num_circles));
    WorldCircle& odd = circles[at];
    if (tilt_deg > 0.0) {
      odd.tilt = tilt_deg * kDegree * Along(random->Uniform(0.0, 2.0 * kPi));
    } else {
      for (WorldCircle& circle : circles) circle.stated_radius = 1.0;
      odd.stated_radius = random->Uniform() < 0.5 ? 1.0 - kRadiusError : 1.0 + kRadiusError;
    }
    scene->odd = {"c" + std::to_string(at)};
    BoundRequest alone{noise_px, std::vector<std::uint8_t>(circles.size(), 0)};
    alone.circles[at] = 1;
    scene->request.circles.assign(circles.size(), 1);
    scene->request.circles[at] = 0;
    const Bound by_others = ComputeBound(scene->world, scene->request),
                by_odd = ComputeBound(scene->world, alone);
    return by_others.finite && by_odd.finite && by_odd.rotation_rad <= kMaxRotationRad &&
           Contradiction(*scene, odd, by_others, by_odd) >= kMinDeviation;
  });
}

// A circle, and pencils of segments of which the first `num_odd` have another direction.
Scene DrawOddLines(int num_pencils, int num_lines, int num_odd, double noise_px, Random* random) {
  Recipe recipe = CircleAndPencils(num_pencils, num_pencils, num_lines, num_lines);
  recipe.max_line_points = 2;
  return DrawScene(recipe, noise_px, random, [&](Scene* scene) {
    World& world = scene->world;
    if (num_pencils == 1) world.circles[0].stated_radius = 1.0;
    for (std::size_t k = 0; k < world.pencils.size(); ++k) {
      for (int i = 0; i < num_odd; ++i) {
        WorldLine& line = world.pencils[k].lines[static_cast<std::size_t>(i)];
        const double turn = 2.0 * std::pow(45.0, random->Uniform()) * kDegree;
        line.turn = random->Uniform() < 0.5 ? -turn : turn;
        if (!(OddLineDeviation(world, world.pencils[k], line) >= kMinDeviation * noise_px))
          return false;
        scene->odd.push_back("L" + std::to_string(k) + "[" + std::to_string(i) + "]");
      }
    }
    return true;
  });
}

Scene DrawUnknownFocal(Recipe recipe, double factor, double noise_px, Random* random) {
  recipe.num_lenses = 2;
  recipe.max_points = Recipe().max_points;
  return DrawScene(recipe, noise_px, random, [&](Scene* scene) {
    scene->request.log_focal_sigma = kLogFocalSigma;
    scene->focal_factor = factor;
    return true;
  });
}

// Of its points 40 % lie anywhere within 40 px.
Scene DrawOutliers(double noise_px, Random* random) {
  constexpr double kRatio = 0.4;
  Recipe recipe = WholeCircles(2, 2);
  recipe.partial_share = Recipe().partial_share;
  recipe.min_arc_deg = 180.0;
  recipe.max_points = Recipe().max_points;
  return DrawScene(recipe, noise_px, random, [&](Scene* scene) {
    scene->disturbance.outlier_ratio = kRatio;
    scene->request.noise_px /= std::sqrt(1.0 - kRatio);  // So many fewer points.
    return true;
  });
}

// Half of the circle, or more, and two lines or more along x.
Scene DrawCircleAndPencil(double noise_px, Random* random) {
  Recipe recipe;
  recipe.min_circles = recipe.max_circles = recipe.min_pencils = recipe.max_pencils = 1;
  recipe.free_pencils = false;
  recipe.min_arc_deg = 180.0;
  return DrawScene(recipe, noise_px, random, [](Scene*) { return true; });
}

std::vector<SceneRow> LoneArcRows() {
  std::vector<SceneRow> rows;
  for (const int arcs : {1, 2}) {
    for (const double deg : {60.0, 90.0, 120.0}) {
      rows.push_back({std::to_string(arcs) + " of " + FormatPlain(deg) + " deg",
                      [=](double noise, Random* r) { return DrawLoneArcs(arcs, deg, noise, r); }});
    }
  }
  return rows;
}

std::vector<SceneRow> OddCircleRows() {
  std::vector<SceneRow> rows;
  for (const int n : {3, 2}) {
    for (const double tilt : {5.0, 10.0, 15.0, 0.0}) {
      const std::string what = tilt > 0.0 ? FormatPlain(tilt) + " deg" : "radius 5 % off";
      rows.push_back({"one of " + std::to_string(n) + ", " + what,
                      [=](double noise, Random* r) { return DrawOddCircle(n, tilt, noise, r); }});
    }
  }
  return rows;
}

std::vector<SceneRow> UnknownFocalRows() {
  const std::vector<std::pair<std::string, Recipe>> contents = {
      {"rings", WholeCircles(2, 3)},
      {"circles", WholeCircles(2, 5)},
      {"circle, pencils", CircleAndPencils(1, 2, 3, Recipe().max_lines)}};
  std::vector<SceneRow> rows;
  for (auto [name, recipe] : contents) {
    if (name == "rings") recipe.ring_share = 1.0;
    for (const double factor : {0.63, 0.77, 0.9, 1.1, 1.3, 1.6}) {
      rows.push_back({name + ", " + FormatPlain(factor) + " f",
                      [recipe = recipe, factor](double noise, Random* r) {
                        return DrawUnknownFocal(recipe, factor, noise, r);
                      }});
    }
  }
  return rows;
}

SceneRow BleedRow(const std::string& name, double bleed_px) {
  return {name, [=](double noise, Random* r) { return DrawDiscs(bleed_px, noise, r); }};
}

SceneRow OddLinesRow(const std::string& name, int pencils, int lines, int odd) {
  return {name,
          [=](double noise, Random* r) { return DrawOddLines(pencils, lines, odd, noise, r); }};
}

}  // namespace

std::vector<SceneExperiment> SceneExperiments() {
  const std::vector<LossType> cauchy = {LossType::kCauchy};
  return {
      {"random",
       "scenes of every kind",
       1,
       150,
       {0.1, 0.5, 1.0, 2.0},
       cauchy,
       {{"", DrawAnything}}},
      {"short_arcs",
       "three whole circles and an arc of 45 to 60 deg",
       2,
       200,
       {0.5, 1.0},
       cauchy,
       {{"", DrawShortArc}}},
      {"lone_arcs",
       "one or two circles, an arc of each, and a pencil of four lines; the bound 20 deg or less",
       9,
       100,
       {0.5},
       cauchy,
       LoneArcRows()},
      {"odd_circles",
       "one circle has a plane of its own, or a wrong radius, by 10 sigma or more; errors are of "
       "the pose by the others",
       3,
       100,
       {0.5},
       cauchy,
       OddCircleRows()},
      {"bleed",
       "twelve equal discs, all too large, noise model of photographs",
       4,
       100,
       {0.2},
       cauchy,
       {BleedRow("as drawn", 0.0), BleedRow("by 0.2 px", 0.2), BleedRow("by 0.3 px", 0.3)},
       true},
      {"focal_length",
       "the focal length given is so many times the true one, its prior 0.5 of log f, the bound on "
       "it 0.1 or less",
       5,
       15,
       {0.5},
       cauchy,
       UnknownFocalRows()},
      {"outliers",
       "two coplanar circles, 40 % outliers within 40 px",
       6,
       200,
       {0.5, 1.0},
       {LossType::kCauchy, LossType::kTukey},
       {{"", DrawOutliers}}},
      {"circle_and_pencil",
       "a circle and a pencil, no outliers",
       7,
       300,
       {0.5, 2.0},
       {LossType::kTrivial, LossType::kCauchy},
       {{"", DrawCircleAndPencil}}},
      {"odd_lines",
       "a circle and segments, of which some have another direction, by 10 sigma or more",
       8,
       80,
       {0.5},
       {LossType::kTrivial, LossType::kHuber, LossType::kCauchy, LossType::kTukey,
        LossType::kGemanMcClure},
       {OddLinesRow("rim, 5 kerbs, none odd", 1, 5, 0), OddLinesRow("rim, 5 kerbs, 1 odd", 1, 5, 1),
        OddLinesRow("rim, 5 kerbs, 2 odd", 1, 5, 2),
        OddLinesRow("circle, 2 x 10 lines, 1 odd", 2, 10, 1),
        OddLinesRow("circle, 2 x 10 lines, 3 odd", 2, 10, 3)}}};
}

}  // namespace circline::apps
