#include "circline/estimators/vanishing_point.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "circline/estimators/directions.h"
#include "circline/estimators/weights.h"

namespace circline {
namespace {

double Cost(const std::vector<LineFit>& lines, const std::vector<double>* weights,
            const Eigen::Vector3d& v) {
  double cost = 0.0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double r = VanishingPointResidual(lines[i], v);
    cost += WeightAt(weights, i) * r * r;
  }
  return cost;
}

struct Descent {
  VanishingPointFit fit;
  double cost;
};

// The minimum that a direction leads to by damped Gauss-Newton steps in its tangent plane. False
// where the lines fix no direction.
bool Descend(const std::vector<LineFit>& lines, const std::vector<double>* weights,
             const Eigen::Vector3d& start, int max_iterations, Descent* found) {
  Eigen::Vector3d v = start;
  double cost = Cost(lines, weights, v);
  Eigen::Matrix2d information;
  Eigen::Matrix<double, 3, 2> basis;
  double damping = 0.0;
  for (int iteration = 0;; ++iteration) {
    basis = BasisAcross(v);
    information.setZero();
    Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const Eigen::Vector3d s_v = lines[i].covariance * v;
      const double sigma = std::sqrt(v.dot(s_v));
      const double r = lines[i].line.dot(v) / sigma;
      const Eigen::Vector2d j = basis.transpose() * (lines[i].line - (r / sigma) * s_v) / sigma;
      information += WeightAt(weights, i) * j * j.transpose();
      gradient += WeightAt(weights, i) * r * j;
    }
    if (iteration == max_iterations) break;
    Eigen::Matrix2d damped = information;
    damped.diagonal() *= 1.0 + damping;
    const Eigen::Vector2d step = -(damped.inverse() * gradient);
    if (!step.allFinite()) return false;
    if (step.norm() < 1e-14) break;
    const Eigen::Vector3d candidate = (v + basis * step).normalized();
    const double next = Cost(lines, weights, candidate);
    if (next <= cost) {
      const bool converged = cost - next <= 1e-13 * cost;
      v = candidate;
      cost = next;
      damping *= 0.1;
      if (converged) iteration = max_iterations - 1;  // One more linearisation, for the covariance.
    } else {
      damping = std::max(1e-3, 10.0 * damping);
    }
  }
  *found = {{v, basis * information.inverse() * basis.transpose()}, cost};
  return found->fit.covariance.allFinite();
}

}  // namespace

double VanishingPointResidual(const LineFit& line, const Eigen::Vector3d& direction) {
  return line.line.dot(direction) / std::sqrt(direction.dot(line.covariance * direction));
}

double DirectionSeparation(const VanishingPointFit& a, const VanishingPointFit& b) {
  const double sense = a.direction.dot(b.direction) < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector3d difference = a.direction - sense * b.direction;
  // Rounding bounds what can be told apart where nothing else does.
  constexpr double kRounding = 1e-18;
  Eigen::Matrix3d covariance = a.covariance + b.covariance;
  covariance.diagonal().array() += kRounding;
  return std::sqrt(difference.dot(covariance.inverse() * difference));
}

Status FitVanishingPoint(const std::vector<LineFit>& lines, VanishingPointFit* fit,
                         const std::vector<double>* weights, VanishingPointFit* second) {
  if (lines.size() < 2) return Status::Refused("a pencil needs two lines");
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < lines.size(); ++i) {
    scatter += WeightAt(weights, i) / lines[i].covariance.trace() * lines[i].line *
               lines[i].line.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scatter);
  constexpr double kMinRatio = 1e-15;  // Of squared sines; eigenvalues round at 1e-16.
  if (!(eigen.eigenvalues()[1] > kMinRatio * eigen.eigenvalues()[2])) {
    return Status::Refused("the lines of the pencil coincide");
  }
  constexpr int kMaxIterations = 20;
  Descent best;
  if (!Descend(lines, weights, eigen.eigenvectors().col(0), kMaxIterations, &best))
    return Status::Refused("the lines of the pencil coincide");
  // Short segments near one line of the photo leave the direction open along that line.
  constexpr double kOpen = 30.0;  // Of twice the negative log likelihood.
  Descent other;
  const Eigen::Vector3d across = eigen.eigenvectors().col(1);
  if (Cost(lines, weights, across) < best.cost + kOpen &&
      Descend(lines, weights, across, kMaxIterations, &other)) {
    if (other.cost < best.cost) std::swap(best, other);
    const Eigen::Vector3d far = best.fit.direction.cross(eigen.eigenvectors().col(2)).normalized();
    if (second != nullptr && Descend(lines, weights, far, 0, &other)) *second = other.fit;
  }
  *fit = best.fit;
  return Status::Ok();
}

}  // namespace circline
