#include "apps/track/track_run.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "apps/common/document.h"
#include "apps/common/flags_util.h"
#include "apps/common/output_file.h"
#include "apps/common/pose_error.h"
#include "apps/common/progress.h"
#include "apps/compare/export.h"
#include "apps/compare/overlay.h"
#include "apps/compare/record_files.h"
#include "apps/compare/results.h"
#include "apps/track/frame_observer.h"
#include "apps/track/overlay_video.h"

namespace circline::apps {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSolver = "track";

// One line a frame: that of the best hypothesis, with what only a track has.
std::string TrackLine(const std::string& best_line, const Frame& frame, const TrackedPose& pose,
                      bool cold) {
  Json line = Json::parse(best_line);
  line["frame"] = frame.index;
  line["time_s"] = frame.time_s;
  line["reinitialized"] = pose.reinitialized;
  line["relocalized"] = pose.relocalized;
  line["predicted_only"] = pose.predicted_only;
  line["cold"] = cold;
  line["num_hypotheses"] = pose.estimate.hypotheses.size();
  line["hypotheses"] = Json::array();
  for (const PoseHypothesis& h : pose.estimate.hypotheses) {
    line["hypotheses"].push_back({{"probability", h.probability},
                                  {"rotation", JsonNumbers(h.cam_from_world.rotation)},
                                  {"translation", JsonNumbers(h.cam_from_world.translation)}});
  }
  return JsonText(line) + "\n";
}

// Squared error of the rotation in standard deviations, by its degrees of freedom (3; 2 where only
// the normal is known): 1 on average. The truth is the nearest of what the evidence cannot tell
// apart. Absent without a truth, or where more than the turn about the normal is free.
std::optional<double> RotationNees(const PoseHypothesis& hypothesis, const SceneImage& image) {
  using Eigen::Matrix3d;
  using Eigen::Vector3d;
  if (!image.truth || !image.truth->rotation || !SigmaNormalDeg(hypothesis)) return std::nullopt;
  const Matrix3d &truth = *image.truth->rotation, &estimate = hypothesis.cam_from_world.rotation;
  const Vector3d normal = estimate.col(2);
  const bool normal_only = hypothesis.RotationIsFree() || image.truth->symmetry == Symmetry::kAxis;
  Vector3d error = Vector3d::Constant(1e9);  // Camera frame, radians.
  Matrix3d covariance = hypothesis.Covariance().topLeftCorner<3, 3>();
  if (normal_only) {  // Up to sign, and nothing of the turn about it.
    const double sign = truth.col(2).dot(normal) < 0.0 ? -1.0 : 1.0;
    error = LogRotation(
        Eigen::Quaterniond::FromTwoVectors(normal, sign * truth.col(2)).toRotationMatrix());
    const Matrix3d across = Matrix3d::Identity() - normal * normal.transpose();
    covariance = across * covariance * across;
  } else {
    for (const Matrix3d& same : SymmetryGroup(image.truth->symmetry)) {
      const Vector3d turn = LogRotation(truth * same * estimate.transpose());
      if (turn.norm() < error.norm()) error = turn;
    }
  }
  const int degrees = normal_only ? 2 : 3;
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(covariance);
  // Eigenvalues ascend: what is free comes first.
  const Eigen::ArrayXd variances = eigen.eigenvalues().tail(degrees);
  const Eigen::ArrayXd along = eigen.eigenvectors().rightCols(degrees).transpose() * error;
  if (!(variances > 0.0).all()) return std::nullopt;
  return (along.square() / variances).sum() / degrees;
}

class Track {
 public:
  Track(const TrackOptions& options, FrameSource* source)
      : options_(options),
        source_(*source),
        observer_(options),
        writer_(options.compare.output, {}) {
    if (!options.video_out.empty())
      video_.emplace(options.compare.output, options.video_out, source->fps());
  }

  Status Run(std::vector<TrackedFrame>* frames) {
    Status status = writer_.Append({});  // Names a file that cannot be written before the work.
    Progress progress("frames", source_.num_frames());
    Frame frame;
    while (status.ok() && source_.Next(&frame)) {
      frames->emplace_back();
      status = Work(&frame, &frames->back());
      const TrackedFrame& done = frames->back();
      if (!done.error.empty()) {
        progress.Clear();
        SayOnStderr(done.name + ": " + done.error);
      }
      if (source_.num_frames() > 0) progress.Advance();
    }
    std::string note;
    if (status.ok()) status = ExportPoses("tum", trajectory_, options_.compare.output, &note);
    if (status.ok() && video_) status = video_->Commit();
    return status;
  }

 private:
  Status Work(Frame* frame, TrackedFrame* tracked) {
    const std::optional<PoseHypothesis> expected =
        tracker_ ? tracker_->Predict(frame->time_s) : std::nullopt;
    ImageRun run =
        observer_.Observe(last_ ? &*last_ : nullptr, expected ? &*expected : nullptr, frame);
    TrackedPose pose = Update(*frame, &run);
    Keep(*frame, run, pose, tracked);
    const Status status = Draw(&run, tracked);
    return status.ok() ? Write(*frame, run, pose, *tracked) : status;
  }

  // The frame's pose, and the run with it as its only answer.
  TrackedPose Update(const Frame& frame, ImageRun* run) {
    TrackedPose pose;
    pose.timestamp_s = frame.time_s;
    const Stopwatch watch;
    if (run->read_error.empty()) {
      if (!tracker_) {
        TrackerOptions options = options_.tracker;
        options.estimation.camera_sigma = CameraSigmaOf(options.estimation, frame.image);
        tracker_.emplace(options);
      }
      // Another scene: another world. A time that runs backwards is for the tracker to refuse.
      if (observer_.was_cut() && frame.time_s > last_s_) tracker_->Reset();
      last_s_ = std::max(last_s_, frame.time_s);
      pose = tracker_->Update(run->observations, frame.time_s);
      if (pose.reinitialized && !observer_.was_cut() &&
          observer_.SettleRadius(&run->observations)) {
        tracker_->Reset();  // The new world has its unit from another circle.
        pose = tracker_->Update(run->observations, frame.time_s);
      }
      if (pose.estimate.status.code == StatusCode::kInvalidArgument)
        run->read_error = pose.estimate.status.message;  // Such as a time that runs backwards.
    } else {
      pose.estimate.status = Status::Failed(run->read_error);
    }
    // Where nothing was seen features are expected where they were: a prediction of predictions
    // drifts off.
    last_.reset();
    if (!pose.estimate.hypotheses.empty() && !pose.predicted_only)
      last_ = pose.estimate.hypotheses.front();
    SolverRun solver;
    solver.solver = kSolver;
    solver.stage = SolverStage::kRefined;
    solver.loss = &options_.compare.losses.front();
    solver.microseconds = watch.Microseconds();
    solver.estimate = pose.estimate;
    for (const PoseHypothesis& hypothesis : pose.estimate.hypotheses)
      solver.errors.push_back(ComparePose(hypothesis, *run->image));
    run->solvers.push_back(std::move(solver));
    return pose;
  }

  void Keep(const Frame& frame, const ImageRun& run, const TrackedPose& pose,
            TrackedFrame* tracked) {
    tracked->name = frame.image.name;
    tracked->time_s = frame.time_s;
    tracked->error = run.read_error;
    tracked->message = pose.estimate.status.message;
    tracked->reinitialized = pose.reinitialized;
    tracked->predicted_only = pose.predicted_only;
    tracked->cold = observer_.was_cold();
    for (const auto& [stage, microseconds] : run.stages) tracked->observe_us += microseconds;
    tracked->track_us = run.solvers.front().microseconds;
    if (pose.estimate.hypotheses.empty()) return;
    const PoseHypothesis& best = pose.estimate.hypotheses.front();
    tracked->has_pose = true;
    for (const PoseHypothesis& h : pose.estimate.hypotheses)
      tracked->probabilities.push_back(h.probability);
    tracked->rotation = best.cam_from_world.rotation;
    tracked->center = -(tracked->rotation.transpose() * best.cam_from_world.translation);
    tracked->sigma_deg = SigmaNormalDeg(best);
    tracked->error_deg = run.solvers.front().errors.front().Headline();
    tracked->nees = RotationNees(best, frame.image);
    trajectory_.push_back({frame.image.name, frame.index, run.observations.camera,
                           best.cam_from_world, frame.time_s});
  }

  Status Draw(ImageRun* run, TrackedFrame* tracked) {
    if (!options_.compare.overlays) return Status::Ok();
    cv::Mat picture;
    Status status = WriteOverlay(options_.compare.output, run, &tracked->overlay, &picture);
    if (status.ok() && video_ && !picture.empty()) status = video_->Add(picture);
    return status;
  }

  Status Write(const Frame& frame, ImageRun& run, const TrackedPose& pose,
               const TrackedFrame& tracked) {
    SolverRun& solver = run.solvers.front();
    if (solver.estimate.hypotheses.size() > 1) {
      solver.estimate.hypotheses.resize(1);
      solver.errors.resize(1);
    }
    ImageLines lines = WriteLines(run, tracked.overlay, options_.compare.unusual_flags,
                                  options_.compare.fit.noise_model);
    lines.results = TrackLine(lines.results, frame, pose, tracked.cold);
    return writer_.Append(lines);
  }

  const TrackOptions& options_;
  FrameSource& source_;
  FrameObserver observer_;
  std::optional<PoseTracker> tracker_;
  double last_s_ = -std::numeric_limits<double>::infinity();  // Of the latest frame so far.
  std::optional<PoseHypothesis> last_;  // Of the frame before, if that saw it.
  RecordWriter writer_;
  std::vector<ExportedPose> trajectory_;
  std::optional<OverlayVideo> video_;
};

}  // namespace

Status RunTrack(const TrackOptions& options, FrameSource* source,
                std::vector<TrackedFrame>* frames) {
  return Track(options, source).Run(frames);
}

}  // namespace circline::apps
