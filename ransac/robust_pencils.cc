#include "circline/ransac/robust_pencils.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "circline/ransac/drifted_lines.h"
#include "circline/ransac/false_alarms.h"
#include "circline/ransac/pencil_model.h"
#include "circline/ransac/trimmed_direction.h"

namespace circline {
namespace {

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
  std::vector<int> all;  // Those with a finite, unit normal.
  double threshold = 0.0;

  Pool(const std::vector<LineFit>& input, const PencilOptions& options)
      : threshold(options.ransac.threshold) {
    lines.reserve(input.size());
    for (const LineFit& line : input) {
      if (line.line.allFinite() && line.covariance.allFinite() && line.line.norm() > 0.5)
        all.push_back(static_cast<int>(lines.size()));
      lines.push_back(WithDirectionError(line, options.model_sigma_rad));
    }
  }

  const LineFit& operator[](int i) const { return lines[static_cast<std::size_t>(i)]; }

  // Number of lines that drift off a pencil that are expected within the threshold.
  double ExpectedDrifted(const FoundPencil& pencil, const Eigen::Vector3d& direction) const {
    double sum = 0.0;
    for (const int i : pencil.lines)
      sum += ChanceOfInlier((*this)[i], direction, threshold) *
             DriftRatio(MiddleOf((*this)[i]), pencil.fit.direction, direction);
    return kDriftShare * sum;
  }

  // Number of unrelated lines among `indices` that are expected within the threshold.
  double Expected(const std::vector<int>& indices, const Eigen::Vector3d& direction) const {
    double sum = 0.0;
    for (const int i : indices) sum += ChanceOfInlier((*this)[i], direction, threshold);
    return sum;
  }
};

// The final estimate: reweighted maximum likelihood on the lines `candidates`, from the direction
// that `fit` has. Each line weighs as the posterior probability that it belongs: a short segment
// points near any direction by chance, a long one does not. `members` receives the candidates
// within the threshold of the answer.
Status FitFinal(const Pool& pool, const std::vector<int>& candidates, VanishingPointFit* fit,
                std::vector<int>* members) {
  const double num_all = static_cast<double>(pool.all.size());
  std::vector<LineFit> chosen;
  std::vector<double> weights;
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

// One direction among lines[indices], or a status that says why there is none.
Status FindOne(const std::vector<LineFit>& lines, const Pool& pool, const std::vector<int>& indices,
               const PencilOptions& options, VanishingPointFit* fit, std::vector<int>* members) {
  const PencilModel model(lines, indices, options.model_sigma_rad);
  Ransac<PencilModel> engine(options.ransac);
  RansacReport<PencilModel::Value> report;
  engine.Run(model, &report);
  if (!report.success) return Status::Refused("the lines of the pencil coincide");
  fit->direction = Eigen::Vector3d(report.model.data());
  return FitFinal(pool, indices, fit, members);
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

// Fits the pencil to its members; true if it stands on them, among the lines `indices` and those
// that drift off the others.
bool Refit(const Pool& pool, const std::vector<int>& indices, const PencilOptions& options,
           const std::vector<FoundPencil>& others, FoundPencil* pencil) {
  if (static_cast<int>(pencil->lines.size()) < options.min_lines) return false;
  std::vector<int> members;
  VanishingPointFit fit = pencil->fit;
  const Status status = FitFinal(pool, pencil->lines, &fit, &members);
  if (!status.ok() || static_cast<int>(members.size()) < options.min_lines) return false;
  pencil->fit = fit;
  pencil->lines = members;
  double expected = pool.Expected(indices, fit.direction);
  for (const FoundPencil& other : others) {
    if (&other != pencil) expected += pool.ExpectedDrifted(other, fit.direction);
  }
  const double log_false_alarms =
      LogFalseAlarms(indices.size(), PencilModel::kMinSamples, expected, members.size());
  return log_false_alarms <= std::log(options.max_false_alarms);
}

// From the seven tenths of the lines that agree best.
Status FitTrimmed(const Pool& pool, VanishingPointFit* fit, std::vector<int>* members) {
  std::vector<LineFit> usable;
  for (const int i : pool.all) usable.push_back(pool[i]);
  const Status status = FitTrimmedDirection(usable, usable.size() - 3 * usable.size() / 10, fit);
  return status.ok() ? FitFinal(pool, pool.all, fit, members) : status;
}

double TruncatedCost(const Pool& pool, const Eigen::Vector3d& direction) {
  double cost = 0.0;
  for (const int i : pool.all) {
    const double r = std::min(std::abs(VanishingPointResidual(pool[i], direction)), pool.threshold);
    cost += r * r;
  }
  return cost;
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

Status FitVanishingPointRobust(const std::vector<LineFit>& lines, const PencilOptions& options,
                               VanishingPointFit* fit, std::vector<std::uint8_t>* mask) {
  Status status = options.Validate();
  if (!status.ok()) return status;
  const Pool pool(lines, options);
  if (pool.all.size() < 2) return Status::Refused("a vanishing point needs two lines or more");
  VanishingPointFit result;
  std::vector<int> members = pool.all;
  if (pool.all.size() == 2) {
    status = FitVanishingPoint({pool[pool.all[0]], pool[pool.all[1]]}, &result);
  } else {
    status = FindOne(lines, pool, pool.all, options, &result, &members);
    // Two of few lines may cross too far from the truth for the search to reach it.
    constexpr std::size_t kFew = 20;
    VanishingPointFit other;
    std::vector<int> of_other;
    if (pool.all.size() <= kFew && FitTrimmed(pool, &other, &of_other).ok() &&
        (!status.ok() ||
         TruncatedCost(pool, other.direction) < TruncatedCost(pool, result.direction))) {
      status = Status::Ok();
      result = other;
      members = of_other;
    }
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
    if (!Refit(pool, left, options, *pencils, &found)) break;
    std::vector<int> rest;
    std::set_difference(left.begin(), left.end(), found.lines.begin(), found.lines.end(),
                        std::back_inserter(rest));
    left = rest;
    pencils->push_back(std::move(found));
  }
  Assign(pool, pencils);
  std::vector<FoundPencil> kept;
  for (FoundPencil& pencil : *pencils) {
    // A copy: the others are judged beside it.
    if (Refit(pool, pool.all, options, *pencils, &pencil)) kept.push_back(pencil);
  }
  *pencils = std::move(kept);
  return Status::Ok();
}

}  // namespace circline
