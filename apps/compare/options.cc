#include "apps/compare/options.h"

#include <gflags/gflags.h>

#include <algorithm>
#include <array>
#include <iomanip>
#include <optional>
#include <sstream>

#include "apps/common/flags_util.h"
#include "apps/common/plugins.h"
#include "apps/common/text.h"
#include "apps/compare/export.h"
#include "apps/compare/peers.h"
#include "circline/estimators/solver_registry.h"
#include "circline/refine/refined_solvers.h"

DEFINE_string(output, "", "Folder for the results; created if need be.");
DEFINE_string(solvers, "all", "Solvers to compare, separated by commas; see --list_solvers.");
DEFINE_double(
    inlier_threshold_px, circline::FitOptions().inlier_threshold_px,
    "A point farther than this from its curve is an outlier, pixels; 0 = from the noise.");
DEFINE_double(ransac_confidence, circline::FitOptions().confidence,
              "Probability that the best model was among those drawn; between 0 and 1.");
DEFINE_int32(ransac_max_iterations, circline::FitOptions().max_iterations,
             "Draws for each model; 1 or more.");
DEFINE_double(min_ellipse_axis_px, circline::DetectionOptions().min_ellipse_axis_px,
              "Detection: smallest semi-minor axis of an ellipse, pixels.");
DEFINE_double(min_arc_deg, circline::DetectionOptions().min_arc_deg,
              "Detection: smallest angular coverage of an ellipse, degrees.");
DEFINE_double(min_segment_length_px, circline::DetectionOptions().min_segment_length_px,
              "Detection: shortest line segment, pixels.");
DEFINE_int32(max_circles, circline::DetectionOptions().max_circles,
             "Detection: at most so many ellipses.");
DEFINE_int32(max_pencils, circline::DetectionOptions().max_pencils,
             "Detection: at most so many directions of parallel lines.");
DEFINE_uint64(seed, circline::FitOptions().seed, "Same input and seed: same bytes out.");
DEFINE_int32(threads, 0,
             "Images worked on at a time, at most one for each core; 0 = one for each core.");
DEFINE_double(max_megapixels, circline::apps::kMaxMegapixels,
              "Photos with more are refused: time and memory grow with it.");
DEFINE_bool(overlays, true, "Draw a picture of each photo with what was found in it.");
DEFINE_bool(
    peers, false,
    "Also run OpenCV's solvePnP (IPPE, SQPnP, iterative) on the 'points' of the scene file, and "
    "ViSP's solvers if they were built in; see --list_solvers.");
DEFINE_bool(resume, false,
            "Go on where a run with the same flags was stopped: skip what results.jsonl has.");
DEFINE_string(save_options, "",
              "A file for the flags with the best loss and scale, to be used as --flagfile.");
DEFINE_string(export_as, "",
              "Also write the poses of the answers shown: colmap (images.txt, cameras.txt), gltf "
              "(cameras.gltf), tum (trajectory.txt); a list. Not metric poses have unit distance.");
DEFINE_string(plugin, "",
              "Shared libraries with solvers of your own, separated by commas; see "
              "circline/estimators/solver_plugin.h.");
DEFINE_bool(list_solvers, false, "List the solvers and what each needs, and do nothing else.");

namespace circline::apps {
namespace {

// The option is good as far as this flag goes: the sentence, with the flag and its value in front.
Status CheckFlag(const std::string& flag, const Status& status) {
  if (status.ok()) return status;
  std::string value;
  gflags::GetCommandLineOption(flag.c_str(), &value);
  return Status::Invalid("--" + flag + "=" + value + ": " + status.message);
}

// Validate names the field that is wrong: a flag has the same name, or that with "ransac_".
Status CheckOptions(const Status& status) {
  if (status.ok()) return status;
  const std::string field = status.message.substr(0, status.message.find(' '));
  std::string value;
  for (const std::string& flag : {field, "ransac_" + field}) {
    if (gflags::GetCommandLineOption(flag.c_str(), &value)) return CheckFlag(flag, status);
  }
  return status;
}

Status ReadFitOptions(FitOptions* fit) {
  fit->seed = FLAGS_seed;
  fit->inlier_threshold_px = FLAGS_inlier_threshold_px;
  fit->confidence = FLAGS_ransac_confidence;
  fit->max_iterations = FLAGS_ransac_max_iterations;
  return CheckOptions(fit->Validate());
}

Status ReadDetectionOptions(DetectionOptions* detection) {
  detection->seed = FLAGS_seed;
  detection->min_ellipse_axis_px = FLAGS_min_ellipse_axis_px;
  detection->min_arc_deg = FLAGS_min_arc_deg;
  detection->min_segment_length_px = FLAGS_min_segment_length_px;
  detection->max_circles = FLAGS_max_circles;
  detection->max_pencils = FLAGS_max_pencils;
  return CheckOptions(detection->Validate());
}

Status ReadSolvers(std::vector<std::string>* solvers) {
  solvers->clear();
  const std::vector<std::string> known = SolverNames();
  for (const std::string& name : SplitList(FLAGS_solvers)) {
    if (name == "all") {
      solvers->clear();
      return Status::Ok();
    }
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      return Status::Invalid("--solvers: there is no solver '" + name + "'" +
                             DidYouMean(name, known) + " (--list_solvers lists them)");
    }
    solvers->push_back(name);
  }
  return Status::Ok();
}

Status ReadExports(std::vector<std::string>* exports) {
  std::vector<std::string> known;
  for (const ExportFormat& format : ExportFormats()) known.push_back(format.name);
  return NamesFromFlag("export_as", FLAGS_export_as, known, exports);
}

SolverRegistry AllSolvers() {
  SolverRegistry registry;
  AddClosedFormSolvers(&registry);
  AddPluginSolvers(ClosedFormOptions(), &registry);
  AddRefinedSolvers(&registry);
  return registry;
}

// The flags beside solvers and losses that shape what is found in a photo; and those that say which
// photos are read, and how to see them without a scene file.
constexpr char kTuningFlags[] =
    "conic_loss,conic_loss_scale_px,line_loss,line_loss_scale_px,conic_distance,focal_sigma,noise,"
    "noise_model,inlier_threshold_px,ransac_confidence,ransac_max_iterations,min_ellipse_axis_px,"
    "min_arc_deg,min_segment_length_px,max_circles,max_pencils,seed";
constexpr char kInputFlags[] = "fov_deg,focal_px,roi,circle_radius,max_megapixels";

using FlagInfo = gflags::CommandLineFlagInfo;

// Those that are wanted, as "--name=value". `names`: separated by commas.
std::vector<std::string> FlagTexts(const std::string& names, bool (*is_wanted)(const FlagInfo&)) {
  std::vector<std::string> texts;
  for (const std::string& name : SplitList(names)) {
    FlagInfo info;
    if (gflags::GetCommandLineFlagInfo(name.c_str(), &info) && is_wanted(info))
      texts.push_back("--" + name + "=" + info.current_value);
  }
  return texts;
}
bool Any(const FlagInfo& /*info*/) { return true; }
bool IsGiven(const FlagInfo& info) { return !info.is_default; }
bool IsUnusual(const FlagInfo& info) { return info.current_value != info.default_value; }

std::string Lines(const std::vector<std::string>& texts) {
  return texts.empty() ? "" : JoinList(texts, "\n") + "\n";
}

}  // namespace

Status OptionsFromFlags(CompareOptions* options) {
  NoiseModel noise;
  Status status = PluginsFromFlags();
  if (status.ok()) status = NoiseFromFlags(&noise, &options->inputs.guess);
  options->detection.noise_model = options->fit.noise_model = options->closed_form.noise_model =
      noise;
  if (status.ok()) status = ReadFitOptions(&options->fit);
  if (status.ok()) status = ReadDetectionOptions(&options->detection);
  if (status.ok()) status = LossesFromFlags(noise, &options->losses);
  if (status.ok()) {
    const EstimationOptions& first = options->losses.front().estimation;
    options->closed_form.noise_model.camera = first.camera_sigma.value_or(noise.camera);
  }
  if (status.ok()) status = ReadSolvers(&options->solvers);
  if (!status.ok()) return status;
  if (FLAGS_threads < 0 || FLAGS_threads > 1024) {
    return CheckFlag("threads", Status::Invalid("must be between 0 and 1024"));
  }
  status = InputsFromFlags(&options->inputs);
  const std::optional<CameraSigma>& stated = options->losses.front().estimation.camera_sigma;
  if (stated) options->inputs.guess.stated.log_focal = stated->log_focal;
  if (status.ok()) status = ReadExports(&options->finish.exports);
  if (!status.ok()) return status;
  if (FLAGS_output.empty())
    return Status::Invalid("--output is missing: the folder for the results");
  options->output = FLAGS_output;
  options->threads = FLAGS_threads;
  if (!(FLAGS_max_megapixels > 0.0) || !std::isfinite(FLAGS_max_megapixels))
    return CheckFlag("max_megapixels", Status::Invalid("must be positive and finite"));
  options->max_megapixels = FLAGS_max_megapixels;
  options->overlays = FLAGS_overlays;
  options->resume = FLAGS_resume;
  options->peers = FLAGS_peers;
  const std::string shaping = std::string(kTuningFlags) + "," + kInputFlags;
  options->result_flags =
      Lines(FlagTexts("plugin,solvers,robust_loss,loss_scale_px,shard,overlays," + shaping, Any));
  options->unusual_flags = FlagTexts(shaping, IsUnusual);
  options->finish.save_options = FLAGS_save_options;
  options->finish.other_flags = Lines(FlagTexts(kTuningFlags, IsGiven));
  return Status::Ok();
}

Status CheckOneLoss(const CompareOptions& options) {
  return options.losses.size() == 1
             ? Status::Ok()
             : Status::Invalid(
                   "--robust_loss, --loss_scale_px: only circline_compare takes a list");
}

std::vector<std::string> SolverNames() {
  const SolverRegistry registry = AllSolvers();
  std::vector<std::string> names;
  for (const auto& solver : registry.solvers()) AddOnce(solver->name(), &names);
  return names;
}

std::string ListSolvers() {
  const SolverRegistry registry = AllSolvers();
  std::vector<std::array<std::string, 3>> rows;  // Name, stages, needs.
  for (const std::string& name : SolverNames()) {
    std::vector<std::string> stages;
    std::string needs;
    for (const SolverStage stage : {SolverStage::kClosedForm, SolverStage::kRefined}) {
      const Solver* solver = registry.Find(name, stage);
      if (solver == nullptr) continue;
      stages.emplace_back(SolverStageName(stage));
      if (needs.empty()) needs = solver->needs();
    }
    rows.push_back({name, JoinList(stages, ", "), needs});
  }
  for (const PeerSolver& peer : PeerSolvers()) {
    rows.push_back({peer.name, SolverStageName(peer.stage), peer.needs + " (with --peers)"});
  }
  std::ostringstream text;
  text << std::left;
  for (const auto& [name, stages, needs] : rows) {
    text << std::setw(29) << name << std::setw(22) << stages << needs << "\n";
  }
  return text.str();
}

Status PluginsFromFlags() { return LoadPlugins(FLAGS_plugin); }

bool ListSolversAsked() { return FLAGS_list_solvers; }

}  // namespace circline::apps
