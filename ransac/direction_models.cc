#include "circline/ransac/direction_models.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "circline/ransac/ransac.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Radians: far below any noise, far above rounding.
constexpr double kCoincident = 1e-9;

// Direction k of a value that lists them one after the other.
template <typename Value>
PencilModel::Value Direction(const Value& value, std::size_t k) {
  return {value[3 * k], value[3 * k + 1], value[3 * k + 2]};
}

// Squared residuals to the direction that each line misses least, and (optional) which that is.
template <typename Value>
void NearestResiduals(const PencilModel& lines, const Value& value, int begin, int end, float* r2,
                      std::array<int, kRansacBlock>* nearest = nullptr) {
  constexpr std::size_t kDirections = std::tuple_size<Value>::value / 3;
  lines.SquaredResiduals(Direction(value, 0), begin, end, r2);
  if (nearest != nullptr) nearest->fill(0);
  std::array<float, kRansacBlock> other;
  for (std::size_t k = 1; k < kDirections; ++k) {
    lines.SquaredResiduals(Direction(value, k), begin, end, other.data());
    for (std::size_t i = 0; i < static_cast<std::size_t>(end - begin); ++i) {
      if (nearest != nullptr && other[i] < r2[i]) (*nearest)[i] = static_cast<int>(k);
      r2[i] = std::min(r2[i], other[i]);
    }
  }
}

// Calls visit(line, direction) for all lines, with the direction that each misses least.
template <typename Value, typename Visit>
void ForEachNearest(const PencilModel& lines, const Value& value, const Visit& visit) {
  std::array<float, kRansacBlock> r2;
  std::array<int, kRansacBlock> nearest;
  for (int begin = 0; begin < lines.NumData(); begin += kRansacBlock) {
    const int end = std::min(begin + kRansacBlock, lines.NumData());
    NearestResiduals(lines, value, begin, end, r2.data(), &nearest);
    for (int i = begin; i < end; ++i) {
      const std::size_t k = static_cast<std::size_t>(i - begin);
      visit(i, nearest[k], r2[k]);
    }
  }
}

// Lines within the threshold of each direction, the most first.
template <typename Value>
auto SortedSupport(const PencilModel& lines, const Value& value, double threshold) {
  std::array<int, std::tuple_size<Value>::value / 3> support{};
  const float t2 = static_cast<float>(threshold * threshold);
  ForEachNearest(lines, value, [&](int /*line*/, int direction, float r2) {
    support[static_cast<std::size_t>(direction)] += r2 < t2 ? 1 : 0;
  });
  std::sort(support.rbegin(), support.rend());
  return support;
}

}  // namespace

bool OrthogonalTripletModel::Fit(const int* sample, Value* rotation) const {
  const Vector3d first = lines_.Line(sample[0]).cross(lines_.Line(sample[1]));
  const double norm = first.norm();
  if (!(norm > kCoincident)) return false;
  Matrix3d R;
  R.col(0) = first / norm;
  const Vector3d second = R.col(0).cross(lines_.Line(sample[2]));
  const double second_norm = second.norm();
  // The third line's plane is orthogonal to the first direction: any second one will do.
  if (!(second_norm > kCoincident)) return false;
  R.col(1) = second / second_norm;
  R.col(2) = R.col(0).cross(R.col(1));
  Eigen::Map<Matrix3d>(rotation->data()) = R;
  return true;
}

void OrthogonalTripletModel::SquaredResiduals(const Value& rotation, int begin, int end,
                                              float* r2) const {
  NearestResiduals(lines_, rotation, begin, end, r2);
}

bool OrthogonalTripletModel::Refine(const float* weights, Value* rotation) const {
  // R = exp([delta]x) R: l . v moves by delta . (v x l).
  Eigen::Map<Matrix3d> R(rotation->data());
  Matrix3d information = Matrix3d::Zero();
  Vector3d gradient = Vector3d::Zero();
  ForEachNearest(lines_, *rotation, [&](int i, int k, float /*r2*/) {
    if (!(weights[i] > 0.0f)) return;
    const Vector3d v = R.col(k);
    const double w = static_cast<double>(weights[i]) / lines_.Variance(v, i);
    const Vector3d slope = v.cross(lines_.Line(i));
    information += w * slope * slope.transpose();
    gradient += w * lines_.Line(i).dot(v) * slope;
  });
  const double mean = information.trace() / 3.0;
  if (!(information.determinant() > 1e-9 * mean * mean * mean)) return false;
  const Vector3d delta = -information.inverse() * gradient;
  const double angle = delta.norm();
  if (!(angle < 1.0)) return false;
  if (angle > 0.0) R = Eigen::AngleAxisd(angle, delta / angle) * Matrix3d(R);
  return true;
}

bool OrthogonalTripletModel::Accept(const Value& rotation, double threshold) const {
  return SortedSupport(lines_, rotation, threshold)[1] >= 2;
}

}  // namespace circline
