#include "circline/estimators/conic_distance.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "circline/estimators/cholesky6.h"
#include "circline/estimators/weights.h"

namespace circline {
namespace {

constexpr double kSqrt2 = 1.4142135623730951;

}  // namespace

Contour::Contour(const std::vector<CalibratedPoint>& points, const std::vector<double>* weights,
                 const Normalization& n) {
  // Filled up to whole lanes with points of no weight.
  data_.resize(static_cast<Eigen::Index>((points.size() + kLanes - 1) / kLanes * kLanes), kEnd);
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

// Orthogonal distances of kLanes points to the conic, in pixels. In the pixel frame about its
// point, x(u) = x + J u, the conic is f0 + g.u + u^T H u = 0. Its point nearest to u = 0 is u =
// -mu/2 (I + mu H)^-1 g for the one mu in (-1/h_max, inf), h_max the larger eigenvalue of H, at
// which S(mu) = f(u) + level equals `level`, minus the value of the conic at its centre. As for
// trust regions (More and Sorensen 1983), 1/sqrt(S) is concave and nearly linear, so Newton's steps
// on it approach mu from the left after the first, and two or three suffice; the very first is
// Sampson's approximation where the point is close. Returns sum w r^2.
double Contour::FindFootPoints(Eigen::Index i, const Eigen::Matrix3d& C, double level) {
  const Lanes x = At(kX, i), y = At(kY, i), j00 = At(kJ00, i), j01 = At(kJ01, i), j10 = At(kJ10, i),
              j11 = At(kJ11, i), weight = At(kWeight, i);
  const double a = C(0, 0), b = C(0, 1), c = C(1, 1);
  const Lanes polar_x = a * x + b * y + C(0, 2), polar_y = b * x + c * y + C(1, 2);
  const Lanes f0 = x * polar_x + y * polar_y + (C(0, 2) * x + C(1, 2) * y + C(2, 2));
  const Lanes g0 = 2.0 * (j00 * polar_x + j10 * polar_y),
              g1 = 2.0 * (j01 * polar_x + j11 * polar_y);
  const Lanes h00 = a * j00 * j00 + 2.0 * b * j00 * j10 + c * j10 * j10,
              h11 = a * j01 * j01 + 2.0 * b * j01 * j11 + c * j11 * j11,
              h01 = a * j00 * j01 + b * (j00 * j11 + j01 * j10) + c * j10 * j11;
  const Lanes trace = h00 + h11, determinant = h00 * h11 - h01 * h01;
  const Lanes half = 0.5 * (h00 - h11);
  const Lanes mu_min = -1.0 / (0.5 * trace + (half * half + h01 * h01).sqrt());
  const Lanes k0 = h11 * g0 - h01 * g1, k1 = h00 * g1 - h01 * g0;  // adj(H) g.

  Lanes mu = Lanes::Zero(), w0 = g0, w1 = g1;  // w = (I + mu H)^-1 g = grad f(u).
  Lanes f = f0, inverse = Lanes::Ones();
  constexpr int kMaxSteps = 50;
  constexpr double kTolerance = 1e-12, kTiny = 1e-300;
  bool converged = false;
  for (int step = 0; step < kMaxSteps && !converged; ++step) {
    const Lanes quadratic = h11 * w0 * w0 - 2.0 * h01 * w0 * w1 + h00 * w1 * w1;
    const Lanes slope = (0.5 * (w0 * w0 + w1 * w1 + mu * quadratic) * inverse).max(kTiny);
    const Lanes ratio = (1.0 + f / level).max(0.0), root = ratio.sqrt();
    mu = (mu + 2.0 * ratio * f / ((1.0 + root) * slope)).max(0.5 * (mu + mu_min));
    inverse = 1.0 / (1.0 + mu * (trace + mu * determinant));
    w0 = (g0 + mu * k0) * inverse;
    w1 = (g1 + mu * k1) * inverse;
    f = f0 - 0.25 * mu * ((g0 + w0) * w0 + (g1 + w1) * w1);
    converged = (f.abs() <= kTolerance * level).all();
  }

  const Lanes norm = (w0 * w0 + w1 * w1).sqrt();
  Lanes r = 0.5 * mu * norm, inverse_norm = norm.inverse();
  if (!converged) {
    // The centre, or on the major axis near it: mu = mu_min, and there are two nearest points,
    // which u misses by an eigenvector of H. No derivative speaks for either.
    const auto between = (f < -kTolerance * level).eval();
    r = between.select(-(r * r + f * mu_min).sqrt(), r);
    inverse_norm = between.select(0.0, inverse_norm);
  }
  At(kFootX, i) = x - 0.5 * mu * (j00 * w0 + j01 * w1);
  At(kFootY, i) = y - 0.5 * mu * (j10 * w0 + j11 * w1);
  // j = inverse_norm * (monomials at the foot point), exactly, as r is stationary in the latter.
  At(kScatter, i) = weight * inverse_norm * inverse_norm;
  At(kGradient, i) = weight * r * inverse_norm;
  return (weight * r * r).sum();
}

Contour::NormalEquations Contour::Linearize(const Eigen::Matrix3d& conic) {
  NormalEquations e;
  const double level = -conic.determinant() / conic.topLeftCorner<2, 2>().determinant();
  e.cost = 0.0;
  for (Eigen::Index i = 0; i < size_; i += kLanes) e.cost += FindFootPoints(i, conic, level);

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
bool MinimizeDistances(const Eigen::Matrix3d& initial, Contour* contour, Minimum* minimum) {
  Eigen::Matrix3d* const conic = &minimum->conic;
  Contour::NormalEquations& e = minimum->equations;
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
    Matrix6d L;
    Vector6d d;
    Cholesky(A, 1e-16, &L, &d);
    Vector6d step = -e.gradient;
    SolveLower(L, d, &step);
    SolveUpper(L, d, &step);
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
      const Contour::NormalEquations next = contour->Linearize(candidate);
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
