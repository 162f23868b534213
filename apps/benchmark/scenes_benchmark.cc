// Simulated scenes of every kind against their Cramer-Rao bound: is the pose as accurate as the
// noise allows, are the stated covariances and probabilities true, and what happens where the
// evidence is not what it is taken for?
//
//     circline_scenes_benchmark                                  # about a minute
//     circline_scenes_benchmark --experiment=random --trials=2000 --noise_px=0.1,0.5,1,2
//     circline_scenes_benchmark --experiment=odd_lines --loss=tukey
//
// Missing: no hypothesis is right, that is, within 5 sigma of the bound or within 2 degrees (and
// its focal length within 10 %, where that is not known). Errors and coverage (of 2 sigma) are of
// the hypothesis nearest the truth, where it is right; wrong and sure (0.99) is the first one.
#include <gflags/gflags.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "apps/benchmark/scenes_experiments.h"
#include "apps/common/flags_util.h"
#include "apps/common/text.h"
#include "circline/estimators/status.h"

DEFINE_string(
    experiment, "all",
    "A list of: random, short_arcs, lone_arcs, odd_circles, bleed, focal_length, unknown_focal, "
    "outliers, circle_and_pencil, odd_lines, tracking; or all.");
DEFINE_int32(trials, 0, "Scenes for each row; 0: a few, each experiment's own number.");
DEFINE_uint64(seed, 1, "Of the scenes and their noise.");
DEFINE_string(noise_px, "",
              "A list of standard deviations of each coordinate of a point, pixels; empty: each "
              "experiment's own.");
DEFINE_string(loss, "", "A list of robust losses; empty: each experiment's own.");

namespace circline::apps {
namespace {

constexpr char kName[] = "circline_scenes_benchmark";
constexpr char kTracking[] = "tracking";

Status OptionsFromFlags(ExperimentOptions* options) {
  if (FLAGS_trials < 0) return Status::Invalid("--trials: must be 0 or more");
  options->trials = FLAGS_trials;
  options->seed = FLAGS_seed;
  if (!FLAGS_noise_px.empty()) {
    for (const std::string& part : SplitList(FLAGS_noise_px)) {
      double noise = 0.0;
      if (!ParseDouble(part, &noise) || !(noise > 0.0)) {
        return Status::Invalid("--noise_px: '" + part + "' is not a positive number");
      }
      options->noise_px.push_back(noise);
    }
  }
  if (!FLAGS_loss.empty()) {
    for (const std::string& part : SplitList(FLAGS_loss)) {
      LossType loss;
      if (!LossFromName(part, &loss)) {
        return Status::Invalid("--loss: '" + part + "' is not one" + DidYouMean(part, LossNames()));
      }
      options->losses.push_back(loss);
    }
  }
  return Status::Ok();
}

int RunExperiments() {
  std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);  // Rows as they come, into a file as well.
  ExperimentOptions options;
  Status status = OptionsFromFlags(&options);
  const std::vector<std::string> wanted = SplitList(FLAGS_experiment);
  const std::vector<SceneExperiment> experiments = SceneExperiments();
  std::vector<std::string> names = {kTracking};
  for (const SceneExperiment& experiment : experiments) names.push_back(experiment.name);
  for (const std::string& name : wanted) {
    if (name != "all" && std::find(names.begin(), names.end(), name) == names.end()) {
      status = Status::Invalid("--experiment: '" + name + "' is not one" + DidYouMean(name, names));
    }
  }
  if (!status.ok()) {
    SayOnStderr(std::string(kName) + ": " + status.message);
    return kExitUsage;
  }
  const auto is_wanted = [&wanted](const std::string& name) {
    return std::any_of(wanted.begin(), wanted.end(),
                       [&name](const std::string& w) { return w == "all" || w == name; });
  };
  for (const SceneExperiment& experiment : experiments) {
    if (is_wanted(experiment.name)) RunScenes(experiment, options);
  }
  if (is_wanted(kTracking)) RunTracking(options);
  return kExitOk;
}

}  // namespace
}  // namespace circline::apps

int main(int argc, char** argv) {
  return circline::apps::RunApp(
      argc, argv, circline::apps::kName,
      std::string(circline::apps::kName) + ": simulated scenes against their bound.",
      circline::apps::RunExperiments);
}
