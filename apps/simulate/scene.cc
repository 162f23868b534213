#include "apps/simulate/scene.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "circline/estimators/basics.h"

namespace circline::apps {
namespace {

constexpr double kRotationAngle = 0.84;  // Radians, about (0.717, 0.359, 0.598).
constexpr double kSide = 20.0;           // Of the square, world units.
constexpr double kRadius = 7.0;
constexpr int kCirclePoints = 100, kLinePoints = 50;
constexpr double kBandPx = 40.0, kClusterRadiusPx = 15.0, kClusterOffsetPx = 40.0;
constexpr double kExactSigmaPx = 1e-3;

enum Feature : std::size_t { kCircle, kL11, kL12, kL21, kL22 };

// Positions in PaperScene's parameters.
constexpr int kTranslation = 3, kCenter = 5, kCircleRadius = 7, kOffsetL12 = 8, kOffsetL22 = 9;

std::size_t UniformIndex(std::size_t n, Random* random) {
  return static_cast<std::size_t>(random->UniformInt(static_cast<int>(n)));
}

Eigen::Vector2d UniformInDisc(double radius, Random* random) {
  const double r = radius * std::sqrt(random->Uniform());
  const double angle = random->Uniform(0.0, 2.0 * kPi);
  return {r * std::cos(angle), r * std::sin(angle)};
}

// The first and the last point of the line that is no outlier: where a person would draw an axis.
Segment DrawAxis(const LineObservation& line, const std::vector<std::uint8_t>& mask) {
  const auto first = std::find(mask.begin(), mask.end(), 1);
  const auto last = std::find(mask.rbegin(), mask.rend(), 1);
  return {line.points[static_cast<std::size_t>(first - mask.begin())],
          line.points[static_cast<std::size_t>(mask.rend() - last - 1)]};
}

std::vector<std::size_t> FeaturesOf(Evidence evidence) {
  switch (evidence) {
    case Evidence::kCircleFrame:
      return {kCircle, kL11, kL21};
    case Evidence::kLinePairs:
      return {kL11, kL12, kL21, kL22};
    case Evidence::kJoint:
      break;
  }
  return {kCircle, kL11, kL12, kL21, kL22};
}

}  // namespace

PaperScene::PaperScene(double focal_px, const Eigen::Vector3d& translation) {
  camera_.fx = camera_.fy = focal_px;
  pose_.rotation = ExpRotation(kRotationAngle * Eigen::Vector3d(0.717, 0.359, 0.598).normalized());
  pose_.translation = translation;
  for (int i = 0; i < kCirclePoints; ++i) {
    const double a = 2.0 * kPi * i / kCirclePoints;
    const Eigen::Vector2d direction(std::cos(a), std::sin(a));
    const Eigen::Vector2d center(kSide / 2.0, kSide / 2.0);
    features_[kCircle].push_back(MakeSample(
        center + kRadius * direction, Eigen::Vector2d(-direction.y(), direction.x()), kCircle));
  }
  const Eigen::Vector2d x = Eigen::Vector2d::UnitX(), y = Eigen::Vector2d::UnitY();
  for (int i = 0; i < kLinePoints; ++i) {
    const double s = kSide * i / (kLinePoints - 1);
    features_[kL11].push_back(MakeSample(s * x, x, kL11));
    features_[kL12].push_back(MakeSample(s * x + kSide * y, x, kL12));
    features_[kL21].push_back(MakeSample(s * y, y, kL21));
    features_[kL22].push_back(MakeSample(s * y + kSide * x, y, kL22));
  }
}

Eigen::Vector3d PaperScene::ToCamera(const Eigen::Vector2d& X) const {
  return pose_.rotation.leftCols<2>() * X + pose_.translation;
}

PaperScene::Sample PaperScene::MakeSample(const Eigen::Vector2d& X, const Eigen::Vector2d& tangent,
                                          std::size_t feature) const {
  const Eigen::Vector3d p = ToCamera(X);
  Eigen::Matrix<double, 2, 3> by_camera_point;
  by_camera_point << 1.0, 0.0, -p.x() / p.z(), 0.0, 1.0, -p.y() / p.z();
  by_camera_point *= camera_.fx / p.z();
  const Eigen::Matrix2d by_plane_point = by_camera_point * pose_.rotation.leftCols<2>();

  Sample sample;
  sample.pixel = camera_.fx * p.hnormalized();
  const Eigen::Vector2d along = (by_plane_point * tangent).normalized();
  sample.normal = Eigen::Vector2d(-along.y(), along.x());
  // R = exp([delta]x) R moves a point by -[p - t]x delta; the length of t is the unit.
  const Eigen::RowVector2d n = sample.normal.transpose();
  const Eigen::RowVector3d by_point = n * by_camera_point;
  const Eigen::RowVector2d by_plane = n * by_plane_point;
  Gradient& g = sample.gradient;
  g.setZero();
  g.head<3>() = -(by_point * CrossMatrix(p - pose_.translation)).transpose();
  const Eigen::Vector3d t = pose_.translation.normalized();
  const Eigen::Vector3d a = t.unitOrthogonal(), b = t.cross(a);
  g[kTranslation] = by_point * a;
  g[kTranslation + 1] = by_point * b;
  if (feature == kCircle) {
    g.segment<2>(kCenter) = by_plane.transpose();
    g[kCircleRadius] = by_plane * Eigen::Vector2d(tangent.y(), -tangent.x());
  } else if (feature == kL12) {
    g[kOffsetL12] = by_plane.y();
  } else if (feature == kL22) {
    g[kOffsetL22] = by_plane.x();
  }
  return sample;
}

Status PaperScene::Validate() const {
  for (const Eigen::Vector2d& corner :
       {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(kSide, 0.0), Eigen::Vector2d(0.0, kSide),
        Eigen::Vector2d(kSide, kSide)}) {
    Eigen::Vector2d pixel;
    if (!CameraToPixel(camera_, ToCamera(corner), &pixel)) {
      return Status::Invalid("the scene does not lie in front of the camera");
    }
  }
  return Status::Ok();
}

std::vector<Eigen::Vector2d> PaperScene::Disturb(const std::vector<Sample>& samples,
                                                 const Disturbance& disturbance, Random* random,
                                                 std::vector<std::uint8_t>* mask) const {
  std::vector<Eigen::Vector2d> pixels;
  for (const Sample& sample : samples) {
    const double dx = random->Normal(), dy = random->Normal();
    pixels.push_back(sample.pixel + disturbance.noise_px * Eigen::Vector2d(dx, dy));
  }
  mask->assign(samples.size(), 1);
  const auto num_outliers = static_cast<std::size_t>(
      std::lround(disturbance.outlier_ratio * static_cast<double>(samples.size())));
  if (num_outliers == 0) return pixels;

  const Sample& near_cluster = samples[UniformIndex(samples.size(), random)];
  const double side = random->Uniform() < 0.5 ? -1.0 : 1.0;
  const Eigen::Vector2d cluster =
      near_cluster.pixel + side * kClusterOffsetPx * near_cluster.normal;
  std::vector<std::size_t> order(samples.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t i = 0; i < num_outliers; ++i) {
    std::swap(order[i], order[i + UniformIndex(order.size() - i, random)]);
    (*mask)[order[i]] = 0;
    Eigen::Vector2d& pixel = pixels[order[i]];
    if (disturbance.outlier_kind == OutlierKind::kCluster) {
      pixel = cluster + UniformInDisc(kClusterRadiusPx, random);
    } else {
      const Sample& foot = samples[UniformIndex(samples.size(), random)];
      pixel = foot.pixel + random->Uniform(-kBandPx, kBandPx) * foot.normal;
    }
  }
  return pixels;
}

Observations PaperScene::Observe(const Disturbance& disturbance, Random* random,
                                 InlierMasks* masks) const {
  Observations observations;
  observations.camera = camera_;
  const double sigma_px = disturbance.noise_px > 0.0 ? disturbance.noise_px : kExactSigmaPx;
  const auto disturb = [&](std::size_t feature) {
    return Disturb(features_[feature], disturbance, random, &(*masks)[feature]);
  };
  CircleObservation circle;
  circle.id = "c0";
  circle.plane = "p0";
  circle.sigma_px = sigma_px;
  circle.points = disturb(kCircle);
  observations.circles = {circle};
  for (const bool along_x : {true, false}) {
    PencilObservation pencil;
    pencil.id = along_x ? "L1" : "L2";
    pencil.direction = along_x ? PencilDirection::kX : PencilDirection::kY;
    pencil.plane = "p0";
    pencil.sigma_px = sigma_px;
    pencil.lines.resize(2);
    pencil.lines[0].points = disturb(along_x ? kL11 : kL21);
    pencil.lines[1].points = disturb(along_x ? kL12 : kL22);
    observations.pencils.push_back(pencil);
  }
  observations.frame.plane = "p0";
  observations.frame.x_axis = DrawAxis(observations.pencils[0].lines[0], (*masks)[kL11]);
  observations.frame.y_axis = DrawAxis(observations.pencils[1].lines[0], (*masks)[kL21]);
  return observations;
}

Eigen::Matrix3d PaperScene::BoundCovariance(Evidence evidence, const InlierMasks& masks) const {
  Eigen::Matrix<double, kNumParameters, kNumParameters> information;
  information.setZero();
  for (const std::size_t f : FeaturesOf(evidence)) {
    for (std::size_t i = 0; i < features_[f].size(); ++i) {
      const Gradient& g = features_[f][i].gradient;
      if (masks[f][i] != 0) information += g * g.transpose();
    }
  }
  std::vector<int> used;  // Those that the evidence depends on.
  for (int k = 0; k < kNumParameters; ++k) {
    if (information(k, k) > 0.0) used.push_back(k);
  }
  if (used.size() < 3) return Eigen::Matrix3d::Constant(std::numeric_limits<double>::quiet_NaN());
  const Eigen::MatrixXd own = information(used, used);
  return own.inverse().topLeftCorner<3, 3>();
}

}  // namespace circline::apps
