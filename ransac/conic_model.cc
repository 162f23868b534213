#include "circline/ransac/conic_model.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/conic_moments.h"
#include "circline/ransac/conic_weights.h"

namespace circline {
namespace {

// Which ellipses are worth a look; this keeps out what explains a straight edge or a blob of
// clutter. Smallest semi-minor axis, pixels.
constexpr double kMinAxisPx = 2.0;
// Largest semi-major axis, in half diagonals of the points' box.
constexpr double kMaxAxisRatio = 10.0;
// Angle over which the inliers spread, degrees; see Accept.
constexpr double kMinArcDeg = 30.0;
// What the best straight line may explain of the ellipse's inliers, relative to the ellipse.
constexpr double kMaxLineShare = 0.75;

// Keeps 0 / 0 out of the centre of a conic; far below any squared gradient per pixel that matters.
constexpr float kTiny = 1e-30f;

// Whether `width` neighbouring sectors hold four fifths of the counts: the rest may be clutter.
bool HoldMost(const std::array<int, kConicSectors>& counts, int width) {
  int total = 0, sum = 0;
  for (int i = 0; i < kConicSectors; ++i) {
    total += counts[static_cast<std::size_t>(i)];
    sum += i < width ? counts[static_cast<std::size_t>(i)] : 0;
  }
  for (int i = 0, next = width; i < kConicSectors; ++i, ++next) {
    if (5 * sum >= 4 * total) return true;
    if (next == kConicSectors) next = 0;
    sum += counts[static_cast<std::size_t>(next)] - counts[static_cast<std::size_t>(i)];
  }
  return false;
}

// Inliers that stand for all of them, in random order, in two flat arrays.
struct SomePoints {
  static constexpr int kMost = 64;
  // What is not filled lies on no line.
  using Array = Eigen::Array<float, kMost, 1>;
  Array x = Array::Constant(1e6f), y = Array::Constant(1e6f);
  int size = 0;

  void Add(const Eigen::Vector2d& p) {
    x[size] = static_cast<float>(p.x());
    y[size++] = static_cast<float>(p.y());
  }
};

// What a straight line explains of the points, as a sum of 1 - min(r^2 / T^2, 1): the best of lines
// through pairs of them.
double GainOfLine(const SomePoints& points, double threshold) {
  constexpr int kPairs = 16;  // Three quarters on a line: all miss it once in 10^5.
  float best = 0.0f;
  for (int k = 0; k < std::min(kPairs, points.size / 2); ++k) {
    const int other = points.size - 1 - k;
    const float dx = points.x[other] - points.x[k], dy = points.y[other] - points.y[k];
    const float length = std::sqrt(dx * dx + dy * dy);
    const float t = static_cast<float>(threshold);
    if (length < 4.0f * t) continue;
    const float nx = -dy / (length * t), ny = dx / (length * t);
    const float offset = nx * points.x[k] + ny * points.y[k];
    const SomePoints::Array r = nx * points.x + ny * points.y - offset;
    best = std::max(best, (1.0f - r.square()).max(0.0f).sum());
  }
  return static_cast<double>(best);
}

}  // namespace

Status EdgeDirections::Validate(std::size_t num_points) const {
  if (!normals.empty() && normals.size() != num_points)
    return Status::Invalid("normals must be one for each point");
  if (!(sigma_rad > 0.0 && sigma_rad <= 0.5)) {
    return Status::Invalid("sigma_rad must be positive and 0.5 at most");
  }
  for (const Eigen::Vector2d& normal : normals) {
    if (!normal.allFinite()) return Status::Invalid("normals must be finite");
  }
  return Status::Ok();
}

ConicModel::ConicModel(const std::vector<CalibratedPoint>& points, const EdgeDirections& directions,
                       double threshold)
    : index_(RandomOrder(static_cast<int>(points.size()), 1)),
      sigma_px_(threshold / kInlierSigmas) {
  const std::size_t n = points.size();
  if (n == 0) return;
  Eigen::AlignedBox2d box;
  for (const CalibratedPoint& p : points) box.extend(p.x);
  center_ = box.center();
  scale_ = std::max(0.5 * box.diagonal().norm(), 1e-12);
  half_box_ = 0.5 * box.diagonal() / scale_;
  box_area_ = 4.0 * half_box_.prod();
  data_.resize((directions.normals.empty() ? 6 : 8) * n);
  double area = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    CalibratedPoint p = points[static_cast<std::size_t>(index_[i])];
    p.x = (p.x - center_) / scale_;
    data_[i] = static_cast<float>(p.x.x());
    data_[n + i] = static_cast<float>(p.x.y());
    std::array<double, 4>& j = p.x_from_pixel;
    for (std::size_t k = 0; k < 4; ++k) {
      j[k] /= scale_;
      data_[(2 + k) * n + i] = static_cast<float>(j[k]);
    }
    area += std::abs(j[0] * j[3] - j[1] * j[2]);
    points_.push_back(p);
  }
  pixel_ = std::sqrt(area / static_cast<double>(n));
  if (!directions.normals.empty()) ReadDirections(directions);
}

void ConicModel::ReadDirections(const EdgeDirections& directions) {
  const std::size_t n = index_.size();
  sigma_rad_ = directions.sigma_rad;
  normals_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    normals_[i] = directions.normals[static_cast<std::size_t>(index_[i])];
    const double length = normals_[i].norm();
    if (length > 0.0) normals_[i] /= length;
    data_[6 * n + i] = static_cast<float>(normals_[i].x() * sigma_px_ / sigma_rad_);
    data_[7 * n + i] = static_cast<float>(normals_[i].y() * sigma_px_ / sigma_rad_);
  }
}

Eigen::Matrix3d ConicModel::ToMatrix(const Value& value) {
  const auto [a, b, c, d, e, f] = value;
  Eigen::Matrix3d conic;
  conic << a, b, d, b, c, e, d, e, f;
  return conic;
}

ConicModel::Value ConicModel::ToValue(const Eigen::Matrix3d& conic) {
  return {conic(0, 0), conic(0, 1), conic(1, 1), conic(0, 2), conic(1, 2), conic(2, 2)};
}

Eigen::Matrix3d ConicModel::ToConic(const Value& value) const {
  const Normalization normalization{center_.x(), center_.y(), scale_};
  return TransformConic(ToMatrix(value), normalization.Matrix());
}

bool ConicModel::FromConic(const Eigen::Matrix3d& conic, Value* value) const {
  const Normalization normalization{center_.x(), center_.y(), scale_};
  *value = ToValue(TransformConic(conic, normalization.Inverse()));
  return Normalize(value);
}

bool ConicModel::Normalize(Value* value) const {
  const auto [a, b, c, d, e, f] = *value;
  const double minor = a * c - b * b;
  if (!(minor > 0.0)) return false;
  const double det = f * minor - a * e * e - c * d * d + 2.0 * b * d * e;
  const double trace = a + c;
  if (!(det * trace < 0.0)) return false;  // Imaginary.
  // Squared semi-axes are k / eigenvalue with k = -det / minor; the small one from the product.
  const double k = std::abs(det) / minor;
  const double half = 0.5 * std::abs(trace);
  const double large = half + std::sqrt(std::max(0.0, half * half - minor));
  const double min_axis = kMinAxisPx * pixel_;
  if (k < min_axis * min_axis * large) return false;
  if (k * large > kMaxAxisRatio * kMaxAxisRatio * minor) return false;
  const double norm = std::sqrt(a * a + c * c + f * f + 2.0 * (b * b + d * d + e * e));
  const double factor = (trace < 0.0 ? -1.0 : 1.0) / norm;
  for (double& v : *value) v *= factor;
  return true;
}

bool ConicModel::Fit(const int* sample, Value* value) const {
  std::array<Eigen::Vector2d, 5> x;
  for (std::size_t i = 0; i < 5; ++i) x[i] = Position(sample[i]);
  Eigen::Matrix3d conic;
  if (!ConicFromFivePoints(x, &conic)) return false;
  *value = ToValue(conic);
  return Normalize(value);
}

void ConicModel::SquaredDistances(const Value& value, int begin, int end, float* r2) const {
  Residuals<false>(value, begin, end, r2);
}

void ConicModel::SquaredResiduals(const Value& value, int begin, int end, float* r2) const {
  if (normals_.empty()) return SquaredDistances(value, begin, end, r2);
  Residuals<true>(value, begin, end, r2);
}

template <bool kOriented>
void ConicModel::Residuals(const Value& value, int begin, int end, float* r2) const {
  const std::size_t n = index_.size();
  const float* x = data_.data() + begin;
  const float a = static_cast<float>(value[0]), b = static_cast<float>(value[1]),
              c = static_cast<float>(value[2]), d = static_cast<float>(value[3]),
              e = static_cast<float>(value[4]), f = static_cast<float>(value[5]);
  const std::size_t size = static_cast<std::size_t>(end - begin);
  for (std::size_t i = 0; i < size; ++i) {
    const float px = x[i], py = x[i + n];
    const float gx = a * px + b * py + d, gy = b * px + c * py + e;
    const float value_here = px * gx + py * gy + (d * px + e * py + f);
    const float gu = x[i + 2 * n] * gx + x[i + 4 * n] * gy;
    const float gv = x[i + 3 * n] * gx + x[i + 5 * n] * gy;
    const float inverse = 1.0f / (gu * gu + gv * gv + kTiny);
    r2[i] = 0.25f * value_here * value_here * inverse;
    if (kOriented) {
      const float sine = gu * x[i + 7 * n] - gv * x[i + 6 * n];
      r2[i] += sine * sine * inverse;
    }
  }
}

// Hyper-renormalisation (Kanatani, Al-Sharadqah, Chernov, Sugaya, ECCV 2012): the closed form for
// points that weigh as the gradient per pixel of the current conic tells, so that distances in
// pixels are what it minimises.
bool ConicModel::Refine(const float* weights, Value* value) const {
  const Eigen::Matrix3d conic = ToMatrix(*value);
  const auto sum_about = [&](const Eigen::Vector2d& center, int* count) {
    Moments sums;
    *count = 0;
    for (int i = 0; i < NumData(); ++i) {
      if (!(weights[i] > 0.0f)) continue;
      const CalibratedPoint& p = Point(i);
      const Eigen::Vector2d gradient = p.GradientPerPixel((conic * p.Homogeneous()).head<2>());
      const Eigen::Vector2d x = p.x - center;
      sums.Add(x.x(), x.y(), static_cast<double>(weights[i]) / gradient.squaredNorm());
      ++*count;
    }
    return sums;
  };
  int count = 0;
  const Moments sums = sum_about(Eigen::Vector2d::Zero(), &count);
  if (count < kMinSamples) return false;
  const Eigen::Vector2d mean = Eigen::Vector2d(sums.x, sums.y) / sums.one;
  const Moments moments = sum_about(mean, &count);
  const double scale = std::sqrt(0.5 * (moments.xx + moments.yy) / moments.one);
  Eigen::Matrix3d fitted;
  if (!(scale > 0.0) || !FitEllipse(moments.Mean(scale), &fitted)) return false;
  const Normalization normalization{mean.x(), mean.y(), scale};
  Value moved = ToValue(TransformConic(fitted, normalization.Matrix()));
  if (!Normalize(&moved)) return false;
  *value = moved;
  return true;
}

bool ConicModel::Accept(const Value& value, double threshold) const {
  const ConicSectors sector_of(value);
  const float t2 = static_cast<float>(threshold * threshold);
  std::array<int, kConicSectors> counts{};
  std::array<float, kRansacBlock> r2;
  SomePoints some;
  double gain = 0.0;
  for (int begin = 0; begin < NumData(); begin += kRansacBlock) {
    const int end = std::min(begin + kRansacBlock, NumData());
    SquaredResiduals(value, begin, end, r2.data());
    for (int i = begin; i < end; ++i) {
      const float square = r2[static_cast<std::size_t>(i - begin)];
      if (!(square < t2)) continue;
      const Eigen::Vector2d& x = Position(i);
      ++counts[sector_of(x)];
      if (some.size == SomePoints::kMost) continue;
      some.Add(x);
      gain += 1.0 - static_cast<double>(square / t2);
    }
  }
  // Evenly spread inliers leave a fifth of their arc outside.
  const int too_few = static_cast<int>(std::ceil(0.8 * kMinArcDeg * kConicSectors / 360.0)) - 1;
  if (too_few > 0 && HoldMost(counts, too_few)) return false;
  return GainOfLine(some, threshold * pixel_) <= kMaxLineShare * gain;
}

double ConicModel::BandShare(const Value& value, double threshold) const {
  Ellipse ellipse;
  if (!(box_area_ > 0.0) || !ConicToEllipse(ToMatrix(value), &ellipse)) return 1.0;
  // The length of what of the ellipse lies in the box, by steps of its eccentric anomaly.
  constexpr int kSteps = 60;  // To a hundredth or two.
  const double step = 2.0 * kPi / kSteps;
  const Eigen::Matrix2d axes = Eigen::Rotation2Dd(ellipse.angle).toRotationMatrix() *
                               Eigen::Vector2d(ellipse.a, ellipse.b).asDiagonal();
  const Eigen::Matrix2d next = Eigen::Rotation2Dd(step).toRotationMatrix();
  double length = 0.0;
  Eigen::Vector2d on_circle = Eigen::Vector2d::UnitX();
  for (int i = 0; i < kSteps; ++i, on_circle = next * on_circle) {
    const Eigen::Vector2d x = ellipse.center + axes * on_circle;
    if ((x.cwiseAbs().array() > half_box_.array()).any()) continue;
    length += step * (axes * Eigen::Vector2d(-on_circle.y(), on_circle.x())).norm();
  }
  return std::min(1.0, length * 2.0 * threshold * pixel_ / box_area_);
}

double ConicModel::DirectionMiss(const Value& value, int i) const {
  if (normals_.empty()) return 0.0;
  const CalibratedPoint& p = Point(i);
  const Eigen::Vector3d polar = ToMatrix(value) * p.Homogeneous();
  const Eigen::Vector2d gradient = p.GradientPerPixel(polar.head<2>());
  const double sine = Cross(gradient, normals_[static_cast<std::size_t>(i)]);
  const double scale = sigma_rad_ * sigma_rad_ * gradient.squaredNorm();
  return scale > 0.0 ? sine * sine / scale : 0.0;
}

}  // namespace circline
