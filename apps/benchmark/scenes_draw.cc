// How a random scene is drawn: camera, then content on a unit disc, then as large as fits the
// photo.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "apps/benchmark/scenes_world.h"
#include "circline/estimators/basics.h"

namespace circline::apps {
namespace {

constexpr double kDistance = 10.0;  // Of the scene's middle from the camera.

double LogUniform(double low, double high, Random* random) {
  return low * std::pow(high / low, random->Uniform());
}

int LogUniformInt(int low, int high, Random* random) {
  return std::min(high, static_cast<int>(LogUniform(low, high + 1.0, random)));
}

int UniformFrom(int low, int high, Random* random) {
  return low + random->UniformInt(high - low + 1);
}

Camera DrawCamera(Lens lens, Random* random) {
  Camera camera;
  camera.width = 1280;
  camera.height = 960;
  camera.cx = 639.5 + random->Uniform(-15.0, 15.0);
  camera.cy = 479.5 + random->Uniform(-15.0, 15.0);
  switch (lens) {
    case Lens::kPinhole:
      camera.fx = random->Uniform(700.0, 1800.0);
      break;
    case Lens::kMild:
      camera.model = CameraModel::kOpenCV;
      camera.fx = random->Uniform(800.0, 1300.0);
      camera.distortion = {-0.2, 0.05, 1e-3, -5e-4};
      break;
    case Lens::kStrong:  // A wide-angle lens: monotonic up to 54 degrees off the axis.
      camera.model = CameraModel::kOpenCV;
      camera.fx = random->Uniform(600.0, 750.0);
      camera.distortion = {-0.45, 0.25, 5e-4, 5e-4, -0.06};
      break;
    case Lens::kFisheye:
      camera.model = CameraModel::kFisheye;
      camera.fx = random->Uniform(420.0, 600.0);
      camera.distortion = {0.03, -0.01, 0.002, 0.0};
      break;
  }
  camera.fy = camera.fx * random->Uniform(0.98, 1.02);
  return camera;
}

// Looks at the middle of the scene, somewhere in the inner part of the photo.
CameraPose DrawPose(const Recipe& recipe, const Camera& camera, Random* random) {
  CalibratedPoint middle;
  const double u = random->Uniform(0.25, 0.75), v = random->Uniform(0.25, 0.75);
  PixelToCalibrated(camera, {u * camera.width, v * camera.height}, &middle);
  const Eigen::Vector3d ray = middle.Homogeneous().normalized();
  const double tilt = random->Uniform(recipe.min_tilt_deg, recipe.max_tilt_deg) * kDegree;
  const double azimuth = random->Uniform(0.0, 2.0 * kPi), turn = random->Uniform(0.0, 2.0 * kPi);
  const Eigen::Vector3d a = ray.unitOrthogonal(), b = ray.cross(a);
  const Eigen::Vector3d sideways = std::cos(azimuth) * a + std::sin(azimuth) * b;
  const Eigen::Vector3d normal = std::sin(tilt) * sideways - std::cos(tilt) * ray;
  const Eigen::Vector3d e = normal.unitOrthogonal(), f = normal.cross(e);
  const Eigen::Vector3d x = std::cos(turn) * e + std::sin(turn) * f;
  CameraPose pose;
  pose.rotation << x, normal.cross(x), normal;
  pose.translation = kDistance * ray;
  return pose;
}

WorldCircle DrawCircle(const Recipe& recipe, double largest, Random* random) {
  WorldCircle circle;
  circle.radius = LogUniform(0.4, 1.0, random) * largest;
  const double r = (1.0 - circle.radius) * std::sqrt(random->Uniform());
  circle.center = r * Along(random->Uniform(0.0, 2.0 * kPi));
  circle.arc_start = random->Uniform(0.0, 2.0 * kPi);
  if (random->Uniform() < recipe.partial_share) {
    circle.arc = random->Uniform(recipe.min_arc_deg, 360.0) * kDegree;
  }
  circle.num_points = LogUniformInt(recipe.min_points, recipe.max_points, random);
  return circle;
}

void DrawCircles(const Recipe& recipe, World* world, Random* random) {
  const int count = UniformFrom(recipe.min_circles, recipe.max_circles, random);
  const bool rings = count >= 2 && random->Uniform() < recipe.ring_share;
  const double largest = 0.9 / std::sqrt(0.5 * (count + 1));
  while (static_cast<int>(world->circles.size()) < count) {
    WorldCircle circle = DrawCircle(recipe, largest, random);
    const int left = count - static_cast<int>(world->circles.size());
    const int members = rings && left >= 2 ? UniformFrom(2, std::min(3, left), random) : 1;
    const int first = static_cast<int>(world->circles.size());
    for (int i = 0; i < members; ++i) {
      WorldCircle member = DrawCircle(recipe, largest, random);
      member.center = circle.center;
      member.radius = circle.radius;
      if (members > 1) member.ring = first;
      world->circles.push_back(member);
      circle.radius *= random->Uniform(0.4, 0.8);
    }
  }
}

WorldPencil DrawPencil(const Recipe& recipe, Random* random) {
  WorldPencil pencil;
  const int count = UniformFrom(recipe.min_lines, recipe.max_lines, random);
  // From end points alone to edge points all along.
  const bool segments = recipe.max_line_points == 2 || random->Uniform() < 0.3;
  for (int i = 0; i < count; ++i) {
    WorldLine line;
    line.offset = random->Uniform(-1.0, 1.0);
    const double half = random->Uniform(0.2, 0.9), middle = random->Uniform(half - 1.0, 1.0 - half);
    line.from = middle - half;
    line.to = middle + half;
    line.num_points = segments ? 2 : LogUniformInt(5, recipe.max_line_points, random);
    pencil.lines.push_back(line);
  }
  return pencil;
}

void DrawPencils(const Recipe& recipe, int count, World* world, Random* random) {
  for (int i = 0; i < count; ++i) {
    WorldPencil pencil = DrawPencil(recipe, random);
    const bool free = recipe.free_pencils && random->Uniform() < 0.4;
    // Where no pencil has a role the first one is taken for the X axis: it lies along it.
    if (i == 0) {
      pencil.direction = free ? PencilDirection::kFree : PencilDirection::kX;
    } else if (i == 1 && !free) {
      pencil.direction = PencilDirection::kY;
      pencil.angle = 0.5 * kPi;
    } else {
      pencil.direction = PencilDirection::kFree;
      pencil.angle = random->Uniform(20.0, 160.0) * kDegree;
    }
    world->pencils.push_back(pencil);
  }
  // The first one is free, but another has a role: any direction will do.
  if (HasRole(world->pencils) && world->pencils[0].direction == PencilDirection::kFree) {
    world->pencils[0].angle = random->Uniform(-70.0, 70.0) * kDegree;
  }
}

void Scale(double factor, World* world) {
  for (WorldCircle& circle : world->circles) {
    circle.center *= factor;
    circle.radius *= factor;
  }
  for (WorldPencil& pencil : world->pencils) {
    for (WorldLine& line : pencil.lines) {
      line.offset *= factor;
      line.from *= factor;
      line.to *= factor;
    }
  }
}

}  // namespace

World DrawWorld(const Recipe& recipe, Random* random) {
  constexpr double kSmallestScale = 0.8;
  while (true) {
    World world;
    world.camera = DrawCamera(static_cast<Lens>(random->UniformInt(recipe.num_lenses)), random);
    world.pose = DrawPose(recipe, world.camera, random);
    const int pencils = UniformFrom(recipe.min_pencils, recipe.max_pencils, random);
    if (!(recipe.pencils_only_too && pencils >= 2 && random->Uniform() < 0.1)) {
      DrawCircles(recipe, &world, random);
    }
    DrawPencils(recipe, pencils, &world, random);
    double scale = random->Uniform(2.0, 8.0);
    Scale(scale, &world);
    while (scale > kSmallestScale && !IsVisible(world)) {
      Scale(0.8, &world);
      scale *= 0.8;
    }
    if (scale > kSmallestScale) return world;
  }
}

}  // namespace circline::apps
