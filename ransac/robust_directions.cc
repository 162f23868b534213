#include "circline/ransac/robust_directions.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "circline/ransac/direction_models.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kInverseRoot2Pi = 0.3989422804014327;

// Usable lines, and for each and each of K directions the posterior probability that it belongs.
template <std::size_t K>
struct Mixture {
  std::vector<int> indices;    // Of the lines, in the caller's list.
  std::vector<LineFit> lines;  // With the model's error.
  double threshold = 0.0;
  std::array<Vector3d, K> directions;
  std::array<double, K> shares;                // Prior probabilities of the directions.
  std::vector<std::array<double, K>> weights;  // Posterior ones.

  Mixture(const std::vector<LineFit>& input, const PencilOptions& options)
      : indices(UsableLines(input)), threshold(options.ransac.threshold) {
    for (const int i : indices) {
      lines.push_back(WithModelError(input[static_cast<std::size_t>(i)], options.model_sigma_rad));
    }
    weights.resize(lines.size());
    shares.fill(0.5 / K);
  }

  // Expectation step. For a direction without relation to the line, l . v is uniform on [-1, 1]
  // (Archimedes): density 1/2.
  void Weigh() {
    std::array<double, K> sums{};
    const double stray = 0.5 * (1.0 - std::accumulate(shares.begin(), shares.end(), 0.0));
    for (std::size_t i = 0; i < lines.size(); ++i) {
      double total = stray;
      for (std::size_t k = 0; k < K; ++k) {
        const double sigma = std::sqrt(directions[k].dot(lines[i].covariance * directions[k]));
        const double r = lines[i].line.dot(directions[k]) / sigma;
        const bool near = std::abs(r) <= threshold;
        weights[i][k] = near ? shares[k] * kInverseRoot2Pi * std::exp(-0.5 * r * r) / sigma : 0.0;
        total += weights[i][k];
      }
      for (std::size_t k = 0; k < K; ++k) {
        weights[i][k] /= total;
        sums[k] += weights[i][k];
      }
    }
    for (std::size_t k = 0; k < K; ++k) {
      // Never all or nothing.
      shares[k] = std::clamp(sums[k] / static_cast<double>(lines.size()), 1e-3, 0.99 / K);
    }
  }

  // For each line of the caller the direction that it misses least, within the threshold, or -1.
  std::vector<int> Membership(std::size_t num_input) const {
    std::vector<int> membership(num_input, -1);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      double smallest = threshold;
      for (std::size_t k = 0; k < K; ++k) {
        const double r = std::abs(VanishingPointResidual(lines[i], directions[k]));
        if (r > smallest) continue;
        smallest = r;
        membership[static_cast<std::size_t>(indices[i])] = static_cast<int>(k);
      }
    }
    return membership;
  }
};

// The directions in order of their number of lines.
template <std::size_t K>
std::array<std::size_t, K> BySupport(const std::vector<int>& membership,
                                     std::array<int, K>* support) {
  support->fill(0);
  for (const int k : membership) {
    if (k >= 0) ++(*support)[static_cast<std::size_t>(k)];
  }
  std::array<std::size_t, K> order;
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return (*support)[a] > (*support)[b]; });
  return order;
}

// One run of the engine over all usable lines.
template <typename Model>
bool Draw(const std::vector<LineFit>& lines, const PencilOptions& options,
          typename Model::Value* value) {
  const PencilModel pencil(lines, UsableLines(lines), options.model_sigma_rad);
  RansacReport<typename Model::Value> report;
  Ransac<Model>(options.ransac).Run(Model(pencil), &report);
  *value = report.model;
  return report.success;
}

constexpr int kPasses = 8;

// The sums of one Gauss-Newton step of the rotation.
struct RotationEquations {
  Matrix3d information = Matrix3d::Zero();  // As if the weights were known memberships.
  Matrix3d missing = Matrix3d::Zero();      // What is lost because they are not.
  Vector3d gradient = Vector3d::Zero();

  RotationEquations(const Mixture<3>& mixture, const Matrix3d& rotation) {
    for (std::size_t i = 0; i < mixture.lines.size(); ++i) {
      Vector3d line_gradient = Vector3d::Zero();
      for (std::size_t k = 0; k < 3; ++k) {
        const double w = mixture.weights[i][k];
        if (w < 1e-6) continue;
        // r = l . v / sqrt(v^T S v), and v moves by delta x v.
        const Vector3d v = rotation.col(static_cast<int>(k));
        const Vector3d s_v = mixture.lines[i].covariance * v;
        const double sigma = std::sqrt(v.dot(s_v));
        const double r = mixture.lines[i].line.dot(v) / sigma;
        const Vector3d slope = v.cross(mixture.lines[i].line - (r / sigma) * s_v) / sigma;
        information += w * slope * slope.transpose();
        missing += w * r * r * slope * slope.transpose();
        line_gradient += w * r * slope;
      }
      missing -= line_gradient * line_gradient.transpose();
      gradient += line_gradient;
    }
  }
};

bool Invert(const Matrix3d& information, Matrix3d* inverse) {
  const double mean = information.trace() / 3.0;
  if (!(information.determinant() > 1e-12 * mean * mean * mean)) return false;
  *inverse = information.inverse();
  return true;
}

// Maximisation step. False where the lines do not fix the rotation.
bool StepRotation(Mixture<3>* mixture, Matrix3d* rotation) {
  const RotationEquations equations(*mixture, *rotation);
  Matrix3d inverse;
  if (!Invert(equations.information, &inverse)) return false;
  const Vector3d delta = -inverse * equations.gradient;
  const double angle = delta.norm();
  if (!(angle < 1.0)) return false;
  if (angle > 0.0) *rotation = Eigen::AngleAxisd(angle, delta / angle) * *rotation;
  for (int k = 0; k < 3; ++k) {
    mixture->directions[static_cast<std::size_t>(k)] = rotation->col(k);
  }
  return true;
}

// Observed information of a mixture: that of the complete data less what is missing (T. Louis,
// Finding the observed information matrix when using the EM algorithm, JRSS B 1982).
bool RotationCovariance(const Mixture<3>& mixture, const Matrix3d& rotation, Matrix3d* covariance) {
  const RotationEquations equations(mixture, rotation);
  const Matrix3d observed = equations.information - equations.missing;
  // Far from a maximum it need not be one of a covariance.
  const bool definite = observed.ldlt().isPositive();
  return (definite && Invert(observed, covariance)) || Invert(equations.information, covariance);
}

}  // namespace

Status FitOrthogonalTriplet(const std::vector<LineFit>& lines, const PencilOptions& options,
                            OrthogonalTripletFit* fit, std::vector<int>* membership) {
  Status status = options.Validate();
  if (!status.ok()) return status;
  status = Status::Refused("no two orthogonal directions have two lines each");
  OrthogonalTripletModel::Value value;
  if (!Draw<OrthogonalTripletModel>(lines, options, &value)) return status;
  OrthogonalTripletFit result;
  result.rotation = Eigen::Map<const Matrix3d>(value.data());
  Mixture<3> mixture(lines, options);
  for (int k = 0; k < 3; ++k) {
    mixture.directions[static_cast<std::size_t>(k)] = result.rotation.col(k);
  }
  for (int pass = 0; pass < kPasses; ++pass) {
    mixture.Weigh();
    if (!StepRotation(&mixture, &result.rotation)) return status;
  }
  mixture.Weigh();
  if (!RotationCovariance(mixture, result.rotation, &result.covariance)) return status;
  std::array<int, 3> support;
  std::vector<int> members = mixture.Membership(lines.size());
  const std::array<std::size_t, 3> order = BySupport<3>(members, &support);
  if (support[order[1]] < 2) return status;
  Matrix3d sorted;
  std::array<int, 3> rank;
  for (int k = 0; k < 3; ++k) {
    const std::size_t from = order[static_cast<std::size_t>(k)];
    sorted.col(k) = mixture.directions[from];
    rank[from] = k;
  }
  if (sorted.determinant() < 0.0) sorted.col(2) *= -1.0;
  result.rotation = sorted;
  for (int& k : members) k = k < 0 ? -1 : rank[static_cast<std::size_t>(k)];
  *fit = result;
  if (membership != nullptr) *membership = std::move(members);
  return Status::Ok();
}

Status FitDirectionPair(const std::vector<LineFit>& lines, const PencilOptions& options,
                        std::array<VanishingPointFit, 2>* fits, std::vector<int>* membership) {
  Status status = options.Validate();
  if (!status.ok()) return status;
  const Status too_few = Status::Refused("no two directions have three lines each");
  DirectionPairModel::Value value;
  if (!Draw<DirectionPairModel>(lines, options, &value)) return too_few;
  Mixture<2> mixture(lines, options);
  std::array<VanishingPointFit, 2> result;
  for (std::size_t k = 0; k < 2; ++k) mixture.directions[k] = Vector3d(value.data() + 3 * k);
  std::vector<double> weights(mixture.lines.size());
  for (int pass = 0; pass < kPasses; ++pass) {
    mixture.Weigh();
    for (std::size_t k = 0; k < 2; ++k) {
      for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = mixture.weights[i][k];
      status = FitVanishingPoint(mixture.lines, &result[k], &weights);
      if (!status.ok()) return status;
      mixture.directions[k] = result[k].direction;
    }
  }
  std::array<int, 2> support;
  std::vector<int> members = mixture.Membership(lines.size());
  const std::array<std::size_t, 2> order = BySupport<2>(members, &support);
  if (support[order[1]] < 3) return too_few;
  if (order[0] == 1) {
    std::swap(result[0], result[1]);
    for (int& k : members) k = k < 0 ? -1 : 1 - k;
  }
  *fits = result;
  if (membership != nullptr) *membership = std::move(members);
  return Status::Ok();
}

}  // namespace circline
