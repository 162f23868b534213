#include "circline/estimators/conic_distance.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/estimators/foot_points.h"
#include "circline/estimators/weights.h"

namespace circline {

PointDistances::PointDistances(const std::vector<CalibratedPoint>& points,
                               const std::vector<double>* weights, const Normalization& n,
                               std::vector<double>* memory)
    : data_(nullptr, 0, kEnd) {
  // Filled up to whole lanes with points of no weight.
  const std::size_t rows = (points.size() + kLanes - 1) / kLanes * kLanes;
  if (memory == nullptr) memory = &own_memory_;
  memory->resize(rows * kEnd);
  new (&data_) decltype(data_)(memory->data(), static_cast<Eigen::Index>(rows), kEnd);
  const double inverse = 1.0 / n.scale;
  const auto append = [&](const CalibratedPoint& p, double weight) {
    data_(size_, kX) = (p.x.x() - n.center_x) * inverse;
    data_(size_, kY) = (p.x.y() - n.center_y) * inverse;
    for (int k = 0; k < 4; ++k) {
      data_(size_, kJ00 + k) = p.x_from_pixel[static_cast<std::size_t>(k)] * inverse;
    }
    data_(size_++, kWeight) = weight;
  };
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (WeightAt(weights, i) != 0.0) append(points[i], WeightAt(weights, i));
  }
  while (size_ % kLanes != 0) append(points.front(), 0.0);
}

// Orthogonal distances of kLanes points to the conic, in pixels. Returns sum w r^2.
double PointDistances::FindFeet(Eigen::Index i, const Eigen::Matrix3d& conic, double level) {
  const FootPoints<kLanes> foot = FindFootPoints<kLanes>(
      {At(kX, i), At(kY, i), At(kJ00, i), At(kJ01, i), At(kJ10, i), At(kJ11, i)}, conic, level);
  const Lanes weight = At(kWeight, i);
  At(kFootX, i) = foot.x;
  At(kFootY, i) = foot.y;
  At(kScatter, i) = weight * foot.inverse_gradient * foot.inverse_gradient;
  At(kGradient, i) = weight * foot.distance * foot.inverse_gradient;
  return (weight * foot.distance * foot.distance).sum();
}

PointDistances::NormalEquations PointDistances::Linearize(const Eigen::Matrix3d& conic) {
  NormalEquations e;
  const double level = EllipseLevel(conic);
  e.cost = 0.0;
  for (Eigen::Index i = 0; i < size_; i += kLanes) e.cost += FindFeet(i, conic, level);

  Moments scatter;
  e.weight = 0.0;
  double g[6] = {};
  for (Eigen::Index i = 0; i < size_; ++i) {
    const double x = data_(i, kFootX), y = data_(i, kFootY), w = data_(i, kGradient);
    scatter.Add(x, y, data_(i, kScatter));
    g[0] += w * x * x;
    g[1] += w * y * y;
    g[2] += w;
    g[3] += w * x * y;
    g[4] += w * x;
    g[5] += w * y;
    e.weight += data_(i, kWeight);
  }
  e.information = scatter.Scatter();
  e.gradient << g[0], g[1], g[2], kSqrt2 * g[3], kSqrt2 * g[4], kSqrt2 * g[5];
  return e;
}

// Over unit conic vectors. The scale of the vector is no parameter: adding
// kappa v v^T to the normal matrix pins it without touching the rest.
bool MinimizeDistances(const Eigen::Matrix3d& initial, PointDistances* contour, Minimum* minimum) {
  Eigen::Matrix3d* const conic = &minimum->conic;
  PointDistances::NormalEquations& e = minimum->equations;
  *conic = initial;
  e = contour->Linearize(*conic);
  if (!std::isfinite(e.cost)) return false;
  double damping = 1e-4;
  constexpr int kMaxIterations = 50;
  constexpr double kMaxDamping = 1e10;
  int& iteration = minimum->iterations;
  for (iteration = 0; iteration < kMaxIterations; ++iteration) {
    const Vector6d v = ConicToVector(*conic);
    Matrix6d A = e.information + (e.information.trace() * v) * v.transpose();
    A.diagonal() += damping * e.information.diagonal();
    const Vector6d step = -A.llt().solve(e.gradient);
    if (!step.allFinite()) return false;
    // A step of 1e-5 standard deviations is the last, and not worth another pass over the points.
    const bool last =
        step.squaredNorm() < 1e-24 || -e.gradient.dot(step) <= 1e-12 * std::abs(e.cost);
    Eigen::Matrix3d candidate;
    const bool is_ellipse = NormalizeEllipse(VectorToConic(v + step), &candidate);
    if (last) {
      if (is_ellipse && damping < 1.0) *conic = candidate;
      return true;
    }
    if (is_ellipse) {
      const PointDistances::NormalEquations next = contour->Linearize(candidate);
      if (next.cost <= e.cost) {
        *conic = candidate;
        e = next;
        damping = std::max(1e-12, 0.1 * damping);
        continue;
      }
    }
    damping = std::max(1e-8, 10.0 * damping);
    if (damping > kMaxDamping) return true;
  }
  return true;
}

}  // namespace circline
