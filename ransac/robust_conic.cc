#include "circline/ransac/robust_conic.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "circline/ransac/oriented_conic_model.h"

namespace circline {
namespace {

Status NoEllipse() { return Status::Refused("no ellipse explains the points"); }

// An ellipse with what the points say of it.
struct Candidate {
  ConicModel::Value value{};
  ConicWeights weights;
  double log_likelihood = -std::numeric_limits<double>::infinity();
};

// Points with their directions, if there are any.
struct Contour {
  std::vector<CalibratedPoint> points;
  std::optional<EdgeDirections> directions;

  Contour Subset(const std::vector<int>& indices) const {
    Contour subset;
    if (directions) subset.directions = EdgeDirections{{}, directions->sigma_rad};
    for (const int i : indices) {
      subset.points.push_back(points[static_cast<std::size_t>(i)]);
      if (directions) {
        subset.directions->normals.push_back(directions->normals[static_cast<std::size_t>(i)]);
      }
    }
    return subset;
  }
};

// The search for one ellipse in one set of points.
class ConicSearch {
 public:
  // All outlive the search.
  ConicSearch(const std::vector<CalibratedPoint>& points, const EdgeDirections* directions,
              const RobustFitOptions& options, const ConicLimits& limits)
      : points_(points),
        directions_(directions),
        options_(options),
        limits_(limits),
        model_(points, limits, directions, options.ransac.threshold) {
    if (directions != nullptr) oriented_.emplace(model_);
  }

  const ConicModel& model() const { return model_; }

  // The likeliest ellipse of a few searches; false if there is none.
  bool Run(Candidate* best) const;
  // Reweighted steps from an ellipse.
  void Polish(Candidate* candidate) const;
  // Maximum likelihood with the candidate's weights, its covariance, and the mask of the result.
  Status Finish(const Candidate& candidate, ConicFit* fit, std::vector<std::uint8_t>* mask) const;

 private:
  using Report = RansacReport<ConicModel::Value>;

  // One run of the engine, by samples with directions where there are any.
  void Draw(const RansacOptions& options, Report* report) const {
    if (oriented_) return Ransac<OrientedConicModel>(options).Run(*oriented_, report);
    Ransac<ConicModel>(options).Run(model_, report);
  }
  bool SearchBeside(const Candidate& first, const RansacOptions& options, int num_inliers,
                    Candidate* second) const;

  const std::vector<CalibratedPoint>& points_;
  const EdgeDirections* directions_;
  const RobustFitOptions& options_;
  const ConicLimits& limits_;
  ConicModel model_;
  std::optional<OrientedConicModel> oriented_;
};

void ConicSearch::Polish(Candidate* candidate) const {
  constexpr int kMaxPasses = 10;
  // Of half the points' box: a hundredth of a pixel in a hundred.
  constexpr double kConverged = 1e-4;
  ConicWeights* weights = &candidate->weights;
  weights->sigma = 0.0;
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    model_.Weigh(candidate->value, options_.ransac.threshold, weights);
    const ConicModel::Value before = candidate->value;
    if (!model_.Refine(weights->weights.data(), &candidate->value)) break;
    double change = 0.0;
    for (std::size_t k = 0; k < before.size(); ++k) {
      change = std::max(change, std::abs(candidate->value[k] - before[k]));
    }
    if (change < kConverged) break;
  }
  model_.Weigh(candidate->value, options_.ransac.threshold, weights);
  candidate->log_likelihood = weights->LogLikelihood();
}

// The engine counts inliers, and that misleads it in two ways: on short or sparse contours it may
// end on an ellipse that takes in clutter where the contour has none, and a dense blob of clutter
// holds an ellipse with more inliers than the contour has. Both have far less likelihood than the
// contour, whose inliers lie close to it and have nothing beside them. So where less than half of
// the points are inliers, a search from another seed and, where the ellipse explains its inliers
// badly, one among the points that are not near it, are compared by likelihood.
bool ConicSearch::Run(Candidate* best) const {
  RansacOptions options = options_.ransac;
  // One sample is often not good enough: a second all-inlier sample.
  options.confidence = 1.0 - (1.0 - options.confidence) * (1.0 - options.confidence);
  Report report;
  Draw(options, &report);
  if (!report.success) return false;
  best->value = report.model;
  Polish(best);
  const int num_inliers = report.num_inliers;
  if (2 * num_inliers >= model_.NumData()) return true;
  const Candidate first = *best;
  // Log-likelihood for each inlier: about 3 in sparse clutter, 1 in a blob.
  constexpr double kBad = 1.7;
  Candidate other;
  if (first.log_likelihood < kBad * num_inliers &&
      SearchBeside(first, options, num_inliers, &other) &&
      other.log_likelihood > best->log_likelihood) {
    *best = other;
  }
  constexpr int kSeeds = 3;
  for (int k = 1; k < kSeeds; ++k) {
    options.seed = Random(options.seed).Next();
    options.max_iterations -= report.num_iterations;  // They are for all seeds.
    if (options.max_iterations <= 0) break;
    Draw(options, &report);
    if (!report.success) continue;
    other.value = report.model;
    Polish(&other);
    if (other.log_likelihood > best->log_likelihood) *best = other;
  }
  return true;
}

// Among the points that do not lie near the first ellipse.
bool ConicSearch::SearchBeside(const Candidate& first, const RansacOptions& options,
                               int num_inliers, Candidate* second) const {
  std::vector<int> far;
  for (int i = 0; i < model_.NumData(); ++i) {
    if (std::abs(first.weights.residuals[static_cast<std::size_t>(i)]) <= 3.0 * options.threshold) {
      continue;
    }
    far.push_back(model_.PointIndex(i));
  }
  if (far.size() < 5) return false;
  Contour all{points_, std::nullopt};
  if (directions_ != nullptr) all.directions = *directions_;
  const Contour rest = all.Subset(far);
  const ConicSearch search(rest.points, rest.directions ? &*rest.directions : nullptr, options_,
                           limits_);
  // What could win has half as many inliers at least; a tenth of the draws may go into that.
  RansacOptions limited = options;
  limited.max_iterations = std::min(
      std::max(1, options.max_iterations / 10),
      RequiredIterations(static_cast<int>(far.size()), num_inliers / 2, 5, options.confidence));
  Report report;
  search.Draw(limited, &report);
  if (!report.success || !model_.FromConic(search.model().ToConic(report.model), &second->value)) {
    return false;
  }
  Polish(second);
  return true;
}

Status ConicSearch::Finish(const Candidate& candidate, ConicFit* fit,
                           std::vector<std::uint8_t>* mask) const {
  std::vector<CalibratedPoint> chosen;
  std::vector<double> weights;
  chosen.reserve(points_.size());
  weights.reserve(points_.size());
  for (int i = 0; i < model_.NumData(); ++i) {
    const double w = static_cast<double>(candidate.weights.weights[static_cast<std::size_t>(i)]);
    if (w < 1e-3) continue;
    chosen.push_back(points_[static_cast<std::size_t>(model_.PointIndex(i))]);
    weights.push_back(w);
  }
  if (chosen.size() < 5) return NoEllipse();
  const Status status =
      RefineConic(chosen, options_.sigma_px, model_.ToConic(candidate.value), fit, &weights);
  if (!status.ok()) return status;
  ConicModel::Value value;
  const double threshold = options_.ransac.threshold;
  if (!model_.FromConic(fit->conic, &value) || !model_.Accept(value, threshold)) {
    return NoEllipse();
  }
  mask->assign(points_.size(), 0);
  for (int i = 0; i < model_.NumData(); ++i) {
    const std::size_t point = static_cast<std::size_t>(model_.PointIndex(i));
    const bool near = std::abs(ConicDistancePx(points_[point], fit->conic)) <= threshold;
    (*mask)[point] = near && model_.DirectionFits(value, i) ? 1 : 0;
  }
  return Status::Ok();
}

Status Check(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
             const ConicLimits& limits, const EdgeDirections* directions) {
  Status status = options.Validate();
  if (status.ok()) status = limits.Validate();
  if (status.ok() && directions != nullptr) status = directions->Validate(points.size());
  return status;
}

}  // namespace

Status FitConicRobust(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
                      ConicFit* fit, std::vector<std::uint8_t>* mask, const ConicLimits& limits,
                      const EdgeDirections* directions) {
  Status status = Check(points, options, limits, directions);
  if (!status.ok()) return status;
  if (points.size() < 5) return Status::Refused("an ellipse needs five points");
  const ConicSearch search(points, directions, options, limits);
  Candidate best;
  if (!search.Run(&best)) return NoEllipse();
  ConicFit result;
  std::vector<std::uint8_t> result_mask;
  status = search.Finish(best, &result, &result_mask);
  if (!status.ok()) return status;
  *fit = result;
  if (mask != nullptr) *mask = std::move(result_mask);
  return Status::Ok();
}

}  // namespace circline
