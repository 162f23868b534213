#include "circline/ransac/conic_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "circline/estimators/random.h"
#include "circline/ransac/dense_clusters.h"
#include "circline/ransac/false_alarms.h"
#include "circline/ransac/inlier_weights.h"

namespace circline {
namespace {

Status NoEllipse() { return Status::Refused("no ellipse explains the points"); }

}  // namespace

Status ConicSupport::Refusal() const {
  return Status::Refused("its best ellipse passes through " + std::to_string(num_inliers) + " of " +
                         std::to_string(num_inliers + num_stray) +
                         " points, which scattered points explain");
}

ConicCandidate ConicSearch::Polished(const ConicModel::Value& value) const {
  constexpr int kMaxPasses = 30;
  // Of half the points' box: a hundredth of a pixel in a hundred.
  constexpr double kConverged = 1e-4;
  using Map = Eigen::Map<const Vector6d>;
  ConicCandidate result;
  result.value = value;
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    WeighConic(model_, result.value, options_.ransac.threshold, &result.weights);
    const ConicModel::Value before = result.value;
    if (!model_.Refine(result.weights.weights.data(), &result.value)) break;
    const Map now(result.value.data());
    if ((now - Map(before.data())).lpNorm<Eigen::Infinity>() < kConverged) break;
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
// badly, among the points outside dense clusters, are compared by likelihood. With directions,
// which need so few draws that an ellipse through parts of two rims may come first, there is one
// more seed up to two thirds.
std::vector<ConicCandidate> ConicSearch::Run() const {
  RansacOptions options = options_.ransac;
  // One sample is often not good enough: a second all-inlier sample.
  options.confidence = 1.0 - (1.0 - options.confidence) * (1.0 - options.confidence);
  std::vector<ConicCandidate> candidates;
  Report report;
  Draw(options, &report);
  if (!report.success) return candidates;
  candidates.push_back(Polished(report.model));
  const int num_inliers = report.num_inliers, n = model_.NumData();
  const bool good = IsGood(candidates[0], num_inliers);
  const bool are_most = good && 2 * num_inliers >= n;
  if (are_most && (!oriented_ || 3 * num_inliers >= 2 * n)) return candidates;
  if (!good) SearchAmong(OutsideClusters(), options, num_inliers, &candidates);
  const int num_seeds = are_most ? 2 : 3;
  for (int k = 1; k < num_seeds; ++k) {
    options.seed = Random(options.seed).Next();
    options.max_iterations -= report.num_iterations;  // They are for all seeds.
    if (options.max_iterations <= 0) break;
    Draw(options, &report);
    if (report.success) candidates.push_back(Polished(report.model));
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const ConicCandidate& a, const ConicCandidate& b) {
                     return a.log_likelihood > b.log_likelihood;
                   });
  return candidates;
}

Status ConicSearch::Best(ConicFit* fit, std::vector<std::uint8_t>* mask) const {
  Status status = NoEllipse();
  for (const ConicCandidate& candidate : Run()) {
    status = Finish(candidate, fit, mask);
    if (status.ok()) break;
  }
  return status;
}

ConicSupport ConicSearch::Support(const Eigen::Matrix3d& conic) const {
  ConicModel::Value value;
  if (model_.FromConic(conic, &value)) return SupportOf(value);
  return {0, model_.NumData(), std::numeric_limits<double>::max()};
}

ConicSupport ConicSearch::SupportOf(const ConicModel::Value& value) const {
  const double threshold = options_.ransac.threshold;
  ConicSupport support;
  std::vector<float> r2(points_.size());
  model_.SquaredDistances(value, 0, model_.NumData(), r2.data());
  for (int i = 0; i < model_.NumData(); ++i) {
    const bool is_inlier = r2[static_cast<std::size_t>(i)] <= threshold * threshold &&
                           model_.DirectionMiss(value, i) < kInlierSigmas * kInlierSigmas;
    ++(is_inlier ? support.num_inliers : support.num_stray);
  }
  // The strays are those of the clutter that are no inliers; one more than were seen (Laplace's
  // rule), lest none be taken for proof that there is no clutter.
  const double share = DirectionChance(model_) * model_.BandShare(value, threshold);
  support.log_false_alarms = LogFalseAlarms(
      points_.size(), oriented_ ? OrientedConicModel::kMinSamples : ConicModel::kMinSamples,
      (support.num_stray + 1.0) * share / std::max(1.0 - share, 1e-9),
      static_cast<std::size_t>(support.num_inliers));
  return support;
}

std::optional<ConicCandidate> ConicSearch::RunShort() const {
  RansacOptions options = options_.ransac;
  constexpr int kMost = 500;
  options.max_iterations = std::min(kMost, options.max_iterations);
  Report report;
  Draw(options, &report);
  if (!report.success) return {};
  ConicCandidate candidate = Polished(report.model);
  if (!IsGood(candidate, report.num_inliers)) return {};
  constexpr double kMaxFalseAlarms = 0.01;
  if (SupportOf(candidate.value).log_false_alarms > std::log(kMaxFalseAlarms)) return {};
  return candidate;
}

// Log-likelihood for each inlier: 4 in sparse clutter, 3 among twice as many, 1 to 2.5 in a blob.
bool ConicSearch::IsGood(const ConicCandidate& candidate, int num_inliers) const {
  constexpr double kGood = 3.0;
  return candidate.log_likelihood >= kGood * num_inliers &&
         model_.Accept(candidate.value, options_.ransac.threshold);
}

std::vector<int> ConicSearch::OutsideClusters() const {
  constexpr int kSome = 300;  // Points, in random order, that stand for all.
  std::vector<int> indices =
      circline::OutsideClusters(model_.NumData(), kSome, [this](int i, int j) {
        return model_.PixelsBetween(i, j) < kClusterThresholds * options_.ransac.threshold;
      });
  for (int& i : indices) i = model_.PointIndex(i);
  return indices;
}

// Adds the best ellipse among some of the points, if these are not nearly all.
void ConicSearch::SearchAmong(const std::vector<int>& indices, const RansacOptions& options,
                              int num_inliers, std::vector<ConicCandidate>* candidates) const {
  const int num_points = static_cast<int>(indices.size());
  if (10 * num_points > 9 * model_.NumData()) return;
  const ContourSubset rest(points_, directions_, indices);
  const ConicSearch search(rest.points, rest.directions, options_);
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

Status ConicSearch::Finish(const ConicCandidate& candidate, ConicFit* fit,
                           std::vector<std::uint8_t>* mask) const {
  std::vector<CalibratedPoint> chosen;
  std::vector<double> weights;
  for (int i = 0; i < model_.NumData(); ++i) {
    const double w = static_cast<double>(candidate.weights.weights[static_cast<std::size_t>(i)]);
    if (w < 1e-3) continue;
    chosen.push_back(points_[static_cast<std::size_t>(model_.PointIndex(i))]);
    weights.push_back(w);
  }
  if (chosen.size() < 5) return NoEllipse();
  ConicFit result;
  const Status status =
      RefineConic(chosen, options_.sigma_px, model_.ToConic(candidate.value), &result, &weights);
  if (!status.ok()) return status;
  ConicModel::Value value;
  const double threshold = options_.ransac.threshold;
  if (!model_.FromConic(result.conic, &value) || !model_.Accept(value, threshold)) {
    return NoEllipse();
  }
  if (mask != nullptr) mask->assign(points_.size(), 0);
  std::vector<double> distances;
  for (int i = 0; i < model_.NumData(); ++i) {
    if (!(model_.DirectionMiss(value, i) < kInlierSigmas * kInlierSigmas)) continue;
    const std::size_t point = static_cast<std::size_t>(model_.PointIndex(i));
    distances.push_back(ConicDistancePx(points_[point], result.conic));
    if (mask != nullptr) (*mask)[point] = std::abs(distances.back()) <= threshold ? 1 : 0;
  }
  result.rms_px = InlierRms(distances, threshold);
  *fit = result;
  return Status::Ok();
}

Status CheckConicInput(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
                       const EdgeDirections& directions) {
  Status status = options.Validate();
  if (status.ok()) status = directions.Validate(points.size());
  if (status.ok() && points.size() < 5) return Status::Refused("an ellipse needs five points");
  return status;
}

Status FindConic(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
                 const Eigen::Matrix3d* initial, ConicFit* fit, std::vector<std::uint8_t>* mask,
                 const EdgeDirections& directions) {
  const Status status = CheckConicInput(points, options, directions);
  if (!status.ok()) return status;
  const ConicSearch search(points, directions, options);
  if (initial != nullptr) {
    ConicModel::Value value;
    if (!search.model().FromConic(*initial, &value)) return NoEllipse();
    return search.Finish(search.Polished(value), fit, mask);
  }
  return search.Best(fit, mask);
}

}  // namespace circline
