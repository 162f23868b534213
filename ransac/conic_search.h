// The search for one ellipse in one set of points, for robust_conic.h. Internal: not installed.
#ifndef CIRCLINE_RANSAC_CONIC_SEARCH_H_
#define CIRCLINE_RANSAC_CONIC_SEARCH_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic_fit.h"
#include "circline/estimators/status.h"
#include "circline/ransac/conic_model.h"
#include "circline/ransac/conic_weights.h"
#include "circline/ransac/oriented_conic_model.h"
#include "circline/ransac/ransac.h"

namespace circline {

// The refusal of all searches.
Status NoEllipse();

// An ellipse with what the points say of it.
struct ConicCandidate {
  ConicModel::Value value{};
  ConicWeights weights;
  double log_likelihood = 0.0;
};

// Some of the points, with their directions if there are any.
struct ContourSubset {
  std::vector<CalibratedPoint> points;
  std::optional<EdgeDirections> directions;

  const EdgeDirections* Directions() const { return directions ? &*directions : nullptr; }
};

ContourSubset SelectPoints(const std::vector<CalibratedPoint>& points,
                           const EdgeDirections* directions, const std::vector<int>& indices);

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
  std::vector<ConicCandidate> Run() const;
  // What a short search found, if chance does not explain it.
  std::optional<ConicCandidate> RunShort() const;
  // The ellipse after reweighted steps.
  ConicCandidate Polished(const ConicModel::Value& value) const;
  // Maximum likelihood with the candidate's weights, its covariance, and the mask of the result.
  Status Finish(const ConicCandidate& candidate, ConicFit* fit,
                std::vector<std::uint8_t>* mask) const;

 private:
  using Report = RansacReport<ConicModel::Value>;

  // One run of the engine, by samples with directions where there are any.
  void Draw(const RansacOptions& options, Report* report) const {
    if (oriented_) return Ransac<OrientedConicModel>(options).Run(*oriented_, report);
    Ransac<ConicModel>(options).Run(model_, report);
  }
  bool IsGood(const ConicCandidate& candidate, int num_inliers) const;
  std::vector<int> OutsideClusters() const;
  void SearchAmong(const std::vector<int>& indices, const RansacOptions& options, int num_inliers,
                   std::vector<ConicCandidate>* candidates) const;

  const std::vector<CalibratedPoint>& points_;
  const EdgeDirections* directions_;
  const RobustFitOptions& options_;
  const ConicLimits& limits_;
  ConicModel model_;
  std::optional<OrientedConicModel> oriented_;
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_CONIC_SEARCH_H_
