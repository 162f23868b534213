#include "apps/compare/image_run.h"

#include <algorithm>
#include <optional>

#include "apps/common/photo_file.h"
#include "apps/common/plugins.h"
#include "apps/common/text.h"
#include "apps/compare/other_planes.h"
#include "apps/compare/pixel_ellipse.h"
#include "apps/compare/record.h"
#include "circline/refine/refined_solvers.h"

namespace circline::apps {
namespace {

std::string SizeError(const cv::Mat& photo, const Camera& camera) {
  const bool differs = (camera.width > 0 && camera.width != photo.cols) ||
                       (camera.height > 0 && camera.height != photo.rows);
  if (!differs) return "";
  return "the photo has " + std::to_string(photo.cols) + " x " + std::to_string(photo.rows) +
         " pixels, the camera '" + camera.id + "' " + std::to_string(camera.width) + " x " +
         std::to_string(camera.height);
}

// What the scene says of a photo in which everything is detected: the frame and lengths in pixels
// hold; ids of planes mean nothing unless the detection happens to use them.
void CopyFrame(const Observations& scene, Observations* detected) {
  const FrameObservation& frame = scene.frame;
  if (!frame.plane.empty() && NamesPlane(*detected, frame.plane))
    detected->frame.plane = frame.plane;
  if (frame.origin) detected->frame.origin = frame.origin;
  if (frame.x_axis) detected->frame.x_axis = frame.x_axis;
  if (frame.y_axis) detected->frame.y_axis = frame.y_axis;
  detected->known_lengths = scene.known_lengths;
  for (KnownLength& length : detected->known_lengths) {
    if (!NamesPlane(*detected, length.plane)) length.plane.clear();
  }
}

void DetectAll(const CompareOptions& options, ImageRun* run) {
  const Stopwatch watch;
  DetectionOptions detection = options.detection;
  detection.noise_model.camera = options.structure_tells_focal
                                     ? CameraSigmaOf(options.losses.front().estimation, *run->image)
                                     : CameraSigma();
  const Status status = DetectObservations(run->photo, run->image->observations.camera, detection,
                                           &run->observations);
  run->stages.emplace_back("detect", watch.Microseconds());
  if (!status.ok()) run->read_error = status.message;
  CopyFrame(run->image->observations, &run->observations);
  SetLargestRadius(options.inputs.circle_radius, &run->observations);
  if (!run->observations.message.empty()) run->problems.push_back(run->observations.message);
}

void DetectInRois(const CompareOptions& options, ImageRun* run) {
  if (run->image->rois.empty()) return;
  const Stopwatch watch;
  for (const CircleRoi& roi : run->image->rois) {
    CircleObservation& circle = run->observations.circles[roi.circle];
    const cv::Rect rectangle(roi.rectangle[0], roi.rectangle[1], roi.rectangle[2],
                             roi.rectangle[3]);
    CircleObservation detected = circle;
    const Status status = DetectCircleInRoi(run->photo, run->observations.camera, rectangle,
                                            options.detection, &detected);
    if (status.ok()) {
      circle.points = std::move(detected.points);
      circle.normals = std::move(detected.normals);
    } else {
      run->problems.push_back("circle '" + circle.id + "': " + status.message);
    }
  }
  run->stages.emplace_back("detect", watch.Microseconds());
}

void Observe(const CompareOptions& options, ImageRun* run) {
  if (run->image->detect_everything) return DetectAll(options, run);  // Fits included.
  run->observations = run->image->observations;
  DetectInRois(options, run);
  const Stopwatch watch;
  FitOptions fit = options.fit;
  fit.noise_model.camera = CameraSigmaOf(options.losses.front().estimation, *run->image);
  const Status status = FitObservations(fit, &run->observations, &run->problems);
  run->stages.emplace_back("fit", watch.Microseconds());
  if (!status.ok()) run->problems.push_back(status.message);
}

// What a refinement with this loss is given: where the user says how noisy points are, that holds,
// and not what the detection measured.
const Observations& EvidenceFor(const LossSetting* loss, const ImageRun& image,
                                Observations* stated) {
  if (loss == nullptr || !image.image->detect_everything) return image.observations;
  const bool conic = loss->estimation.conic_loss.scale_px > 0.0;
  const bool line = loss->estimation.line_loss.scale_px > 0.0;
  if (!conic && !line) return image.observations;
  *stated = image.observations;
  for (CircleObservation& circle : stated->circles) circle.sigma_px *= conic ? 0.0 : 1.0;
  for (PencilObservation& pencil : stated->pencils) {
    if (!line) break;
    pencil.sigma_px = 0.0;
    for (LineObservation& observation : pencil.lines) observation.sigma_px = 0.0;
  }
  return *stated;
}

SolverRun RunSolver(const SolverSet::Task& task, const CompareOptions& options,
                    const ImageRun& image) {
  SolverRun run;
  run.solver = task.peer != nullptr ? task.peer->name : task.solver->name();
  run.stage = task.peer != nullptr ? task.peer->stage : task.solver->stage();
  if (task.loss >= 0) run.loss = &options.losses[static_cast<std::size_t>(task.loss)];
  Observations stated;
  const Observations& evidence = EvidenceFor(run.loss, image, &stated);
  const Stopwatch watch;
  run.estimate = task.peer != nullptr ? task.peer->Solve(*image.image, image.observations)
                                      : task.solver->Solve(evidence);
  run.microseconds = watch.Microseconds();
  for (const PoseHypothesis& hypothesis : run.estimate.hypotheses) {
    run.errors.push_back(ComparePose(hypothesis, *image.image));
  }
  return run;
}

// The options with what the scene file says of the image's camera.
CompareOptions WithCamera(CompareOptions options, const SceneImage& image) {
  for (LossSetting& loss : options.losses) {
    loss.estimation.camera_sigma = CameraSigmaOf(loss.estimation, image);
    options.closed_form.noise_model.camera = *loss.estimation.camera_sigma;
  }
  return options;
}

void ReadAndObserve(const CompareOptions& options, const cv::Mat* photo, SceneImage* image,
                    ImageRun* run) {
  if (photo != nullptr) {
    run->photo = *photo;
  } else if (options.overlays || image->detect_everything || !image->rois.empty()) {
    const Stopwatch watch;
    run->photo_file = StateOf(image->path);  // Before it is read: what is written later is news.
    run->read_error = ReadPhoto(image->path, &run->photo, options.max_megapixels);
    run->stages.emplace_back("read", watch.Microseconds());
  }
  if (!run->photo.empty()) {
    SetGuessedCamera(options, run->photo.size(), image);
    run->read_error = SizeError(run->photo, image->observations.camera);
  }
  if (run->read_error.empty()) Observe(options, run);
}

void RunSolvers(const CompareOptions& options, const SolverSet& solvers, ImageRun* run) {
  if (!run->read_error.empty()) return;
  const SceneImage& image = *run->image;
  std::optional<SolverSet> own_solvers;
  if (image.camera_sigma.IsAny() || image.guessed_sigma)
    own_solvers.emplace(WithCamera(options, image));
  for (const SolverSet::Task& task : (own_solvers ? *own_solvers : solvers).tasks()) {
    run->solvers.push_back(RunSolver(task, options, *run));
  }
  NoteOtherPlanes(&run->solvers);
}

}  // namespace

void SetGuessedCamera(const CompareOptions& options, cv::Size photo, SceneImage* image) {
  if (!options.inputs.guess.wanted) return;
  GuessedCamera guess = options.inputs.guess.ForPhoto(
      image->path, photo.width, photo.height, options.losses.front().estimation.noise_model.camera);
  image->observations.camera = std::move(guess.camera);
  image->guessed_sigma = guess.sigma;
  image->camera_from = std::move(guess.words);
}

int SetLargestRadius(double radius, Observations* observations) {
  if (!(radius > 0.0)) return -1;
  int largest = -1;
  double longest = 0.0;
  for (std::size_t i = 0; i < observations->circles.size(); ++i) {
    PixelEllipse pixel;
    if (!FitPixelEllipse(observations->circles[i], &pixel) || pixel.ellipse.a <= longest) continue;
    longest = pixel.ellipse.a;
    largest = static_cast<int>(i);
  }
  if (largest >= 0) observations->circles[static_cast<std::size_t>(largest)].radius = radius;
  return largest;
}

CameraSigma CameraSigmaOf(const EstimationOptions& options, const SceneImage& image) {
  if (image.guessed_sigma) return *image.guessed_sigma;
  StatedCameraSigma stated = image.camera_sigma;
  if (options.camera_sigma) {  // The flag's.
    stated.log_focal.reset();
    stated.doubtful_log_focal.reset();
  }
  return stated.OverCalibrated(
      options.camera_sigma.value_or(options.noise_model.SigmaOf(image.observations.camera)));
}

SolverSet::SolverSet(const CompareOptions& options) {
  for (const LossSetting& loss : options.losses) {
    SolverRegistry registry;
    AddClosedFormSolvers(&registry, options.closed_form);
    AddPluginSolvers(options.closed_form, &registry);
    AddRefinedSolvers(&registry, loss.estimation);
    registries_.push_back(std::move(registry));
  }
  const std::vector<std::string> names = options.solvers.empty() ? SolverNames() : options.solvers;
  for (const std::string& name : names) {
    const Solver* closed_form = registries_.front().Find(name, SolverStage::kClosedForm);
    if (closed_form != nullptr) tasks_.push_back({closed_form, nullptr, -1});
    for (std::size_t k = 0; k < registries_.size(); ++k) {
      const Solver* refined = registries_[k].Find(name, SolverStage::kRefined);
      if (refined != nullptr) tasks_.push_back({refined, nullptr, static_cast<int>(k)});
    }
  }
  if (options.peers) peers_ = PeerSolvers();
  for (const PeerSolver& peer : peers_) tasks_.push_back({nullptr, &peer, -1});
}

ImageRun RunImage(const CompareOptions& options, const SolverSet* solvers, SceneImage* image,
                  const cv::Mat* photo) {
  ImageRun run;
  run.image = image;
  try {
    ReadAndObserve(options, photo, image, &run);
    if (solvers != nullptr) RunSolvers(options, *solvers, &run);
  } catch (const std::exception& error) {  // Such as a photo too large for the memory.
    run.read_error = "cannot be worked on: " + Words(error);
    std::replace(run.read_error.begin(), run.read_error.end(), '\n', ' ');
    run.solvers.clear();
  }
  return run;
}

std::vector<SolverKey> SolverSet::Keys(const CompareOptions& options) const {
  std::vector<SolverKey> keys;
  for (const Task& task : tasks_) {
    const bool peer = task.peer != nullptr;
    SolverKey key{peer ? task.peer->name : task.solver->name(),
                  SolverStageName(peer ? task.peer->stage : task.solver->stage()), "", 0.0};
    if (task.loss >= 0) {
      const LossSetting& loss = options.losses[static_cast<std::size_t>(task.loss)];
      key.loss = loss.loss;
      key.scale_px = loss.scale_px;
    }
    keys.push_back(std::move(key));
  }
  return keys;
}

std::array<int, 4> SolverRun::Rank() const {
  const PoseHypothesis& first = estimate.hypotheses.front();
  return ShowRank(solver, loss != nullptr, first.probability, first.num_observations);
}

}  // namespace circline::apps
