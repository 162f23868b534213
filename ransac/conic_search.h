// The search for one ellipse among points, and what its support is worth. Internal: not installed.
#ifndef CIRCLINE_RANSAC_CONIC_SEARCH_H_
#define CIRCLINE_RANSAC_CONIC_SEARCH_H_

#include <Eigen/Core>
#include <cstddef>
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

// An ellipse with what the points say of it.
struct ConicCandidate {
  ConicModel::Value value{};
  ConicWeights weights;
  double log_likelihood = 0.0;
};

// Some of the points, with their directions if there are any.
struct ContourSubset {
  std::vector<CalibratedPoint> points;
  EdgeDirections directions;

  ContourSubset(const std::vector<CalibratedPoint>& all, const EdgeDirections& all_directions,
                const std::vector<int>& indices) {
    directions.sigma_rad = all_directions.sigma_rad;
    for (const int i : indices) {
      const auto k = static_cast<std::size_t>(i);
      points.push_back(all[k]);
      if (!all_directions.normals.empty()) directions.normals.push_back(all_directions.normals[k]);
    }
  }
};

// The points that speak for an ellipse, and those that do not.
struct ConicSupport {
  int num_inliers = 0, num_stray = 0;
  double log_false_alarms = 0.0;  // LogFalseAlarms, for as dense clutter as the strays are.

  // Whether one as good or more is to be expected among scattered points.
  bool MayBeChance() const { return log_false_alarms > 0.0; }

  // Where no point is left out, few points or much noise are all that speaks against it.
  bool IsRefused() const { return MayBeChance() && num_stray > 0; }
  Status Refusal() const;  // The sentence that goes with it.
};

// The search for one ellipse in one set of points.
class ConicSearch {
 public:
  // All outlive the search.
  ConicSearch(const std::vector<CalibratedPoint>& points, const EdgeDirections& directions,
              const RobustFitOptions& options)
      : points_(points),
        directions_(directions),
        options_(options),
        model_(points, directions, options.ransac.threshold) {
    if (!directions.normals.empty()) oriented_.emplace(model_);
  }

  const ConicModel& model() const { return model_; }

  // What a few searches found, the likeliest first.
  std::vector<ConicCandidate> Run() const;
  // The likeliest that is an ellipse after Finish.
  Status Best(ConicFit* fit, std::vector<std::uint8_t>* mask) const;
  // What speaks for a conic; nothing but strays where it is no ellipse. Clutter is taken to be as
  // dense near it as elsewhere in the box of the points.
  ConicSupport Support(const Eigen::Matrix3d& conic) const;
  // What a short search found, if less than one as good is expected in a hundred sets.
  std::optional<ConicCandidate> RunShort() const;
  // The ellipse after reweighted steps.
  ConicCandidate Polished(const ConicModel::Value& value) const;
  // Maximum likelihood with the candidate's weights, its covariance, and (optional) the mask of the
  // result; both are written only if the status is ok.
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
  ConicSupport SupportOf(const ConicModel::Value& value) const;

  const std::vector<CalibratedPoint>& points_;
  const EdgeDirections& directions_;
  const RobustFitOptions& options_;
  ConicModel model_;
  std::optional<OrientedConicModel> oriented_;
};

// Ok, or what is wrong with the input of a fit.
Status CheckConicInput(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
                       const EdgeDirections& directions);

// As FitConicRobust, and RefitConicRobust from `initial`, but whether or not chance explains it.
Status FindConic(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
                 const Eigen::Matrix3d* initial, ConicFit* fit, std::vector<std::uint8_t>* mask,
                 const EdgeDirections& directions);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_CONIC_SEARCH_H_
