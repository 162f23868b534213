#include "apps/benchmark/scenes_settings.h"

#include <algorithm>
#include <vector>

#include "circline/estimators/noise_model.h"

namespace circline::apps {
namespace {

FitOptions MakeFitOptions(const Settings& settings) {
  FitOptions options;
  if (settings.exact) options.noise_model = NoiseModel::Exact();
  return options;
}

EstimationOptions MakeEstimationOptions(const Settings& settings) {
  EstimationOptions options;
  options.conic_loss.type = options.line_loss.type = settings.loss;
  if (settings.exact) options.noise_model = NoiseModel::Exact();
  if (settings.log_focal_sigma > 0.0) {
    CameraSigma sigma = options.noise_model.camera;
    sigma.log_focal = settings.log_focal_sigma;
    options.camera_sigma = sigma;
  }
  return options;
}

}  // namespace

PoseEstimate Estimate(const Settings& settings, Observations observations) {
  const Status fitted = FitObservations(MakeFitOptions(settings), &observations);
  if (!fitted.ok()) {
    PoseEstimate refused;
    refused.status = fitted;
    return refused;
  }
  return EstimatePose(observations, MakeEstimationOptions(settings));
}

bool IsLeftOut(const PoseEstimate& estimate, const PoseHypothesis& hypothesis,
               const std::string& circle) {
  const std::vector<std::string>& left_out = hypothesis.left_out;
  if (std::find(left_out.begin(), left_out.end(), circle) != left_out.end()) return true;
  return std::any_of(estimate.notes.begin(), estimate.notes.end(), [&](const std::string& note) {
    return note.find("circle '" + circle + "'") != std::string::npos;
  });
}

}  // namespace circline::apps
