#include "circline/ransac/robust_conic.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "circline/ransac/oriented_conic_model.h"

namespace circline {
namespace {

Status NoEllipse() { return Status::Refused("no ellipse explains the points"); }

struct Start {
  ConicModel::Value value{};
  ConicWeights weights;
  double log_likelihood = 0.0;
};

// Reweighted fit from the engine's ellipse.
void Polish(const ConicModel& model, double threshold, Start* start) {
  constexpr int kMaxPasses = 10;
  constexpr double kConverged =
      1e-4;  // Of half the points' box: a hundredth of a pixel in a hundred.
  start->weights.sigma = 0.0;
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    model.Weigh(start->value, threshold, &start->weights);
    const ConicModel::Value before = start->value;
    if (!model.Refine(start->weights.weights.data(), &start->value)) break;
    double change = 0.0;
    for (std::size_t k = 0; k < before.size(); ++k) {
      change = std::max(change, std::abs(start->value[k] - before[k]));
    }
    if (change < kConverged) break;
  }
  model.Weigh(start->value, threshold, &start->weights);
  start->log_likelihood = start->weights.LogLikelihood();
}

// One run of the engine, by samples with directions where there are any.
void Draw(const ConicModel& model, const OrientedConicModel* oriented, const RansacOptions& options,
          RansacReport<ConicModel::Value>* report) {
  if (oriented != nullptr) return Ransac<OrientedConicModel>(options).Run(*oriented, report);
  Ransac<ConicModel>(options).Run(model, report);
}

// On short or sparse contours the search may end on an ellipse that takes in clutter where the
// contour has none. Where less than half of the points are inliers, a few searches from other seeds
// are compared by likelihood.
bool Search(const ConicModel& model, const OrientedConicModel* oriented, RansacOptions options,
            Start* best) {
  constexpr int kSearches = 3;
  // Five noisy points of the contour are often not good enough: a second all-inlier sample.
  options.confidence = 1.0 - (1.0 - options.confidence) * (1.0 - options.confidence);
  Start start;
  for (int k = 0; k < kSearches; ++k) {
    RansacReport<ConicModel::Value> report;
    Draw(model, oriented, options, &report);
    if (!report.success) return k > 0;
    start.value = report.model;
    Polish(model, options.threshold, &start);
    const bool better = start.log_likelihood > best->log_likelihood;
    if (k == 0 || better) std::swap(start, *best);
    if (2 * report.num_inliers >= model.NumData()) break;
    options.seed = Random(options.seed).Next();
  }
  return true;
}

// Maximum likelihood with the final weights, and its covariance.
Status FitFinal(const std::vector<CalibratedPoint>& points, const ConicModel& model,
                const RobustFitOptions& options, const Start& start, ConicFit* fit,
                std::vector<std::uint8_t>* mask) {
  std::vector<CalibratedPoint> chosen;
  std::vector<double> weights;
  chosen.reserve(points.size());
  weights.reserve(points.size());
  for (int i = 0; i < model.NumData(); ++i) {
    const double w = static_cast<double>(start.weights.weights[static_cast<std::size_t>(i)]);
    if (w < 1e-3) continue;
    chosen.push_back(points[static_cast<std::size_t>(model.PointIndex(i))]);
    weights.push_back(w);
  }
  if (chosen.size() < 5) return NoEllipse();
  const Status status =
      RefineConic(chosen, options.sigma_px, model.ToConic(start.value), fit, &weights);
  if (!status.ok()) return status;
  ConicModel::Value value;
  const double threshold = options.ransac.threshold;
  if (!model.FromConic(fit->conic, &value) || !model.Accept(value, threshold)) return NoEllipse();
  mask->assign(points.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    (*mask)[i] = std::abs(ConicDistancePx(points[i], fit->conic)) <= threshold ? 1 : 0;
  }
  return Status::Ok();
}

}  // namespace

Status FitConicRobust(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
                      ConicFit* fit, std::vector<std::uint8_t>* mask, const ConicLimits& limits,
                      const EdgeDirections* directions) {
  Status status = options.Validate();
  if (status.ok()) status = limits.Validate();
  if (status.ok() && directions != nullptr) status = directions->Validate(points.size());
  if (!status.ok()) return status;
  if (points.size() < 5) return Status::Refused("an ellipse needs five points");
  const ConicModel model(points, limits, directions, options.ransac.threshold);
  std::optional<OrientedConicModel> oriented;
  if (directions != nullptr) oriented.emplace(model);
  Start start;
  if (!Search(model, oriented ? &*oriented : nullptr, options.ransac, &start)) return NoEllipse();
  ConicFit result;
  std::vector<std::uint8_t> result_mask;
  status = FitFinal(points, model, options, start, &result, &result_mask);
  if (!status.ok()) return status;
  *fit = result;
  if (mask != nullptr) *mask = std::move(result_mask);
  return Status::Ok();
}

}  // namespace circline
