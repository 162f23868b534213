#include "apps/benchmark/scenes_kinds.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "circline/estimators/basics.h"

namespace circline::apps {
namespace {

constexpr double kMaxRotationRad = 2.0 * kDegree;  // Bounds of a scene that is determined.
constexpr double kMaxLogFocal = 0.1;
constexpr double kMinSemiMinor = 20.0;  // In standard deviations of the noise.
constexpr double kMinDeviation = 10.0;  // Of odd features from what they should be, likewise.
constexpr double kRadiusError = 0.05;   // Of a stated radius that is wrong, relative.

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

// Twelve equal discs on a lattice in place of the one circle.
void MakeLattice(World* world) {
  WorldCircle disc = world->circles[0];
  const double pitch = 1.4 * disc.radius;
  disc.radius = 0.35 * pitch;
  world->circles.clear();
  for (int k = 0; k < 12; ++k) {
    const int column = k % 4, row = k / 4;
    disc.center = pitch * Eigen::Vector2d(column - 1.5, row - 1.0);
    world->circles.push_back(disc);
  }
  world->equal_radii = true;
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

Recipe RecipeOf(FocalEvidence evidence) {
  Recipe recipe;
  switch (evidence) {
    case FocalEvidence::kRings:
      recipe = WholeCircles(2, 3);
      recipe.ring_share = 1.0;
      break;
    case FocalEvidence::kCircles:
    case FocalEvidence::kEqualCircles:
      recipe = WholeCircles(2, 5);
      break;
    case FocalEvidence::kLattice:
    case FocalEvidence::kCircleAndCenter:
      recipe = WholeCircles(1, 1);
      break;
    case FocalEvidence::kCircleAndPencils:
      recipe = CircleAndPencils(1, 2, 3, Recipe().max_lines);
      break;
    case FocalEvidence::kPencils:
      recipe = CircleAndPencils(2, 2, 3, Recipe().max_lines);
      recipe.min_circles = recipe.max_circles = 0;
      break;
  }
  recipe.num_lenses = kNumLenses;
  recipe.max_points = Recipe().max_points;
  return recipe;
}

}  // namespace

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

Scene DrawDiscs(double bleed_px, double noise_px, Random* random) {
  return DrawScene(WholeCircles(1, 1), noise_px, random, [&](Scene* scene) {
    scene->disturbance.bleed_px = bleed_px;
    MakeLattice(&scene->world);
    return SmallestSemiMinorPx(scene->world) > 10.0;
  });
}

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

Scene DrawUnknownFocal(FocalEvidence evidence, double factor, double log_focal_sigma,
                       double noise_px, Random* random) {
  return DrawScene(RecipeOf(evidence), noise_px, random, [&](Scene* scene) {
    scene->request.log_focal_sigma = log_focal_sigma;
    scene->focal_factor = factor;
    World& world = scene->world;
    if (evidence == FocalEvidence::kLattice) MakeLattice(&world);
    if (evidence == FocalEvidence::kEqualCircles) {
      world.equal_radii = true;
      for (WorldCircle& circle : world.circles) circle.radius = world.circles[0].radius;
    }
    if (evidence == FocalEvidence::kCircleAndCenter) world.circles[0].has_center = true;
    return true;
  });
}

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

Scene DrawCircleAndPencil(double noise_px, Random* random) {
  Recipe recipe;
  recipe.min_circles = recipe.max_circles = recipe.min_pencils = recipe.max_pencils = 1;
  recipe.free_pencils = false;
  recipe.min_arc_deg = 180.0;
  return DrawScene(recipe, noise_px, random, [](Scene*) { return true; });
}

}  // namespace circline::apps
