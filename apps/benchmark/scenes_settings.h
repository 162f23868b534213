// The library's options and answers as the experiments use them: the one place to change when
// either changes.
#ifndef CIRCLINE_APPS_BENCHMARK_SCENES_SETTINGS_H_
#define CIRCLINE_APPS_BENCHMARK_SCENES_SETTINGS_H_

#include <string>

#include "circline/estimators/observations.h"
#include "circline/estimators/robust_loss.h"
#include "circline/ransac/fit_observations.h"
#include "circline/refine/estimate_pose.h"

namespace circline::apps {

struct Settings {
  LossType loss = LossType::kCauchy;
  bool exact = true;             // Nothing but the noise of points; else as on photographs.
  double log_focal_sigma = 0.0;  // Of the camera's focal length; 0: known.
};

// FitObservations, then EstimatePose.
PoseEstimate Estimate(const Settings& settings, Observations observations);

// Whether a hypothesis leaves this circle out, and says so.
bool IsLeftOut(const PoseEstimate& estimate, const PoseHypothesis& hypothesis,
               const std::string& circle);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_SCENES_SETTINGS_H_
