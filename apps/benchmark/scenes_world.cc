#include "apps/benchmark/scenes_world.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "circline/estimators/basics.h"
#include "tests/basics.h"

namespace circline::apps {
namespace {

constexpr double kBandPx = 40.0;  // An outlier's largest distance from its curve.

using Matrix23 = Eigen::Matrix<double, 2, 3>;

// Fills point and pixel of a sample, and how the pixel moves with the point in the camera frame.
bool Project(const World& world, const Eigen::Vector3d& X, Sample* sample, Matrix23* by_point) {
  const Camera& camera = world.camera;
  const Eigen::Vector3d p = world.pose.rotation * X + world.pose.translation;
  sample->point = p;
  if (!CameraToPixel(camera, p, &sample->pixel)) return false;
  const Eigen::Vector2d& u = sample->pixel;
  if (u.x() < 0.0 || u.y() < 0.0 || u.x() > camera.width - 1.0 || u.y() > camera.height - 1.0) {
    return false;
  }
  Eigen::Vector2d pixel;
  std::array<double, 4> j{};
  DistortWithJacobian(camera, p.head<2>() / p.z(), &pixel, &j);
  Eigen::Matrix2d distort;
  distort << j[0], j[1], j[2], j[3];
  Matrix23 project;
  project << 1.0, 0.0, -p.x() / p.z(), 0.0, 1.0, -p.y() / p.z();
  *by_point = distort * project / p.z();
  return true;
}

// Fills all of a sample but `on_plane`; `tangent` is in the world frame.
bool SamplePoint(const World& world, const Eigen::Vector3d& X, const Eigen::Vector3d& tangent,
                 Sample* sample) {
  Matrix23 by_point;
  if (!Project(world, X, sample, &by_point)) return false;
  const Eigen::Vector2d along = (by_point * (world.pose.rotation * tangent)).normalized();
  sample->normal = Eigen::Vector2d(along.y(), -along.x());
  sample->by_point = sample->normal.transpose() * by_point;
  return true;
}

Eigen::Vector3d OnPlane(const Eigen::Vector2d& x) { return {x.x(), x.y(), 0.0}; }

std::vector<Eigen::Vector2d> Disturb(const std::vector<Sample>& samples, const Disturbance& d,
                                     double offset_px, Random* random) {
  std::vector<Eigen::Vector2d> pixels;
  for (const Sample& sample : samples) {
    pixels.push_back(sample.pixel + Noise2(d.noise_px, random) + offset_px * sample.normal);
  }
  // The first so many of a random order are replaced.
  const int n = static_cast<int>(samples.size());
  const int num_outliers = static_cast<int>(std::lround(d.outlier_ratio * n));
  std::vector<std::size_t> order(samples.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  for (int i = 0; i < num_outliers; ++i) {
    const auto at = static_cast<std::size_t>(i);
    std::swap(order[at], order[at + static_cast<std::size_t>(random->UniformInt(n - i))]);
    const Sample& foot = samples[static_cast<std::size_t>(random->UniformInt(n))];
    pixels[order[at]] = foot.pixel + random->Uniform(-kBandPx, kBandPx) * foot.normal;
  }
  return pixels;
}

}  // namespace

Eigen::Vector2d Along(double angle) { return {std::cos(angle), std::sin(angle)}; }
Eigen::Vector2d Across(double angle) { return {-std::sin(angle), std::cos(angle)}; }

bool SampleCircle(const World& world, const WorldCircle& circle, std::vector<Sample>* samples) {
  samples->resize(static_cast<std::size_t>(circle.num_points));
  const Eigen::Matrix3d turn = ExpRotation(OnPlane(circle.tilt));
  const bool whole = circle.arc > 2.0 * kPi - 1e-9;
  for (int i = 0; i < circle.num_points; ++i) {
    const double a = circle.arc_start + circle.arc * i / (circle.num_points - (whole ? 0 : 1));
    Sample& sample = (*samples)[static_cast<std::size_t>(i)];
    sample.on_plane = circle.center + circle.radius * Along(a);
    const Eigen::Vector3d X = OnPlane(circle.center) + circle.radius * (turn * OnPlane(Along(a)));
    if (!SamplePoint(world, X, turn * OnPlane(Across(a)), &sample)) return false;
    // Outwards: where a point of a larger circle would be seen.
    const Eigen::Vector3d outwards = world.pose.rotation * (turn * OnPlane(Along(a)));
    if (sample.by_point * outwards < 0.0) {
      sample.normal = -sample.normal;
      sample.by_point = -sample.by_point;
    }
  }
  return true;
}

bool SampleLine(const World& world, const WorldPencil& pencil, const WorldLine& line,
                std::vector<Sample>* samples) {
  samples->resize(static_cast<std::size_t>(line.num_points));
  const double angle = pencil.angle + line.turn;
  const double middle = 0.5 * (line.from + line.to);
  const Eigen::Vector2d center = middle * Along(pencil.angle) + line.offset * Across(pencil.angle);
  for (int i = 0; i < line.num_points; ++i) {
    const double s = line.from + (line.to - line.from) * i / (line.num_points - 1);
    Sample& sample = (*samples)[static_cast<std::size_t>(i)];
    sample.on_plane = s * Along(pencil.angle) + line.offset * Across(pencil.angle);
    const Eigen::Vector2d X = center + (s - middle) * Along(angle);
    if (!SamplePoint(world, OnPlane(X), OnPlane(Along(angle)), &sample)) return false;
  }
  return true;
}

bool SampleCenter(const World& world, const WorldCircle& circle, std::array<Sample, 2>* samples) {
  Sample sample;
  Matrix23 by_point;
  if (!Project(world, OnPlane(circle.center), &sample, &by_point)) return false;
  sample.on_plane = circle.center;
  for (const int axis : {0, 1}) {
    sample.normal = Eigen::Vector2d::Unit(axis);
    sample.by_point = by_point.row(axis);
    (*samples)[static_cast<std::size_t>(axis)] = sample;
  }
  return true;
}

bool HasRole(const std::vector<WorldPencil>& pencils) {
  return std::any_of(pencils.begin(), pencils.end(), [](const WorldPencil& pencil) {
    return pencil.direction != PencilDirection::kFree;
  });
}

bool IsVisible(const World& world) {
  std::vector<Sample> samples;
  std::array<Sample, 2> center;
  for (const WorldCircle& circle : world.circles) {
    if (!SampleCircle(world, circle, &samples)) return false;
    if (circle.has_center && !SampleCenter(world, circle, &center)) return false;
  }
  for (const WorldPencil& pencil : world.pencils) {
    for (const WorldLine& line : pencil.lines) {
      if (!SampleLine(world, pencil, line, &samples)) return false;
    }
  }
  return true;
}

double SemiMinorPx(const World& world, const WorldCircle& circle) {
  // Of points evenly spread over an ellipse the variance along an axis is half of its square.
  constexpr int kPoints = 32;
  Eigen::Matrix2Xd pixels(2, kPoints);
  for (int i = 0; i < kPoints; ++i) {
    const Eigen::Vector2d x = circle.center + circle.radius * Along(2.0 * kPi * i / kPoints);
    Eigen::Vector2d pixel;
    if (!CameraToPixel(world.camera, world.pose.rotation * OnPlane(x) + world.pose.translation,
                       &pixel)) {
      return 0.0;
    }
    pixels.col(i) = pixel;
  }
  pixels.colwise() -= Eigen::Vector2d(pixels.rowwise().mean());
  const Eigen::Matrix2d variance = pixels * pixels.transpose() / kPoints;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(variance, Eigen::EigenvaluesOnly);
  return std::sqrt(2.0 * std::max(0.0, eigen.eigenvalues()[0]));
}

double SmallestSemiMinorPx(const World& world) {
  double smallest = 1e9;
  for (const WorldCircle& circle : world.circles) {
    smallest = std::min(smallest, SemiMinorPx(world, circle));
  }
  return smallest;
}

double SmallestArc(const World& world) {
  double smallest = 2.0 * kPi;
  for (const WorldCircle& circle : world.circles) smallest = std::min(smallest, circle.arc);
  return smallest;
}

double Tilt(const World& world) {
  const double cosine = -world.pose.rotation.col(2).dot(world.pose.translation.normalized());
  return std::acos(std::clamp(cosine, -1.0, 1.0));
}

double OddLineDeviation(const World& world, const WorldPencil& pencil, const WorldLine& line) {
  WorldLine straight = line;
  straight.turn = 0.0;
  std::vector<Sample> odd, even;
  if (!SampleLine(world, pencil, line, &odd) || !SampleLine(world, pencil, straight, &even)) {
    return 0.0;
  }
  Eigen::VectorXd distance(line.num_points);
  for (int i = 0; i < line.num_points; ++i) {
    const auto at = static_cast<std::size_t>(i);
    distance[i] = even[at].normal.dot(odd[at].pixel - even[at].pixel);
  }
  return (distance.array() - distance.mean()).matrix().norm();
}

Observations Observe(const World& world, const Disturbance& disturbance, Random* random) {
  Observations observations;
  observations.camera = world.camera;
  observations.frame.plane = "p0";
  const double sigma_px = disturbance.stated ? disturbance.noise_px : 0.0;
  std::vector<Sample> samples;
  for (const WorldCircle& circle : world.circles) {
    CircleObservation& c = observations.circles.emplace_back();
    c.id = "c" + std::to_string(observations.circles.size() - 1);
    c.plane = "p0";
    c.sigma_px = sigma_px;
    if (circle.ring >= 0) c.concentric = "g" + std::to_string(circle.ring);
    if (circle.stated_radius > 0.0) c.radius = circle.stated_radius * circle.radius;
    if (world.equal_radii) c.radius_group = "r";
    if (disturbance.bleed_px != 0.0) c.contrast = -1;  // Dark print that bleeds.
    SampleCircle(world, circle, &samples);
    c.points = Disturb(samples, disturbance, disturbance.bleed_px, random);
    std::array<Sample, 2> center;
    if (circle.has_center && SampleCenter(world, circle, &center)) {
      c.center = center[0].pixel + Noise2(disturbance.noise_px, random);
    }
  }
  for (const WorldPencil& pencil : world.pencils) {
    PencilObservation& p = observations.pencils.emplace_back();
    p.id = "L" + std::to_string(observations.pencils.size() - 1);
    p.direction = pencil.direction;
    p.plane = "p0";
    p.sigma_px = sigma_px;
    for (const WorldLine& line : pencil.lines) {
      SampleLine(world, pencil, line, &samples);
      p.lines.emplace_back().points = Disturb(samples, disturbance, 0.0, random);
    }
  }
  return observations;
}

}  // namespace circline::apps
