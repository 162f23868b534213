#include "circline/ransac/robust_conic.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "circline/ransac/conic_weights.h"
#include "circline/ransac/crowds.h"
#include "circline/ransac/inlier_weights.h"
#include "circline/ransac/oriented_conic_model.h"

namespace circline {
namespace {

Status NoEllipse() { return Status::Refused("no ellipse explains the points"); }

// An ellipse with what the points say of it.
struct Candidate {
  ConicModel::Value value{};
  ConicWeights weights;
  double log_likelihood = 0.0;
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

  // What a few searches found, the likeliest first.
  std::vector<Candidate> Run() const;
  // The ellipse after reweighted steps.
  Candidate Polished(const ConicModel::Value& value) const;
  // Maximum likelihood with the candidate's weights, its covariance, and the mask of the result.
  Status Finish(const Candidate& candidate, ConicFit* fit, std::vector<std::uint8_t>* mask) const;

 private:
  using Report = RansacReport<ConicModel::Value>;

  // One run of the engine, by samples with directions where there are any.
  void Draw(const RansacOptions& options, Report* report) const {
    if (oriented_) return Ransac<OrientedConicModel>(options).Run(*oriented_, report);
    Ransac<ConicModel>(options).Run(model_, report);
  }
  std::vector<int> FarFrom(const Candidate& candidate) const;
  std::vector<int> Uncrowded() const;
  void SearchAmong(const std::vector<int>& indices, const RansacOptions& options, int num_inliers,
                   std::vector<Candidate>* candidates) const;

  const std::vector<CalibratedPoint>& points_;
  const EdgeDirections* directions_;
  const RobustFitOptions& options_;
  const ConicLimits& limits_;
  ConicModel model_;
  std::optional<OrientedConicModel> oriented_;
};

Candidate ConicSearch::Polished(const ConicModel::Value& value) const {
  constexpr int kMaxPasses = 30;
  // Of half the points' box: a hundredth of a pixel in a hundred.
  constexpr double kConverged = 1e-4;
  Candidate result;
  result.value = value;
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    WeighConic(model_, result.value, options_.ransac.threshold, &result.weights);
    const ConicModel::Value before = result.value;
    if (!model_.Refine(result.weights.weights.data(), &result.value)) break;
    double change = 0.0;
    for (std::size_t k = 0; k < before.size(); ++k) {
      change = std::max(change, std::abs(result.value[k] - before[k]));
    }
    if (change < kConverged) break;
  }
  WeighConic(model_, result.value, options_.ransac.threshold, &result.weights);
  result.log_likelihood = result.weights.LogLikelihood();
  return result;
}

// The engine counts inliers, and that misleads it in two ways: on short or sparse contours it may
// end on an ellipse that takes in clutter where the contour has none, and a dense blob of clutter
// holds an ellipse with more inliers than the contour has. Both have far less likelihood than the
// contour, whose inliers lie close to it and have nothing beside them. So where less than half of
// the points are inliers, searches from other seeds and, where the ellipse explains its inliers
// badly, among the points that are not near it and among those that do not crowd, are compared by
// likelihood.
std::vector<Candidate> ConicSearch::Run() const {
  RansacOptions options = options_.ransac;
  // One sample is often not good enough: a second all-inlier sample.
  options.confidence = 1.0 - (1.0 - options.confidence) * (1.0 - options.confidence);
  std::vector<Candidate> candidates;
  Report report;
  Draw(options, &report);
  if (!report.success) return candidates;
  candidates.push_back(Polished(report.model));
  // Log-likelihood for each inlier: 4 in sparse clutter, 3 among twice as many, 1 to 2.5 in a blob.
  constexpr double kGood = 3.0;
  const bool good = candidates[0].log_likelihood >= kGood * report.num_inliers &&
                    model_.Accept(candidates[0].value, options.threshold);
  if (good && 2 * report.num_inliers >= model_.NumData()) return candidates;
  if (!good) SearchAmong(Uncrowded(), options, report.num_inliers, &candidates);
  constexpr double kBad = 2.0;
  if (candidates[0].log_likelihood < kBad * report.num_inliers) {
    SearchAmong(FarFrom(candidates[0]), options, report.num_inliers, &candidates);
  }
  constexpr int kSeeds = 3;
  for (int k = 1; k < kSeeds; ++k) {
    options.seed = Random(options.seed).Next();
    options.max_iterations -= report.num_iterations;  // They are for all seeds.
    if (options.max_iterations <= 0) break;
    Draw(options, &report);
    if (report.success) candidates.push_back(Polished(report.model));
  }
  std::stable_sort(
      candidates.begin(), candidates.end(),
      [](const Candidate& a, const Candidate& b) { return a.log_likelihood > b.log_likelihood; });
  return candidates;
}

// Points that do not lie near the candidate.
std::vector<int> ConicSearch::FarFrom(const Candidate& candidate) const {
  std::vector<int> indices;
  for (int i = 0; i < model_.NumData(); ++i) {
    const double distance = std::abs(candidate.weights.residuals[static_cast<std::size_t>(i)]);
    if (distance > 3.0 * options_.ransac.threshold) indices.push_back(model_.PointIndex(i));
  }
  return indices;
}

std::vector<int> ConicSearch::Uncrowded() const {
  constexpr int kSome = 300;  // Points, in random order, that stand for all.
  std::vector<int> indices = circline::Uncrowded(model_.NumData(), kSome, [this](int i, int j) {
    return model_.PixelsBetween(i, j) < kCrowdThresholds * options_.ransac.threshold;
  });
  for (int& i : indices) i = model_.PointIndex(i);
  return indices;
}

// Adds the best ellipse among some of the points, if these are not nearly all.
void ConicSearch::SearchAmong(const std::vector<int>& indices, const RansacOptions& options,
                              int num_inliers, std::vector<Candidate>* candidates) const {
  const int num_points = static_cast<int>(indices.size());
  if (10 * num_points > 9 * model_.NumData()) return;
  Contour all{points_, std::nullopt};
  if (directions_ != nullptr) all.directions = *directions_;
  const Contour rest = all.Subset(indices);
  const ConicSearch search(rest.points, rest.directions ? &*rest.directions : nullptr, options_,
                           limits_);
  // What could win has more than half as many inliers; a tenth of the draws may go into that.
  constexpr int kFewest = 500;
  const int needed = RequiredIterations(num_points, std::min(num_points, num_inliers * 3 / 5),
                                        ConicModel::kMinSamples, options.confidence);
  RansacOptions limited = options;
  limited.min_iterations = kFewest;
  limited.max_iterations =
      std::clamp(needed, kFewest, std::max(kFewest, options.max_iterations / 10));
  Report report;
  search.Draw(limited, &report);
  ConicModel::Value value;
  if (report.success && model_.FromConic(search.model().ToConic(report.model), &value)) {
    candidates->push_back(Polished(value));
  }
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
  std::vector<double> distances;
  distances.reserve(points_.size());
  for (int i = 0; i < model_.NumData(); ++i) {
    if (!model_.DirectionFits(value, i)) continue;
    const std::size_t point = static_cast<std::size_t>(model_.PointIndex(i));
    distances.push_back(ConicDistancePx(points_[point], fit->conic));
    (*mask)[point] = std::abs(distances.back()) <= threshold ? 1 : 0;
  }
  fit->rms_px = InlierRms(distances, threshold);
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
  ConicFit result;
  std::vector<std::uint8_t> result_mask;
  status = NoEllipse();
  for (const Candidate& candidate : search.Run()) {
    status = search.Finish(candidate, &result, &result_mask);
    if (status.ok()) break;
  }
  if (!status.ok()) return status;
  *fit = result;
  if (mask != nullptr) *mask = std::move(result_mask);
  return Status::Ok();
}

Status RefitConicRobust(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
                        const Eigen::Matrix3d& initial, ConicFit* fit,
                        std::vector<std::uint8_t>* mask, const ConicLimits& limits,
                        const EdgeDirections* directions) {
  Status status = Check(points, options, limits, directions);
  if (!status.ok()) return status;
  if (points.size() < 5) return Status::Refused("an ellipse needs five points");
  const ConicSearch search(points, directions, options, limits);
  ConicModel::Value value;
  if (!search.model().FromConic(initial, &value)) return NoEllipse();
  ConicFit result;
  std::vector<std::uint8_t> result_mask;
  status = search.Finish(search.Polished(value), &result, &result_mask);
  if (!status.ok()) return status;
  *fit = result;
  if (mask != nullptr) *mask = std::move(result_mask);
  return Status::Ok();
}

}  // namespace circline
