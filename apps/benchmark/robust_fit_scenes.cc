#include "apps/benchmark/robust_fit_scenes.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/estimators/random.h"
#include "tests/basics.h"
#include "tests/pinhole_camera.h"
#include "tests/ransac/segment_scene.h"

namespace circline::apps {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Semi-axes of the second rim over those of the first.
constexpr double kRimScale = 1.15;

Vector2d Unit(double angle) { return {std::cos(angle), std::sin(angle)}; }

Vector2d EllipseNormal(const Ellipse& e, double t) {
  const Vector2d local(std::cos(t) / e.a, std::sin(t) / e.b);
  return (Eigen::Rotation2Dd(e.angle) * local).normalized();
}

Vector2d Turned(const Vector2d& normal, double sigma_rad, Random* random) {
  return Eigen::Rotation2Dd(sigma_rad * random->Normal()) * normal;
}

struct Box {
  Vector2d center, half;

  Box(const Ellipse& ellipse, double from, double to, double factor) {
    Vector2d low = EllipsePoint(ellipse, from), high = low;
    for (int i = 1; i <= 360; ++i) {
      const Vector2d p = EllipsePoint(ellipse, from + (to - from) * i / 360.0);
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    center = 0.5 * (low + high);
    half = 0.5 * factor * (high - low);
  }
  Vector2d Draw(Random* random) const {
    const double x = random->Uniform(-1.0, 1.0), y = random->Uniform(-1.0, 1.0);
    return center + half.cwiseProduct(Vector2d(x, y));
  }
};

int NumOutliers(int inliers, double ratio) {
  return static_cast<int>(std::lround(inliers * ratio / (1.0 - ratio)));
}

// Draws clutter points, each with the direction of an edge there.
class ClutterSource {
 public:
  ClutterSource(const ConicSceneOptions& options, const Ellipse& ellipse, const Box& box,
                Random* random)
      : options_(options), box_(box), random_(random) {
    other_.center = ellipse.center + Vector2d(60.0, -40.0);
    other_.a = 80.0;
    other_.b = 50.0;
    other_.angle = random->Uniform(-1.5, 1.5);
    along_ = Unit(random->Uniform(0.0, kPi));
    on_edge_ = ellipse.center + Vector2d(20.0, 10.0);
    disc_ = box.Draw(random);
    rim_ = ellipse;
    rim_.a *= kRimScale;
    rim_.b *= kRimScale;
    if (options.clutter != Clutter::kRim) return;
    rim_start_ = random->Uniform(0.0, 2.0 * kPi);
    rim_arc_ = 2.0 * kPi * options.outlier_ratio / (1.0 - options.outlier_ratio);
  }

  void Draw(Vector2d* pixel, Vector2d* normal) {
    *normal = Unit(random_->Uniform(0.0, kPi));
    switch (options_.clutter) {
      case Clutter::kUniform:
      case Clutter::kArcBox:
        *pixel = box_.Draw(random_);
        break;
      case Clutter::kEllipse: {
        const double t = random_->Uniform(0.0, 2.0 * kPi);
        *pixel = EllipsePoint(other_, t) + Noise2(options_.sigma_px, random_);
        *normal = Turned(EllipseNormal(other_, t), options_.direction_sigma_rad, random_);
        break;
      }
      case Clutter::kEdge: {
        const Vector2d noise = Noise2(options_.sigma_px, random_);
        *pixel = on_edge_ + random_->Uniform(-150.0, 150.0) * along_ + noise;
        *normal = Turned({-along_.y(), along_.x()}, options_.direction_sigma_rad, random_);
        break;
      }
      case Clutter::kRim: {
        const double t = rim_start_ + random_->Uniform(0.0, rim_arc_);
        *pixel = EllipsePoint(rim_, t) + Noise2(options_.sigma_px, random_);
        *normal = Turned(EllipseNormal(rim_, t), options_.direction_sigma_rad, random_);
        break;
      }
      case Clutter::kCluster: {
        const double r = 15.0 * std::sqrt(random_->Uniform());
        *pixel = disc_ + r * Unit(random_->Uniform(0.0, 2.0 * kPi));
        break;
      }
    }
  }

  // The second rim where it is seen.
  std::vector<Vector2d> Rim() const {
    std::vector<Vector2d> points;
    if (options_.clutter != Clutter::kRim) return points;
    const int n = NumOutliers(options_.num_inliers, options_.outlier_ratio);
    for (int i = 0; i < n; ++i) points.push_back(EllipsePoint(rim_, rim_start_ + rim_arc_ * i / n));
    return points;
  }

 private:
  const ConicSceneOptions& options_;
  const Box& box_;
  Random* random_;
  Ellipse other_, rim_;
  Vector2d along_, on_edge_, disc_;
  double rim_start_ = 0.0, rim_arc_ = 0.0;
};

// Of a fit of so many parameters.
template <typename Distance>
double ErrorAlong(const std::vector<CalibratedPoint>& truth, int parameters, double sigma_px,
                  const Distance& distance) {
  double sum = 0.0;
  for (const CalibratedPoint& p : truth) sum += distance(p) * distance(p);
  return std::sqrt(sum / parameters) / sigma_px;
}

}  // namespace

double ConicScene::Error(const Matrix3d& conic) const {
  return ErrorAlong(truth, 5, sigma_px,
                    [&](const CalibratedPoint& p) { return ConicDistancePx(p, conic); });
}

double ConicScene::RimError(const Matrix3d& conic) const {
  return ErrorAlong(rim, 5, sigma_px,
                    [&](const CalibratedPoint& p) { return ConicDistancePx(p, conic); });
}

ConicScene MakeConicScene(const ConicSceneOptions& options, std::uint64_t seed) {
  Random random(seed);
  Ellipse ellipse;
  ellipse.center = {320.0, 240.0};
  ellipse.a = 100.0;
  ellipse.b = 60.0;
  ellipse.angle = random.Uniform(-1.5, 1.5);
  ConicScene scene;
  scene.sigma_px = options.sigma_px;
  std::vector<Vector2d> truth;
  const double arc = options.arc_deg * kDegree;
  const double start = random.Uniform(0.0, 2.0 * kPi);
  for (int i = 0; i < options.num_inliers; ++i) {
    const double t = start + arc * i / options.num_inliers;
    truth.push_back(EllipsePoint(ellipse, t));
    scene.pixels.push_back(truth.back() + Noise2(options.sigma_px, &random));
    scene.directions.normals.push_back(
        Turned(EllipseNormal(ellipse, t), options.direction_sigma_rad, &random));
  }
  const double seen = options.clutter == Clutter::kArcBox ? arc : 2.0 * kPi;
  const Box box(ellipse, start, start + seen, 1.5);
  ClutterSource clutter(options, ellipse, box, &random);
  for (int i = 0; i < NumOutliers(options.num_inliers, options.outlier_ratio); ++i) {
    Vector2d pixel, normal;
    clutter.Draw(&pixel, &normal);
    scene.pixels.push_back(pixel);
    scene.directions.normals.push_back(normal);
  }
  PixelsToCalibrated(PinholeCamera(), scene.pixels, &scene.points);
  PixelsToCalibrated(PinholeCamera(), truth, &scene.truth);
  PixelsToCalibrated(PinholeCamera(), clutter.Rim(), &scene.rim);
  return scene;
}

double LineScene::Error(const Vector3d& line) const {
  return ErrorAlong(truth, 2, sigma_px,
                    [&](const CalibratedPoint& p) { return LineDistancePx(p, line); });
}

LineScene MakeLineScene(double outlier_ratio, double sigma_px, std::uint64_t seed) {
  Random random(seed);
  const Vector2d along = Unit(random.Uniform(0.0, kPi)), center(320.0, 240.0);
  LineScene scene;
  scene.sigma_px = sigma_px;
  std::vector<Vector2d> truth;
  for (int i = 0; i < 100; ++i) {
    truth.push_back(center + along * (3.0 * i - 150.0));
    scene.pixels.push_back(truth.back() + Noise2(sigma_px, &random));
  }
  for (int i = 0; i < NumOutliers(100, outlier_ratio); ++i) {
    const double x = random.Uniform(-200.0, 200.0), y = random.Uniform(-200.0, 200.0);
    scene.pixels.push_back(center + Vector2d(x, y));
  }
  PixelsToCalibrated(PinholeCamera(), scene.pixels, &scene.points);
  PixelsToCalibrated(PinholeCamera(), truth, &scene.truth);
  return scene;
}

double PencilScene::Error(const Matrix3d& estimate) const {
  // The columns that are nearest; a rotation, whatever the third one's sign.
  constexpr std::array<std::array<int, 3>, 6> kOrders = {
      {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
  double smallest = kPi;
  for (const std::array<int, 3>& order : kOrders) {
    Matrix3d matched;
    for (int k = 0; k < 3; ++k) {
      const Vector3d column = estimate.col(order[static_cast<std::size_t>(k)]);
      matched.col(k) = column.dot(rotation.col(k)) < 0.0 ? Vector3d(-column) : column;
    }
    if (matched.determinant() < 0.0) continue;
    smallest = std::min(smallest, Eigen::AngleAxisd(matched * rotation.transpose()).angle());
  }
  return smallest;
}

PencilScene MakePencilScene(int per_direction, double clutter_ratio, std::uint64_t seed) {
  Random random(seed);
  PencilScene scene;
  scene.per_direction = per_direction;
  scene.rotation = segment_scene::RandomRotation(&random);
  Matrix3d information = Matrix3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const Vector3d direction = scene.rotation.col(k);
    for (int i = 0; i < per_direction; ++i) {
      segment_scene::AddSegment(&direction, &random, &scene.lines);
      // l . (v + delta x v) moves by delta . (v x l).
      const LineFit& line = scene.lines.back();
      const Vector3d slope = direction.cross(line.line);
      information += slope * slope.transpose() / direction.dot(line.covariance * direction);
    }
  }
  scene.rotation_bound = std::sqrt(information.inverse().trace());
  const int clutter = NumOutliers(3 * per_direction, clutter_ratio);
  for (int i = 0; i < clutter; ++i) segment_scene::AddSegment(nullptr, &random, &scene.lines);
  return scene;
}

}  // namespace circline::apps
