// circline_simulate: the paper's simulation, with the bound beside it.
#include <gflags/gflags.h>

#include <iostream>

#include "apps/common/flags_util.h"
#include "apps/common/output_file.h"
#include "apps/common/text.h"
#include "apps/common/written_files.h"
#include "apps/simulate/simulate.h"
#include "apps/simulate/street_trials.h"

DEFINE_string(scene, "paper",
              "paper: a circle and two pairs of parallel lines; street: segments of houses, for "
              "which trials, seed, threads and focal_sigma count.");
DEFINE_int32(trials, 200, "Images for each noise level and outlier ratio; 1 or more.");
DEFINE_string(noise_px, "0,0.5,1,1.5,2,2.5,3",
              "Standard deviations of the Gaussian noise on both coordinates of every point, "
              "pixels, separated by commas.");
DEFINE_string(outlier_ratio, "0",
              "Shares of the points of every feature that are replaced by outliers, 0 to 0.8, "
              "separated by commas.");
DEFINE_string(outlier_kind, "band",
              "band: uniform within 40 px of the feature; cluster: all in one disc of 15 px radius "
              "whose centre lies 40 px off the feature.");
DEFINE_double(focal, 1800.0, "Focal length, pixels.");
DEFINE_double(
    focal_sigma, 0.0,
    "Of streets: standard deviation of the logarithm of the focal length where that is "
    "a guess of 60 degrees and the principal point one of the middle, 0.1 to 1; 0: calibrated.");
DEFINE_string(translation, "2,2,100", "Of the camera: the world's origin in its frame.");
DEFINE_uint64(seed, 1, "Same flags and seed: same bytes out, whatever the threads.");
DEFINE_int32(threads, 0, "Images worked on at a time; 0 = one for each core.");
DEFINE_double(inlier_sigmas, circline::apps::SimulationOptions().inlier_sigmas,
              "With outliers: a point farther than this from its curve is one, in standard "
              "deviations of the noise; at most 3.03 is taken.");
DEFINE_string(robust_loss, "auto",
              "Loss of the refined methods: trivial, huber, soft_l_one, cauchy, arctan, tukey, "
              "geman_mcclure; auto: trivial without outliers, tukey with them.");
DEFINE_string(output, "", "Folder for the results; created if need be.");

namespace circline::apps {
namespace {

constexpr char kUsage[] =
    "circline_simulate: a circle and two pairs of parallel lines under noise and outliers; every "
    "method\n"
    "against the Cramer-Rao bound.\n"
    "\n"
    "  circline_simulate --output=out\n"
    "  circline_simulate --trials=500 --noise_px=1 --outlier_ratio=0,0.3,0.5 "
    "--outlier_kind=cluster --output=out\n"
    "  circline_simulate --scene=street --trials=1000 --output=out\n"
    "\n"
    "Writes simulation.csv and simulation.svg, or street.csv. Exit code 0: done; 1: the results "
    "could not be written;\n"
    "2: unusable flags (nothing is written).";

Status ReadNumbers(const std::string& flag, const std::string& text, std::vector<double>* values) {
  values->clear();
  for (const std::string& part : SplitList(text)) {
    double value;
    if (!ParseDouble(part, &value))
      return Status::Invalid("--" + flag + ": '" + part + "' is not a number");
    values->push_back(value);
  }
  return Status::Ok();
}

Status ReadTranslation(Eigen::Vector3d* translation) {
  std::vector<double> values;
  const Status status = ReadNumbers("translation", FLAGS_translation, &values);
  if (!status.ok()) return status;
  if (values.size() != 3) return Status::Invalid("--translation: must be three numbers: x,y,z");
  *translation = Eigen::Vector3d(values[0], values[1], values[2]);
  return Status::Ok();
}

// The flag's value is one of two names; `is_second`: which.
Status ReadChoice(const std::string& flag, const std::string& value, const char* first,
                  const char* second, bool* is_second) {
  if (value != first && value != second) {
    return Status::Invalid("--" + flag + ": '" + value + "' is not " + first + " or " + second +
                           DidYouMean(value, {first, second}));
  }
  *is_second = value == second;
  return Status::Ok();
}

Status ReadLoss(SimulationOptions* options) {
  if (FLAGS_robust_loss == "auto") return Status::Ok();
  if (!LossFromName(FLAGS_robust_loss, &options->loss)) {
    return Status::Invalid("--robust_loss: '" + FLAGS_robust_loss + "' is not one of auto, " +
                           JoinList(LossNames(), ", ") +
                           DidYouMean(FLAGS_robust_loss, LossNames()));
  }
  options->outlier_loss = options->loss;
  return Status::Ok();
}

// Not ok: one line that names the flag.
Status SimulationFromFlags(SimulationOptions* options, std::string* output) {
  options->trials = FLAGS_trials;
  options->focal_px = FLAGS_focal;
  options->focal_sigma = FLAGS_focal_sigma;
  options->seed = FLAGS_seed;
  options->threads = FLAGS_threads;
  options->inlier_sigmas = FLAGS_inlier_sigmas;
  *output = FLAGS_output;
  bool is_street = false, is_cluster = false;
  Status status = ReadChoice("scene", FLAGS_scene, "paper", "street", &is_street);
  if (status.ok()) status = ReadNumbers("noise_px", FLAGS_noise_px, &options->noise_px);
  if (status.ok())
    status = ReadNumbers("outlier_ratio", FLAGS_outlier_ratio, &options->outlier_ratios);
  if (status.ok()) status = ReadTranslation(&options->translation);
  if (status.ok())
    status = ReadChoice("outlier_kind", FLAGS_outlier_kind, "band", "cluster", &is_cluster);
  if (status.ok()) status = ReadLoss(options);
  if (!status.ok()) return status;
  options->scene = is_street ? SimulatedScene::kStreet : SimulatedScene::kPaper;
  options->outlier_kind = is_cluster ? OutlierKind::kCluster : OutlierKind::kBand;
  status = options->Validate();  // Its sentences begin with the flag's name.
  if (!status.ok()) return Status::Invalid("--" + status.message);
  if (output->empty()) return Status::Invalid("--output is missing: the folder for the results");
  return Status::Ok();
}

Status SimulateStreet(const SimulationOptions& options, const std::string& output) {
  const std::vector<StreetTrial> trials =
      SimulateStreets(options.trials, options.focal_sigma, options.seed, options.threads);
  std::cout << StreetSummary(trials);
  return WriteFile(output + "/street.csv", StreetCsv(trials));
}

Status SimulatePaper(const SimulationOptions& options, const std::string& output) {
  const std::vector<SimulationRow> rows = Simulate(options);
  std::cout << SimulationTable(rows);
  const Status status = WriteFile(output + "/simulation.csv", SimulationCsv(rows));
  if (!status.ok()) return status;
  return WriteFile(output + "/simulation.svg", RenderSimulation(rows));
}

int Run() {
  SimulationOptions options;
  std::string output;
  Status status = SimulationFromFlags(&options, &output);
  if (status.ok())
    status = WrittenFiles(output, {"simulation.csv", "simulation.svg", "street.csv"})
                 .CheckKept(FilesOfFlags());
  if (status.ok()) status = CreateFolder(output);
  if (status.ok())
    status = options.scene == SimulatedScene::kStreet ? SimulateStreet(options, output)
                                                      : SimulatePaper(options, output);
  return status.ok() ? kExitOk : Refuse("circline_simulate", status);
}

}  // namespace
}  // namespace circline::apps

int main(int argc, char** argv) {
  return circline::apps::RunApp(argc, argv, "circline_simulate", circline::apps::kUsage,
                                circline::apps::Run);
}
