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

// Radians. The engine's residuals are of single precision: of lines that claim to be known better
// than that it would see the rounding, and of exact ones 0 / 0.
double ModelSigma(const PencilOptions& options) { return std::max(options.model_sigma_rad, 1e-6); }

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
      lines.push_back(WithDirectionError(input[static_cast<std::size_t>(i)], ModelSigma(options)));
    }
    weights.resize(lines.size());
    shares.fill(0.5 / K);
  }

  // Expectation step. For a direction without relation to the line, l . v is uniform on [-1, 1]
  // (Archimedes): density 1/2. No line is cut off at the threshold: the density knows how far is
  // too far for each, and to lose what is likely to belong would make the rest seem better than it
  // is.
  void Weigh() {
    constexpr double kNowhere = 8.0;  // Standard deviations; beyond it weights are below 1e-6.
    std::array<double, K> sums{};
    const double stray = 0.5 * (1.0 - std::accumulate(shares.begin(), shares.end(), 0.0));
    for (std::size_t i = 0; i < lines.size(); ++i) {
      double total = stray;
      for (std::size_t k = 0; k < K; ++k) {
        const double sigma = std::sqrt(directions[k].dot(lines[i].covariance * directions[k]));
        const double r = lines[i].line.dot(directions[k]) / sigma;
        weights[i][k] = std::abs(r) < kNowhere
                            ? shares[k] * kInverseRoot2Pi * std::exp(-0.5 * r * r) / sigma
                            : 0.0;
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
  const PencilModel pencil(lines, UsableLines(lines), ModelSigma(options));
  RansacReport<typename Model::Value> report;
  Ransac<Model>(options.ransac).Run(Model(pencil), &report);
  *value = report.model;
  return report.success;
}

constexpr int kPasses = 8;

// How each of K directions moves with P parameters.
template <std::size_t K, int P>
using Slopes = std::array<Eigen::Matrix<double, 3, P>, K>;

// v moves by delta x v.
Slopes<3, 3> SlopesOfRotation(const std::array<Vector3d, 3>& directions) {
  Slopes<3, 3> slopes;
  for (std::size_t k = 0; k < 3; ++k) {
    for (int j = 0; j < 3; ++j) slopes[k].col(j) = Vector3d::Unit(j).cross(directions[k]);
  }
  return slopes;
}

// The sums of one Gauss-Newton step of the directions.
template <int P>
struct Equations {
  using Vector = Eigen::Matrix<double, P, 1>;
  using Matrix = Eigen::Matrix<double, P, P>;
  Matrix information = Matrix::Zero();  // As if the weights were known memberships.
  Matrix missing = Matrix::Zero();      // What is lost because they are not.
  Vector gradient = Vector::Zero();

  template <std::size_t K>
  Equations(const Mixture<K>& mixture, const Slopes<K, P>& slopes) {
    for (std::size_t i = 0; i < mixture.lines.size(); ++i) {
      Vector line_gradient = Vector::Zero();
      for (std::size_t k = 0; k < K; ++k) {
        const double w = mixture.weights[i][k];
        if (w < 1e-6) continue;
        // r = l . v / sqrt(v^T S v).
        const Vector3d& v = mixture.directions[k];
        const Vector3d s_v = mixture.lines[i].covariance * v;
        const double sigma = std::sqrt(v.dot(s_v));
        const double r = mixture.lines[i].line.dot(v) / sigma;
        const Vector3d of_direction = (mixture.lines[i].line - (r / sigma) * s_v) / sigma;
        const Vector slope = slopes[k].transpose() * of_direction;
        const Matrix product = w * slope * slope.transpose();
        information += product;
        missing += r * r * product;
        line_gradient += w * r * slope;
      }
      missing -= line_gradient * line_gradient.transpose();
      gradient += line_gradient;
    }
  }
};

// False where it is not safely positive definite, each parameter in its own scale: one direction
// may be known far better than another.
template <int P>
bool Invert(const Eigen::Matrix<double, P, P>& information, Eigen::Matrix<double, P, P>* inverse) {
  const Eigen::Matrix<double, P, 1> scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::Matrix<double, P, P> scaled = scale.asDiagonal() * information * scale.asDiagonal();
  if (!scaled.allFinite()) return false;
  const Eigen::LDLT<Eigen::Matrix<double, P, P>> ldlt(scaled);
  if (!ldlt.isPositive() || !(ldlt.rcond() > 1e-12)) return false;
  *inverse = scale.asDiagonal() * scaled.inverse() * scale.asDiagonal();
  return true;
}

// Of the parameters. Observed information of a mixture: that of the complete data less what is
// missing (T. Louis, Finding the observed information matrix when using the EM algorithm, JRSS B
// 1982).
template <std::size_t K, int P>
bool MixtureCovariance(const Mixture<K>& mixture, const Slopes<K, P>& slopes,
                       Eigen::Matrix<double, P, P>* covariance) {
  const Equations<P> equations(mixture, slopes);
  const Eigen::Matrix<double, P, P> observed = equations.information - equations.missing;
  // Far from a maximum it need not be one of a covariance.
  return Invert<P>(observed, covariance) || Invert<P>(equations.information, covariance);
}

// Maximisation step. False where the lines do not fix the rotation.
bool StepRotation(Mixture<3>* mixture, Matrix3d* rotation) {
  const Equations<3> equations(*mixture, SlopesOfRotation(mixture->directions));
  Matrix3d inverse;
  if (!Invert<3>(equations.information, &inverse)) return false;
  const Vector3d delta = -inverse * equations.gradient;
  const double angle = delta.norm();
  if (!(angle < 1.0)) return false;
  if (angle > 0.0) *rotation = Eigen::AngleAxisd(angle, delta / angle) * *rotation;
  for (int k = 0; k < 3; ++k) {
    mixture->directions[static_cast<std::size_t>(k)] = rotation->col(k);
  }
  return true;
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
  if (!MixtureCovariance(mixture, SlopesOfRotation(mixture.directions), &result.covariance)) {
    return status;
  }
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

}  // namespace circline
