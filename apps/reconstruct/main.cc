// circline_reconstruct: from one photo a textured model of a box, or of a plane and of what stands
// on it, with measurements.
#include <gflags/gflags.h>

#include <cmath>
#include <iostream>
#include <opencv2/imgproc.hpp>

#include "apps/common/flags_util.h"
#include "apps/common/in_parallel.h"
#include "apps/common/output_file.h"
#include "apps/common/text.h"
#include "apps/common/written_files.h"
#include "apps/compare/encode.h"
#include "apps/compare/image_run.h"
#include "apps/compare/options.h"
#include "apps/compare/overlay.h"
#include "apps/reconstruct/measurements.h"
#include "apps/reconstruct/model.h"
#include "apps/reconstruct/trace_box.h"
#include "apps/reconstruct/views.h"

DEFINE_string(image, "",
              "Which image of the scene file, by its name there; the only one if empty.");
DEFINE_int32(hypothesis, 0, "Which pose, where several explain the photo; 0 = the most probable.");
DEFINE_int32(texture_px, circline::apps::ModelOptions().texture_px,
             "Longer side of the plane's texture, pixels; 16 to 8192; 0: as the photo has it.");
DEFINE_double(margin, circline::apps::ModelOptions().margin,
              "Part of the plane shown about the evidence, share of its longer side; 0 to 10.");
DEFINE_double(point_sigma_px, 0.3,
              "Standard deviation of a marked point's coordinates, pixels, where the scene file "
              "states none; positive.");

namespace circline::apps {
namespace {

constexpr char kUsage[] =
    "circline_reconstruct: a textured model and measurements from one photo.\n"
    "\n"
    "  circline_reconstruct --scene=set/scene.yaml --image=img01.jpg --output=out\n"
    "\n"
    "Writes model.glb, model.obj, model.mtl and textures (Z is up), measurements.csv and "
    "views.png. "
    "Flags for inputs,\n"
    "detection, solvers and losses are those of circline_compare.\n"
    "Exit code 0: done; 1: the photo could not be read or gives no pose; 2: unusable flags or "
    "scene file.";

Status ModelFromFlags(ModelOptions* options) {
  options->texture_px = FLAGS_texture_px;
  options->margin = FLAGS_margin;
  if (FLAGS_texture_px != 0 && (FLAGS_texture_px < 16 || FLAGS_texture_px > 8192)) {
    return Status::Invalid("--texture_px must be 0 or between 16 and 8192");
  }
  if (!(FLAGS_margin >= 0.0 && FLAGS_margin <= 10.0)) {
    return Status::Invalid("--margin must be between 0 and 10");
  }
  if (!(FLAGS_point_sigma_px > 0.0) || !std::isfinite(FLAGS_point_sigma_px))
    return Status::Invalid("--point_sigma_px must be positive");
  if (FLAGS_hypothesis < 0) return Status::Invalid("--hypothesis must be 0 or more");
  return Status::Ok();
}

Status FindImage(const ImageSet& images, SceneImage* image) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < images.size(); ++i) {
    names.push_back(images.name(i));
    if (names.back() != FLAGS_image && !(FLAGS_image.empty() && images.size() == 1)) continue;
    *image = images.At(i);
    return Status::Ok();
  }
  return FLAGS_image.empty() ? Status::Invalid("--image is missing: which of the " +
                                               std::to_string(images.size()) + " images")
                             : Status::Invalid("--image: there is no image '" + FLAGS_image + "'" +
                                               DidYouMean(FLAGS_image, names));
}

// What is written: a model and how it is seen.
struct Reconstruction {
  Model model;
  Camera camera;
  CameraPose pose;
  std::vector<MeasuredValue> measured;
  cv::Mat picture;  // The photo, drawn upon.
  std::string title;
};

Status WriteAll(const cv::Mat& photo, Reconstruction* made, const ModelOptions& options,
                const std::string& folder) {
  made->camera.width = photo.cols;
  made->camera.height = photo.rows;
  FaceTheCamera(made->pose, &made->model);
  NamePatches(&made->model);
  TextureModel(photo, made->camera, made->pose, options, &made->model);
  std::vector<std::string> caption;
  for (const MeasuredValue& value : made->measured) {
    if (value.what != "length" && value.what != "height") continue;
    caption.push_back(value.id + " " + FormatShort(value.value) + " +- " +
                      FormatShort(value.sigma));
  }
  constexpr std::size_t kMaxCaption = 6;
  if (caption.size() > kMaxCaption) caption.resize(kMaxCaption);
  const cv::Mat views = ModelViews(made->picture, made->model, made->pose, made->title, caption);
  Status status = CreateFolder(folder);
  if (status.ok()) status = WriteObj(made->model, made->camera, made->pose, folder);
  if (status.ok()) status = WriteGlb(made->model, made->camera, made->pose, folder + "/model.glb");
  if (status.ok())
    status = WriteFile(folder + "/measurements.csv", MeasurementsCsv(made->measured));
  if (status.ok()) status = WriteFile(folder + "/views.png", EncodePng(views));
  return status;
}

// The pose to take of those that explain the photo.
Status ChoosePose(const ImageRun& run, const PoseHypothesis** hypothesis) {
  const SolverRun* shown = AnswerToShow(run.solvers);
  if (shown == nullptr) {
    return Status::Refused("no pose: " + (run.solvers.empty()
                                              ? "there is no solver"
                                              : run.solvers.back().estimate.status.message));
  }
  const std::vector<PoseHypothesis>& all = shown->estimate.hypotheses;
  const auto index = static_cast<std::size_t>(FLAGS_hypothesis);
  if (index >= all.size()) {
    return Status::Failed("--hypothesis=" + std::to_string(index) + ": there are " +
                          std::to_string(all.size()));
  }
  *hypothesis = &all[index];
  if (all.size() > 1) {
    SayOnStderr("circline_reconstruct: " + std::to_string(all.size()) +
                " poses explain the photo; this one has probability " +
                FormatFixed(all[index].probability, 2) + " (--hypothesis chooses)");
  }
  return Status::Ok();
}

// The evidence fitted anew, where the photo itself has told the camera.
void SeeThrough(const Camera& camera, const NoiseModel& noise, Observations* observations) {
  observations->camera = camera;
  ResetFits(observations);
  FitDirect(FLAGS_point_sigma_px, observations, nullptr, noise);
}

// --- A box ---

// Along axes that the hypotheses of the photo's pose have, the most probable first; where the
// rotation is free the normal is right all the same.
Status FindBox(const ImageRun& run, const BoxOptions& options, BoxObservation* box, BoxFit* fit) {
  constexpr std::size_t kMost = 8;
  Camera camera = run.observations.camera;
  std::vector<Eigen::Matrix3d> axes;
  if (const SolverRun* shown = AnswerToShow(run.solvers)) {
    camera = CameraOf(shown->estimate.hypotheses.front(), camera);
    for (const PoseHypothesis& hypothesis : shown->estimate.hypotheses) {
      if (axes.size() < kMost) axes.push_back(hypothesis.cam_from_world.rotation);
    }
  }
  return TraceBox(run.photo, camera, options, axes, box, fit);
}

Status ReconstructBox(const CompareOptions& options, const ImageRun& run, BoxObservation box,
                      Reconstruction* made) {
  const EstimationOptions& estimation = options.losses.front().estimation;
  BoxOptions box_options;
  box_options.noise = estimation.noise_model;
  box_options.camera = CameraSigmaOf(estimation, *run.image);
  box_options.point_sigma_px = FLAGS_point_sigma_px;
  BoxFit fit;
  const Status status = box.edges.empty() ? FindBox(run, box_options, &box, &fit)
                                          : FitMarkedBox(run.photo, run.image->observations.camera,
                                                         box_options, &box, &fit);
  if (!status.ok()) return status;
  made->model = BoxModel(fit);
  if (made->model.patches.empty())
    return Status::Refused("the box '" + box.id + "': none of its faces is seen from outside");
  for (const std::string& note : fit.notes) SayOnStderr("circline_reconstruct: " + note);
  made->camera = fit.camera;
  made->pose = fit.cam_from_box;
  EstimationOptions seen = estimation;
  seen.camera_sigma = box_options.camera;
  made->measured = MeasureBox(fit, box, run.observations, seen);
  made->picture = DrawBox(run.photo, box, fit);
  made->title = fit.metric ? "a box" : "a box, in units of the distance to its origin";
  return status;
}

// --- A plane and what stands on it ---

Status ReconstructPlane(const NoiseModel& noise, const ModelOptions& options, ImageRun* run,
                        Reconstruction* made) {
  const PoseHypothesis* hypothesis = nullptr;
  Status status = ChoosePose(*run, &hypothesis);
  if (!status.ok()) return status;
  if (hypothesis->camera) SeeThrough(*hypothesis->camera, noise, &run->observations);
  made->model = PlaneModel(run->photo, run->observations, *hypothesis, options);
  if (made->model.patches.empty()) return Status::Refused("no evidence lies in the world's plane");
  status = AddSolids(run->image->solids, run->observations, *hypothesis, FLAGS_point_sigma_px,
                     &made->model);
  if (!status.ok()) return status;
  made->camera = run->observations.camera;
  made->pose = hypothesis->cam_from_world;
  made->measured = Measure(run->observations, *hypothesis, made->model, FLAGS_point_sigma_px);
  made->picture = DrawOverlay(*run);
  cv::resize(made->picture, made->picture, run->photo.size(), 0.0, 0.0, cv::INTER_AREA);
  made->title = hypothesis->metric ? "a plane" : "a plane, in units of the distance to its origin";
  return status;
}

Status ReconstructImage(const CompareOptions& options, const ModelOptions& model_options,
                        ImageRun* run, Reconstruction* made) {
  if (!run->read_error.empty()) return Status::Failed(run->read_error);
  const Solids& solids = run->image->solids;
  if (!solids.boxes.empty()) return ReconstructBox(options, *run, solids.boxes.front(), made);
  // --hypothesis chooses among the poses of the plane.
  if (solids.empty() && run->image->detect_everything && FLAGS_hypothesis == 0) {
    BoxObservation box;
    box.id = "box";
    const Status status = ReconstructBox(options, *run, box, made);
    if (status.code != StatusCode::kRefused) return status;
    SayOnStderr("circline_reconstruct: " + status.message + "; modelling the plane");
    *made = Reconstruction();
  }
  return ReconstructPlane(options.losses.front().estimation.noise_model, model_options, run, made);
}

// A photo with a box is modelled as that box alone.
Status CheckSolids(const Solids& solids) {
  if (solids.boxes.empty()) return Status::Ok();
  if (solids.boxes.size() > 1) return Status::Invalid("one box a photo can be modelled");
  const std::string name = "the box '" + solids.boxes.front().id + "' is modelled alone: ";
  if (!solids.cylinders.empty())
    return Status::Invalid(name + "leave out the cylinder '" + solids.cylinders.front().id + "'");
  if (!solids.faces.empty())
    return Status::Invalid(name + "leave out the face '" + solids.faces.front().id +
                           "', which is not its base");
  if (FLAGS_hypothesis > 0) return Status::Invalid("--hypothesis: a marked box has one pose");
  return Status::Ok();
}

// Nothing that is read is written over.
Status CheckKept(const SceneImage& image, const std::string& output) {
  std::vector<std::string> read = FilesOfFlags();
  read.push_back(image.path);
  return WrittenFiles(output, {"model.glb", "model.obj", "model.mtl", "texture.png",
                               "texture_*.png", "measurements.csv", "views.png"})
      .CheckKept(read);
}

int Reconstruct() {
  CompareOptions options;
  ModelOptions model_options;
  ImageSet images;
  SceneImage image;
  Status status = OptionsFromFlags(&options);
  if (status.ok()) status = CheckOneLoss(options);
  if (status.ok()) status = ModelFromFlags(&model_options);
  if (status.ok()) status = ImagesFromFlags(options.inputs, &images);
  if (status.ok()) status = FindImage(images, &image);
  if (!status.ok()) return Refuse("circline_reconstruct", status);
  status = CheckSolids(image.solids);
  if (!status.ok())
    return Refuse("circline_reconstruct", Status::Invalid(image.path + ": " + status.message));
  status = CheckKept(image, options.output);
  if (!status.ok()) return Refuse("circline_reconstruct", status);
  if (options.inputs.guess.wanted) SayOnStderr(DescribeGuess(options.inputs.guess));
  UseThreads(options.threads);
  options.overlays = true;  // The photo is needed.
  const SolverSet solvers(options);
  ImageRun run = RunImage(options, &solvers, &image);
  Reconstruction made;
  status = ReconstructImage(options, model_options, &run, &made);
  if (!status.ok())
    return Refuse("circline_reconstruct", {status.code, image.path + ": " + status.message});
  status = WriteAll(run.photo, &made, model_options, options.output);
  if (!status.ok()) return Refuse("circline_reconstruct", status);
  std::cout << "model: " << options.output << "/model.glb\n";
  return kExitOk;
}

}  // namespace
}  // namespace circline::apps

int main(int argc, char** argv) {
  return circline::apps::RunApp(
      argc, argv, "circline_reconstruct", circline::apps::kUsage, circline::apps::Reconstruct,
      {"merge", "resume", "export_as", "save_options", "list_solvers", "overlays"});
}
