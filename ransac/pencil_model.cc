#include "circline/ransac/pencil_model.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

namespace circline {
namespace {

// Radians: far below any noise, far above rounding.
constexpr double kCoincident = 1e-9;

Status Coincide() { return Status::Refused("the lines of the pencil coincide"); }

bool Usable(const LineFit& line) {
  return line.line.allFinite() && line.covariance.allFinite() && line.line.norm() > 0.5;
}

// Chance that an unrelated line is within the threshold of the direction: for a direction uniform
// on the sphere, l . v is uniform on [-1, 1] (Archimedes), so it is T sigma. `line` has the model's
// error.
double ChanceOfInlier(const LineFit& line, const Eigen::Vector3d& direction, double threshold) {
  const double variance = std::max(0.0, direction.dot(line.covariance * direction));
  return std::min(1.0, threshold * std::sqrt(variance));
}

// Lines with the model's error in their covariances, and which of them are in play.
struct Pool {
  std::vector<LineFit> lines;
  std::vector<int> all;  // Usable ones.
  double threshold = 0.0;

  Pool(const std::vector<LineFit>& input, const PencilOptions& options)
      : all(UsableLines(input)), threshold(options.ransac.threshold) {
    lines.reserve(input.size());
    for (const LineFit& line : input) {
      lines.push_back(WithModelError(line, options.model_sigma_rad));
    }
  }

  const LineFit& operator[](int i) const { return lines[static_cast<std::size_t>(i)]; }

  // Number of unrelated lines among `indices` that are expected within the threshold.
  double Expected(const std::vector<int>& indices, const Eigen::Vector3d& direction) const {
    double sum = 0.0;
    for (const int i : indices) sum += ChanceOfInlier((*this)[i], direction, threshold);
    return sum;
  }
};

// The final estimate: reweighted maximum likelihood on the lines `candidates`, from the engine's
// direction. Each line weighs as the posterior probability that it belongs: a short segment points
// near any direction by chance, a long one does not. `members` receives the candidates within the
// threshold of the answer.
Status FitFinal(const Pool& pool, const std::vector<int>& candidates,
                const Eigen::Vector3d& initial, VanishingPointFit* fit, std::vector<int>* members) {
  const double num_all = static_cast<double>(pool.all.size());
  std::vector<LineFit> chosen;
  std::vector<double> weights;
  fit->direction = initial;
  constexpr int kPasses = 4;
  for (int pass = 0; pass <= kPasses; ++pass) {
    members->clear();
    for (const int i : candidates) {
      if (std::abs(VanishingPointResidual(pool[i], fit->direction)) <= pool.threshold) {
        members->push_back(i);
      }
    }
    if (members->size() < 2) return Status::Refused("fewer than two lines share a direction");
    if (pass == kPasses) break;
    const double share = static_cast<double>(members->size()) / num_all;
    const double chance = pool.Expected(pool.all, fit->direction) / num_all;
    const double prior = std::max(0.5 * share, share - (1.0 - share) * chance);
    chosen.clear();
    weights.clear();
    for (const int i : *members) {
      const double r = VanishingPointResidual(pool[i], fit->direction);
      const double belongs = prior * 0.3989422804014327 * std::exp(-0.5 * r * r);
      // Uniform over 2 T, together the chance of being within the threshold.
      const double stray = (1.0 - prior) * ChanceOfInlier(pool[i], fit->direction, pool.threshold) /
                           (2.0 * pool.threshold);
      chosen.push_back(pool[i]);
      weights.push_back(belongs / (belongs + stray));
    }
    const Status status = FitVanishingPoint(chosen, fit, &weights);
    if (!status.ok()) return status;
  }
  return Status::Ok();
}

// log of the number of directions with so many members expected among unrelated lines: the pairs of
// lines that propose one, times the tail of the Poisson distribution (Chernoff's bound) for all
// members but the two that proposed it.
double LogFalseAlarms(double num_lines, double expected, std::size_t num_members) {
  const double log_tests = std::log(std::max(1.0, 0.5 * num_lines * (num_lines - 1.0)));
  const double k = static_cast<double>(num_members) - 2.0;
  if (!(k > expected)) return log_tests;
  if (!(expected > 0.0)) return -std::numeric_limits<double>::max();
  return log_tests + k - expected - k * std::log(k / expected);
}

// One direction among lines[indices], or a status that says why there is none.
Status FindOne(const std::vector<LineFit>& lines, const Pool& pool, const std::vector<int>& indices,
               const PencilOptions& options, VanishingPointFit* fit, std::vector<int>* members) {
  const PencilModel model(lines, indices, options.model_sigma_rad);
  Ransac<PencilModel> engine(options.ransac);
  RansacReport<PencilModel::Value> report;
  engine.Run(model, &report);
  if (!report.success) return Coincide();
  return FitFinal(pool, indices, Eigen::Vector3d(report.model.data()), fit, members);
}

// Gives every line to the direction that it misses least, within the threshold.
void Assign(const Pool& pool, std::vector<FoundPencil>* pencils) {
  for (FoundPencil& pencil : *pencils) pencil.lines.clear();
  for (const int i : pool.all) {
    double smallest = pool.threshold;
    FoundPencil* nearest = nullptr;
    for (FoundPencil& pencil : *pencils) {
      const double r = std::abs(VanishingPointResidual(pool[i], pencil.fit.direction));
      if (r <= smallest) {
        smallest = r;
        nearest = &pencil;
      }
    }
    if (nearest != nullptr) nearest->lines.push_back(i);
  }
}

// Fits the pencil to its members; true if it stands on them, among the lines `indices`.
bool Refit(const Pool& pool, const std::vector<int>& indices, const PencilOptions& options,
           FoundPencil* pencil) {
  if (static_cast<int>(pencil->lines.size()) < options.min_lines) return false;
  std::vector<int> members;
  VanishingPointFit fit;
  const Status status = FitFinal(pool, pencil->lines, pencil->fit.direction, &fit, &members);
  if (!status.ok() || static_cast<int>(members.size()) < options.min_lines) return false;
  pencil->fit = fit;
  pencil->lines = members;
  pencil->log_false_alarms = LogFalseAlarms(static_cast<double>(indices.size()),
                                            pool.Expected(indices, fit.direction), members.size());
  return pencil->log_false_alarms <= std::log(options.max_false_alarms);
}

}  // namespace

Status PencilOptions::Validate() const {
  if (!(model_sigma_rad >= 0.0) || !std::isfinite(model_sigma_rad)) {
    return Status::Invalid("model_sigma_rad must not be negative");
  }
  if (max_pencils < 0) return Status::Invalid("max_pencils must not be negative");
  if (min_lines < 3) return Status::Invalid("min_lines must be 3 or more");
  if (!(max_false_alarms > 0.0)) return Status::Invalid("max_false_alarms must be positive");
  return ransac.Validate();
}

std::vector<int> UsableLines(const std::vector<LineFit>& lines) {
  std::vector<int> indices;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (Usable(lines[i])) indices.push_back(static_cast<int>(i));
  }
  return indices;
}

LineFit WithModelError(const LineFit& line, double model_sigma_rad) {
  LineFit result = line;
  result.covariance +=
      model_sigma_rad * model_sigma_rad *
      (Eigen::Matrix3d::Identity() - line.line * line.line.transpose() / line.line.squaredNorm());
  return result;
}

PencilModel::PencilModel(const std::vector<LineFit>& lines, const std::vector<int>& indices,
                         double model_sigma_rad)
    : model_variance_(static_cast<float>(
          std::max(model_sigma_rad * model_sigma_rad, 1e-20))) {  // Exact lines: no 0 / 0.
  const int n = static_cast<int>(indices.size());
  const std::vector<int> order = RandomOrder(n, 1);
  index_.resize(indices.size());
  lines_.resize(indices.size());
  data_.resize(9 * indices.size());
  for (std::size_t k = 0; k < indices.size(); ++k) {
    index_[k] = indices[static_cast<std::size_t>(order[k])];
    const LineFit& line = lines[static_cast<std::size_t>(index_[k])];
    lines_[k] = line.line.normalized();
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(line.covariance);
    for (int c = 0; c < 3; ++c) {
      const std::size_t row = static_cast<std::size_t>(c) * indices.size() + k;
      data_[row] = static_cast<float>(lines_[k][c]);
      for (int j = 1; j <= 2; ++j) {  // Eigenvalue 0 is the line itself.
        const double sigma = std::sqrt(std::max(0.0, eigen.eigenvalues()[j]));
        data_[row + static_cast<std::size_t>(3 * j) * indices.size()] =
            static_cast<float>(sigma * eigen.eigenvectors()(c, j));
      }
    }
  }
}

bool PencilModel::Fit(const int* sample, Value* direction) const {
  const Eigen::Vector3d cross = lines_[static_cast<std::size_t>(sample[0])].cross(
      lines_[static_cast<std::size_t>(sample[1])]);
  const double norm = cross.norm();
  if (!(norm > kCoincident)) return false;
  *direction = {cross.x() / norm, cross.y() / norm, cross.z() / norm};
  return true;
}

void PencilModel::SquaredResiduals(const Value& direction, int begin, int end, float* r2) const {
  const std::size_t n = index_.size();
  const float* l = data_.data() + begin;
  const float* p = l + 3 * n;
  const float* q = l + 6 * n;
  const float x = static_cast<float>(direction[0]), y = static_cast<float>(direction[1]),
              z = static_cast<float>(direction[2]);
  const std::size_t size = static_cast<std::size_t>(end - begin);
  for (std::size_t i = 0; i < size; ++i) {
    const float miss = l[i] * x + l[i + n] * y + l[i + 2 * n] * z;
    const float a = p[i] * x + p[i + n] * y + p[i + 2 * n] * z;
    const float b = q[i] * x + q[i + n] * y + q[i + 2 * n] * z;
    r2[i] = miss * miss / (a * a + b * b + model_variance_);
  }
}

double PencilModel::Variance(const Eigen::Vector3d& direction, int i) const {
  const std::size_t n = index_.size(), k = static_cast<std::size_t>(i);
  double p = 0.0, q = 0.0;
  for (int c = 0; c < 3; ++c) {
    const std::size_t row = static_cast<std::size_t>(c) * n + k;
    p += static_cast<double>(data_[row + 3 * n]) * direction[c];
    q += static_cast<double>(data_[row + 6 * n]) * direction[c];
  }
  return p * p + q * q + static_cast<double>(model_variance_);
}

bool PencilModel::Refine(const float* weights, Value* direction) const {
  Eigen::Vector3d v(direction->data());
  DirectionStep step(v);
  for (int i = 0; i < NumData(); ++i) {
    if (!(weights[i] > 0.0f)) continue;
    step.Add(Line(i), Variance(v, i), static_cast<double>(weights[i]));
  }
  if (!step.Move(&v)) return false;
  *direction = {v.x(), v.y(), v.z()};
  return true;
}

DirectionStep::DirectionStep(const Eigen::Vector3d& direction)
    : v_(direction), e1_(direction.unitOrthogonal()), e2_(direction.cross(e1_)) {}

void DirectionStep::Add(const Eigen::Vector3d& line, double variance, double weight) {
  const double w = weight / variance;
  const double miss = line.dot(v_), d1 = line.dot(e1_), d2 = line.dot(e2_);
  a_ += w * d1 * d1;
  b_ += w * d1 * d2;
  c_ += w * d2 * d2;
  g1_ += w * d1 * miss;
  g2_ += w * d2 * miss;
}

bool DirectionStep::Move(Eigen::Vector3d* direction) const {
  const double det = a_ * c_ - b_ * b_;
  if (!(det > 1e-12 * (a_ + c_) * (a_ + c_))) return false;
  const Eigen::Vector3d moved =
      v_ - (c_ * g1_ - b_ * g2_) / det * e1_ - (a_ * g2_ - b_ * g1_) / det * e2_;
  const double norm = moved.norm();
  if (!(norm < 10.0)) return false;  // Not a small step: the start was no good, or is not finite.
  *direction = moved / norm;
  return true;
}

Status FitVanishingPointRobust(const std::vector<LineFit>& lines, const PencilOptions& options,
                               VanishingPointFit* fit, std::vector<std::uint8_t>* mask) {
  Status status = options.Validate();
  if (!status.ok()) return status;
  const Pool pool(lines, options);
  if (pool.all.size() < 2) return Status::Refused("a vanishing point needs two lines or more");
  VanishingPointFit result;
  std::vector<int> members = pool.all;
  if (pool.all.size() == 2) {
    if (!(pool[pool.all[0]].line.cross(pool[pool.all[1]].line).norm() > kCoincident)) {
      return Coincide();
    }
    status = FitVanishingPoint({pool[pool.all[0]], pool[pool.all[1]]}, &result);
  } else {
    status = FindOne(lines, pool, pool.all, options, &result, &members);
  }
  if (!status.ok()) return status;
  *fit = result;
  if (mask != nullptr) {
    mask->assign(lines.size(), 0);
    for (const int i : members) (*mask)[static_cast<std::size_t>(i)] = 1;
  }
  return Status::Ok();
}

Status FindPencils(const std::vector<LineFit>& lines, const PencilOptions& options,
                   std::vector<FoundPencil>* pencils) {
  pencils->clear();
  const Status status = options.Validate();
  if (!status.ok()) return status;
  const Pool pool(lines, options);
  std::vector<int> left = pool.all;
  while (static_cast<int>(pencils->size()) < options.max_pencils &&
         static_cast<int>(left.size()) >= options.min_lines) {
    FoundPencil found;
    if (!FindOne(lines, pool, left, options, &found.fit, &found.lines).ok()) break;
    if (!Refit(pool, left, options, &found)) break;
    std::vector<int> rest;
    std::set_difference(left.begin(), left.end(), found.lines.begin(), found.lines.end(),
                        std::back_inserter(rest));
    left = rest;
    pencils->push_back(std::move(found));
  }
  Assign(pool, pencils);
  std::vector<FoundPencil> kept;
  for (FoundPencil& pencil : *pencils) {
    if (Refit(pool, pool.all, options, &pencil)) kept.push_back(std::move(pencil));
  }
  *pencils = std::move(kept);
  return Status::Ok();
}

}  // namespace circline
