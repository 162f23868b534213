// circline_calibrate: the camera from a handful of photos of circles and parallel lines.
#include <gflags/gflags.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>
#include <optional>

#include "apps/calibrate/calibrate_options.h"
#include "apps/calibrate/calibration_files.h"
#include "apps/calibrate/import_model.h"
#include "apps/common/colmap_file.h"
#include "apps/common/flags_util.h"
#include "apps/common/in_parallel.h"
#include "apps/common/output_file.h"
#include "apps/common/progress.h"
#include "apps/common/written_files.h"
#include "apps/compare/encode.h"
#include "apps/compare/image_run.h"
#include "apps/compare/overlay.h"
#include "circline/refine/adjust_photos.h"

DECLARE_string(scene);

namespace circline::apps {
namespace {

constexpr char kUsage[] =
    "circline_calibrate: the camera from a handful of photos of circles and parallel lines.\n"
    "\n"
    "  circline_calibrate --images='photos/*.jpg' --output=out    # nothing known\n"
    "  circline_calibrate --scene=set/scene.yaml --output=out     # annotated\n"
    "  circline_calibrate --images='photos/*.jpg' --import=sparse/0 --circle_radius=0.1 "
    "--output=out\n"
    "                                                # scale and axes for a model of COLMAP's\n"
    "\n"
    "Writes calibration.yml (for OpenCV and --camera), calibration.json, cameras.txt and\n"
    "images.txt (COLMAP), scene.yaml (the scene with the estimated cameras) and report.html; with\n"
    "--import landmarks.json and transform.txt, too. Flags for inputs, detection and losses are\n"
    "those of circline_compare.\n"
    "Exit code 0: done; 1: some photo could not be read, or no camera came out; 2: unusable flags "
    "or scene file.";

// Of another model a camera has another distortion; one that comes with poses is what it is.
void SetModel(const CalibrateOptions& options, Camera* camera) {
  if (!options.import.empty()) return;
  const bool has_none = camera->model == CameraModel::kPinhole;
  const CameraModel model = options.model.value_or(has_none ? CameraModel::kOpenCV : camera->model);
  if (model != camera->model) camera->distortion = {};
  camera->model = model;
}

// What is known of an image's camera before.
CameraSigma PriorOf(const CalibrateOptions& options, const SceneImage& image,
                    const Camera& camera) {
  const EstimationOptions& estimation = options.compare.losses.front().estimation;
  CameraSigma sigma =
      image.camera_sigma.Over(options.compare.inputs.guess.stated.Over(UnknownCamera(camera)));
  if (image.guessed_sigma) sigma.log_focal = image.guessed_sigma->LargestLogFocal();
  if (estimation.camera_sigma) sigma.log_focal = estimation.camera_sigma->log_focal;
  if (options.fix_principal_point) sigma.principal_point_px = 0.0;
  if (options.aspect_sigma) sigma.log_aspect = *options.aspect_sigma;
  return sigma;
}

// The photos, each read and observed, on all threads.
std::vector<ImageRun> ObserveAll(const CalibrateOptions& options, std::vector<SceneImage>* images) {
  std::vector<ImageRun> runs(images->size());
  Progress progress("photos", static_cast<int>(images->size()), 0);
  InParallel(images->size(), [&](std::size_t i) {
    ImageRun& run = runs[i];
    SceneImage& image = (*images)[i];
    // The camera that comes with photos is what is to be found: no better known where they are
    // looked at than where they are adjusted.
    const bool is_to_be_found =
        options.import.empty() && !options.compare.inputs.guess.wanted && !image.guessed_sigma;
    if (is_to_be_found) image.guessed_sigma = PriorOf(options, image, image.observations.camera);
    run = RunImage(options.compare, nullptr, &image);
    if (is_to_be_found) image.guessed_sigma.reset();  // What the scene file says holds.
    Camera& camera = run.observations.camera;
    // Not the one that the photo alone makes likeliest: the prior is about the one given.
    camera = image.observations.camera;
    run.observations.stated_focal_px = run.observations.found_k1 = 0.0;
    if (camera.width == 0) camera.width = run.photo.cols;
    if (camera.height == 0) camera.height = run.photo.rows;
    run.photo.release();
    progress.Advance();
  });
  return runs;
}

struct Calibration {
  std::vector<Observations> photos;
  std::vector<std::string> names;   // Of the photos.
  std::vector<SceneImage> images;   // Of the photos.
  std::vector<std::string> errors;  // Photos that could not be read.
  AdjustedPhotos adjusted;
};

// Of a camera that is only guessed photos may have any size: those of another one are another
// camera's.
void SetApartBySize(const std::map<std::string, Camera>& given, Camera* camera) {
  const auto same = given.find(camera->id);
  if (same == given.end() ||
      (same->second.width == camera->width && same->second.height == camera->height)) {
    return;
  }
  camera->id += "_" + std::to_string(camera->width) + "x" + std::to_string(camera->height);
}

// `given`: the cameras as they came, by id; filled where they are not in it.
Status CalibrateOnce(CalibrateOptions* options, const GivenPoses& poses,
                     std::vector<SceneImage>* images, std::map<std::string, Camera>* given,
                     Calibration* calibration) {
  *calibration = Calibration();
  options->adjust.given_poses.clear();
  std::vector<ImageRun> runs = ObserveAll(*options, images);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (!runs[i].read_error.empty()) {
      calibration->errors.push_back((*images)[i].path + ": " + runs[i].read_error);
      continue;
    }
    Observations& photo = calibration->photos.emplace_back(std::move(runs[i].observations));
    SetModel(*options, &photo.camera);
    SetApartBySize(*given, &photo.camera);
    (*images)[i].observations.camera.id = photo.camera.id;
    const bool is_new = given->count(photo.camera.id) == 0;
    if (is_new && !(*images)[i].camera_from.empty())
      SayOnStderr("camera '" + photo.camera.id + "': " + (*images)[i].camera_from);
    photo.camera = given->insert({photo.camera.id, photo.camera}).first->second;
    options->adjust.camera_sigma[photo.camera.id] = PriorOf(*options, (*images)[i], photo.camera);
    const auto pose = poses.find((*images)[i].index);
    if (pose != poses.end()) options->adjust.given_poses.emplace_back(pose->second);
    calibration->names.push_back((*images)[i].name);
    calibration->images.push_back((*images)[i]);
  }
  if (calibration->photos.empty()) return Status::Failed("no photo could be read");
  std::optional<Progress> progress;
  std::string stage;
  options->adjust.progress = [&](const char* what, int done, int total) {
    if (what != stage) progress.emplace(what, total, 0);
    stage = what;
    if (done > 0) progress->Advance();
  };
  calibration->adjusted = AdjustPhotos(calibration->photos, options->adjust);
  options->adjust.progress = nullptr;
  return calibration->adjusted.status;
}

bool AnyIsWide(const std::map<std::string, CameraSigma>& sigmas) {
  return std::any_of(sigmas.begin(), sigmas.end(),
                     [](const auto& sigma) { return sigma.second.IsWide(); });
}

// What belongs together on a photo is judged through its camera: photos in which everything is
// detected are looked at again through the camera that they have led to.
Status CalibrateInPasses(CalibrateOptions* options, const GivenPoses& poses,
                         std::vector<SceneImage>* images, Calibration* calibration) {
  constexpr int kPasses = 3;
  constexpr double kSame = 0.02;  // Of log f.
  std::map<std::string, Camera> given;
  const bool detects = std::any_of(images->begin(), images->end(),
                                   [](const SceneImage& image) { return image.detect_everything; });
  for (int pass = 0;; ++pass) {
    // At first what belongs together is judged where each photo makes the focal length likeliest,
    // afterwards where all do; cameras that come with poses are known.
    options->compare.structure_tells_focal = pass == 0 && poses.empty();
    const Status status = CalibrateOnce(options, poses, images, &given, calibration);
    if (!status.ok() || !detects || !poses.empty() || pass + 1 == kPasses) return status;
    // At first each photo may have been seen through a focal length of its own.
    bool same = pass > 0 || !AnyIsWide(options->adjust.camera_sigma);
    std::map<std::string, Camera> found;
    for (const AdjustedCamera& made : calibration->adjusted.cameras)
      found[made.camera.id] = made.camera;
    for (SceneImage& image : *images) {
      Camera& camera = image.observations.camera;
      const auto now = found.find(camera.id);
      if (now == found.end()) continue;
      same = same && std::abs(std::log(now->second.fx / camera.fx)) < kSame;
      camera = now->second;
    }
    if (same) return status;
    options->compare.inputs.guess = CameraGuess();  // It has served.
  }
}

Status Import(CalibrateOptions* options, std::vector<SceneImage>* images, GivenPoses* poses) {
  std::vector<std::string> notes;
  const CameraSigma sigma = options->adjust.noise_model.camera;
  const Status status = ImportModel(options->import, sigma, images, poses, &notes);
  for (const std::string& note : notes) SayOnStderr(note);
  options->compare.inputs.guess.wanted = false;
  options->adjust.num_radial = 0;  // Distortion is the model's.
  return status;
}

// Scale, axes and planes of an imported model.
Status FinishImport(const CalibrateOptions& options, const Calibration& calibration) {
  std::vector<std::string> notes;
  const std::vector<WorldPlane> planes =
      PlanesOf(calibration.photos, options.adjust, calibration.adjusted, &notes);
  for (const std::string& note : notes) SayOnStderr(note);
  std::cout << LandmarkTable(calibration.adjusted, planes);
  return WriteLandmarks(calibration.adjusted, planes, options.compare.output);
}

// Photos to show, left-out ones first, the others evenly spread.
std::vector<std::size_t> ChoosePhotos(const AdjustedPhotos& adjusted) {
  constexpr std::size_t kMost = 24;
  std::vector<std::size_t> chosen, others;
  for (std::size_t i = 0; i < adjusted.photos.size(); ++i)
    (adjusted.photos[i].status.ok() ? others : chosen).push_back(i);
  chosen.resize(std::min(chosen.size(), kMost / 2));
  const std::size_t step = 1 + others.size() / (kMost - chosen.size() + 1);
  for (std::size_t k = 0; k < others.size(); k += step) chosen.push_back(others[k]);
  return chosen;
}

// JPEG, by photo: those left out and as many others as a page bears, seen anew through the camera
// that was estimated; empty for the others, and where there is nothing to look at, which is said on
// stderr. `images`: of the photos.
std::vector<std::string> CalibrationPictures(const CompareOptions& options,
                                             const AdjustedPhotos& adjusted,
                                             const std::vector<SceneImage>& images) {
  constexpr int kWidth = 720;  // Pixels.
  CompareOptions joint = options;
  joint.solvers = {"joint"};
  joint.overlays = true;
  joint.inputs.guess = CameraGuess();
  // Seen through the camera that was estimated, whatever was known of it before.
  joint.closed_form.noise_model.camera = CameraSigma();
  for (LossSetting& loss : joint.losses)
    loss.estimation.camera_sigma = loss.estimation.noise_model.camera = CameraSigma();
  const SolverSet solvers(joint);
  const std::vector<std::size_t> chosen = ChoosePhotos(adjusted);
  std::vector<std::string> pictures(images.size()), errors(images.size());
  InParallel(chosen.size(), [&](std::size_t k) {
    const std::size_t i = chosen[k];
    SceneImage image = images[i];
    const AdjustedCamera& made =
        adjusted.cameras[static_cast<std::size_t>(adjusted.photos[i].camera)];
    image.observations.camera = made.camera;
    image.camera_sigma = StatedCameraSigma();
    image.guessed_sigma.reset();
    const ImageRun run = RunImage(joint, &solvers, &image);
    errors[i] = run.read_error;
    if (!run.photo.empty()) pictures[i] = EncodeJpeg(DrawOverlay(run), kWidth);
  });
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (errors[i].empty()) continue;
    SayOnStderr(images[i].path + ": " + errors[i] + "; no picture of it, its evidence counts");
  }
  return pictures;
}

// Nothing that is read is written over.
Status CheckKept(const CalibrateOptions& options, const ImageSet& images) {
  const std::vector<std::string> written = {
      "calibration.yml", "calibration_*.yml", "calibration.json", "cameras.txt",
      "images.txt",      "points3D.txt",      "scene.yaml",       "report.html",
      "landmarks.json",  "transform.txt"};
  const std::string& output = options.compare.output;
  Status status = CheckInputsKept(images, output, written);
  if (status.ok() && !options.import.empty())
    status = WrittenFiles(output, written).CheckKept(FilesOfColmapModel(options.import));
  return status;
}

int Calibrate() {
  CalibrateOptions options;
  ImageSet set;
  Status status = CalibrateOptionsFromFlags(&options);
  if (status.ok()) status = ImagesFromFlags(options.compare.inputs, &set);
  if (!status.ok()) return Refuse("circline_calibrate", status);
  if (!set.rigid().empty()) RigidWorldFromName(set.rigid(), &options.adjust.rigid);
  status = CheckKept(options, set);
  if (!status.ok()) return Refuse("circline_calibrate", status);
  std::vector<SceneImage> images;
  for (std::size_t i = 0; i < set.size(); ++i) images.push_back(set.At(i));
  GivenPoses poses;
  if (!options.import.empty()) status = Import(&options, &images, &poses);
  if (!status.ok()) return Refuse("circline_calibrate", status);
  if (options.compare.inputs.guess.wanted) SayOnStderr(DescribeGuess(options.compare.inputs.guess));
  const bool with_pictures = options.compare.overlays;
  options.compare.overlays = false;  // Photos are read for detection only.
  for (SceneImage& image : images) SetModel(options, &image.observations.camera);
  Calibration calibration;
  status = CalibrateInPasses(&options, poses, &images, &calibration);
  for (const std::string& error : calibration.errors) SayOnStderr(error);
  if (!status.ok()) return Refuse("circline_calibrate", status);
  std::string note;
  status = CreateFolder(options.compare.output);
  if (status.ok()) {
    RemoveEarlierCalibration(options.compare.output);
    std::vector<std::string> pictures;
    if (with_pictures)
      pictures = CalibrationPictures(options.compare, calibration.adjusted, calibration.images);
    status = WriteCalibration(calibration.adjusted, calibration.photos, calibration.names, pictures,
                              options.compare.output, &note);
  }
  if (status.ok()) {
    status = WriteCalibratedScene(FLAGS_scene, calibration.adjusted, images,
                                  options.compare.output + "/scene.yaml");
  }
  if (status.ok() && calibration.adjusted.given) status = FinishImport(options, calibration);
  if (!status.ok()) return Refuse("circline_calibrate", status);
  std::cout << CalibrationTable(calibration.adjusted, calibration.names) << note;
  return calibration.errors.empty() ? kExitOk : kExitUnreadable;
}

}  // namespace
}  // namespace circline::apps

int main(int argc, char** argv) {
  // All photos count, in one adjustment of its own.
  return circline::apps::RunApp(argc, argv, "circline_calibrate", circline::apps::kUsage,
                                circline::apps::Calibrate,
                                {"merge", "plugin", "resume", "solvers", "peers", "export_as",
                                 "save_options", "list_solvers", "conic_distance"});
}
