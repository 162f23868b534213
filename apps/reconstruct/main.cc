// circline_reconstruct: from one photo a textured model of what it shows of its plane and of what
// stands on it, with measurements.
#include <gflags/gflags.h>

#include <cmath>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/common/flags_util.h"
#include "apps/common/output_file.h"
#include "apps/common/text.h"
#include "apps/compare/canvas.h"
#include "apps/compare/encode.h"
#include "apps/compare/image_run.h"
#include "apps/compare/options.h"
#include "apps/compare/overlay.h"
#include "apps/reconstruct/measurements.h"
#include "apps/reconstruct/model.h"
#include "apps/reconstruct/obj_file.h"

DEFINE_string(image, "",
              "Which image of the scene file, by its name there; the only one if empty.");
DEFINE_int32(hypothesis, 0, "Which pose, where several explain the photo; 0 = the most probable.");
DEFINE_int32(texture_px, circline::apps::ModelOptions().texture_px,
             "Longer side of the plane's texture, pixels; 16 to 8192.");
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
    "Writes model.obj, model.mtl and textures (Z is up), measurements.csv and views.png. The flags "
    "for inputs,\n"
    "detection and losses are those of circline_compare; its others have no meaning here.\n"
    "Exit code 0: done; 1: the photo could not be read or gives no pose; 2: unusable flags or "
    "scene file.";

Status ModelFromFlags(ModelOptions* options) {
  options->texture_px = FLAGS_texture_px;
  options->margin = FLAGS_margin;
  if (FLAGS_texture_px < 16 || FLAGS_texture_px > 8192) {
    return Status::Invalid("--texture_px must be between 16 and 8192");
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

// Side by side: the photo with what was found, and the plane seen from above.
cv::Mat Views(const ImageRun& run, const Model& model, const std::string& unit) {
  const Patch& plane = model.patches.front();
  cv::Mat left = DrawOverlay(run);
  cv::Mat right = Canvas(plane.texture)
                      .WithCaption("the plane, rectified", {FormatShort(plane.u.norm()) + " x " +
                                                            FormatShort(plane.v.norm()) + unit});
  const double scale = static_cast<double>(left.rows) / right.rows;
  cv::resize(right, right, cv::Size(static_cast<int>(right.cols * scale), left.rows), 0.0, 0.0,
             scale < 1.0 ? cv::INTER_AREA : cv::INTER_CUBIC);
  cv::Mat views;
  cv::hconcat(left, right, views);
  return views;
}

Status WriteAll(const ImageRun& run, const PoseHypothesis& hypothesis, const Model& model,
                const std::string& folder) {
  Camera camera = run.observations.camera;
  camera.width = run.photo.cols;
  camera.height = run.photo.rows;
  Status status = WriteObj(model, camera, hypothesis.cam_from_world, folder);
  if (!status.ok()) return status;
  const std::vector<MeasuredValue> measured =
      Measure(run.observations, hypothesis, model, FLAGS_point_sigma_px);
  status = WriteFile(folder + "/measurements.csv", MeasurementsCsv(measured));
  if (!status.ok()) return status;
  const std::vector<std::uint8_t> png =
      EncodePng(Views(run, model, hypothesis.metric ? "" : " distances to the origin"));
  return WriteFile(folder + "/views.png", std::string(png.begin(), png.end()));
}

// The pose to take of those that explain the photo.
Status ChoosePose(const ImageRun& run, const PoseHypothesis** hypothesis) {
  if (!run.read_error.empty()) return Status::Failed(run.read_error);
  const SolverRun* shown = RunToShow(run);
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
void SeeThrough(const Camera& camera, Observations* observations) {
  observations->camera = camera;
  for (CircleObservation& circle : observations->circles) circle.fit.reset();
  for (PencilObservation& pencil : observations->pencils) {
    pencil.fit.reset();
    for (LineObservation& line : pencil.lines) line.fit.reset();
  }
  FitDirect(FLAGS_point_sigma_px, observations);
}

int Refuse(const Status& status) {
  SayOnStderr("circline_reconstruct: " + status.message);
  return status.code == StatusCode::kInvalidArgument ? kExitUsage : kExitUnreadable;
}

int Reconstruct() {
  CompareOptions options;
  ModelOptions model_options;
  ImageSet images;
  SceneImage image;
  Status status = OptionsFromFlags(&options);
  if (status.ok()) status = ModelFromFlags(&model_options);
  if (status.ok()) status = ImagesFromFlags(options.inputs, &images);
  if (status.ok()) status = FindImage(images, &image);
  if (!status.ok()) return Refuse(status);
  if (options.inputs.guess.wanted) SayOnStderr(DescribeGuess(options.inputs.guess));
  options.overlays = true;  // The photo is needed.
  const SolverSet solvers(options);
  ImageRun run = RunImage(options, solvers, &image);
  const PoseHypothesis* hypothesis = nullptr;
  status = ChoosePose(run, &hypothesis);
  if (!status.ok()) return Refuse({status.code, image.path + ": " + status.message});
  if (hypothesis->camera) SeeThrough(*hypothesis->camera, &run.observations);
  const Model model = BuildModel(run.photo, run.observations, *hypothesis, model_options);
  if (model.patches.empty()) {
    return Refuse(Status::Refused(image.path + ": no evidence lies in the world's plane"));
  }
  status = CreateFolder(options.output);
  if (status.ok()) status = WriteAll(run, *hypothesis, model, options.output);
  if (!status.ok()) return Refuse(status);
  std::cout << "model: " << options.output << "/model.obj\n";
  return kExitOk;
}

}  // namespace
}  // namespace circline::apps

int main(int argc, char** argv) {
  return circline::apps::RunApp(argc, argv, "circline_reconstruct", circline::apps::kUsage,
                                circline::apps::Reconstruct);
}
