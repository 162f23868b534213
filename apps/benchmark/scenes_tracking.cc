// Trackers on simulated sequences: is the best hypothesis the right one, do probabilities come
// true, and are the poses as accurate as all frames so far allow?
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "apps/benchmark/scenes_experiments.h"
#include "apps/benchmark/tracking_bound.h"
#include "apps/benchmark/trajectory.h"
#include "apps/common/progress.h"
#include "apps/common/text.h"
#include "circline/refine/pose_tracker.h"
#include "tests/basics.h"

namespace circline::apps {
namespace {

constexpr int kFramesOfMotion = 30;  // Before the best hypothesis is held to account.
constexpr double kSureOfTrack = 0.95;

struct Setting {
  std::string name;
  TrajectoryOptions trajectory;
  bool odometry = false;
};

std::vector<Setting> Settings() {
  std::vector<Setting> settings(6);
  settings[0].name = "circle";
  settings[1].name = "circle, pencil";
  settings[1].trajectory.pencil = true;
  settings[2].name = "two circles";
  settings[2].trajectory.second_circle = true;
  settings[3].name = "two circles, fast turns";
  settings[3].trajectory.second_circle = true;
  settings[3].trajectory.turn_rate_sigma = 0.5;
  settings[3].trajectory.speed = 0.8;
  settings[3].trajectory.num_frames = 60;
  settings[4].name = "circle, odometry";
  settings[4].odometry = true;
  settings[5].name = "circle from afar";
  settings[5].trajectory.depth = 40.0;
  return settings;
}

TrackerOptions OptionsFor(const Setting& setting, LossType loss) {
  TrackerOptions options = ExactOptions(setting.trajectory);
  options.estimation.conic_loss.type = options.estimation.line_loss.type = loss;
  options.initial_turn_rate_sigma =
      std::max(options.initial_turn_rate_sigma, setting.trajectory.speed);
  options.initial_velocity_sigma =
      std::max(options.initial_velocity_sigma, setting.trajectory.speed);
  return options;
}

// The turn between two frames as a gyroscope has it.
MotionPrior Odometry(const CameraPose& before, const CameraPose& now, Random* random) {
  MotionPrior motion = Gyroscope(before, now);
  Eigen::Matrix3d& turn = motion.relative->now_from_before.rotation;
  turn = ExpRotation(Noise3(kGyroscopeSigma, random)) * turn;
  return motion;
}

// The circle's other pose has its normal mirrored at the line of sight, about.
bool IsRight(const CameraPose& truth, const PoseHypothesis& h, double sigma) {
  const double cosine = std::abs(truth.rotation.col(2).dot(truth.translation.normalized()));
  const double to_other = 2.0 * std::acos(std::min(1.0, cosine));
  constexpr double kSigmas = 5.0;
  return NormalError(truth, h) < std::max(kSigmas * sigma, 0.5 * to_other);
}

// Near the line of sight both poses are right. The bound is that of the one whose minimum the truth
// belongs to: the nearest.
bool IsNearest(const CameraPose& truth, const std::vector<PoseHypothesis>& hypotheses) {
  const double first = NormalError(truth, hypotheses.front());
  return std::all_of(hypotheses.begin(), hypotheses.end(),
                     [&](const PoseHypothesis& h) { return NormalError(truth, h) >= first; });
}

struct Score {
  int frames = 0, right = 0, can_tell = 0, right_where_told = 0, sure_wrong = 0, predicted = 0,
      restarts = 0;
  double expected_wrong = 0.0;  // By the probabilities of the first hypotheses.
  // Of the first hypothesis where it is right, none is nearer, and in the map of the first frame.
  double squared = 0.0, bound = 0.0, nees = 0.0;
  int measured = 0;
};

// Natural logarithm of the odds that a frame without noise gives the right hypothesis: half the
// squared distance of the two in standard deviations, d^2 / 2, of which noise makes the wrong one
// more probable once in 1 / Phi(-d / 2) sequences: here less than once in 100.
constexpr double kCanTell = 11.0;

bool CanTell(const CameraPose& truth, const std::vector<PoseHypothesis>& without_noise,
             double sigma) {
  double right = 0.0, others = 0.0;
  for (const PoseHypothesis& h : without_noise)
    (IsRight(truth, h, sigma) ? right : others) += h.probability;
  return right > 0.0 && std::log(right) > std::log(others) + kCanTell;
}

// The error of the normal against the bound and the stated covariance.
void Measure(const CameraPose& truth, const PoseHypothesis& first, double sigma, Score* score) {
  const Eigen::Vector3d normal = first.cam_from_world.rotation.col(2);
  const Eigen::Matrix<double, 2, 3> across = truth.rotation.leftCols<2>().transpose();
  const Eigen::Vector2d error = across * normal;
  // d n = delta x n: components along the world's X and Y.
  const Eigen::Matrix<double, 2, 3> J = -across * CrossMatrix(normal);
  const Eigen::Matrix2d covariance = J * first.Covariance().topLeftCorner<3, 3>() * J.transpose();
  score->squared += error.squaredNorm();
  score->bound += sigma * sigma;
  score->nees += error.dot(covariance.inverse() * error);
  ++score->measured;
}

void RunSequence(const Setting& setting, LossType loss, std::uint64_t seed, Score* score) {
  const Trajectory sequence(setting.trajectory, seed);
  const TrackerOptions options = OptionsFor(setting, loss);
  Random noise(seed + 1000003), motion_noise(seed + 2000003);
  PoseTracker tracker(options), ideal(options);
  TrackingBound bound(sequence, options);
  bool world_is_first = true;
  for (std::size_t k = 0; k < sequence.frames.size(); ++k) {
    const Trajectory::Frame& frame = sequence.frames[k];
    const double time = static_cast<double>(k) / setting.trajectory.fps;
    MotionPrior motion;
    if (setting.odometry && k > 0)
      motion = Odometry(sequence.frames[k - 1].pose, frame.pose, &motion_noise);
    const TrackedPose tracked = tracker.Update(sequence.Observe(frame, &noise), time, motion);
    const TrackedPose without_noise = ideal.Update(sequence.Observe(frame, nullptr), time, motion);
    const double sigma = bound.Advance(k);
    if (!tracked.estimate.status.ok()) continue;
    const std::vector<PoseHypothesis>& hypotheses = tracked.estimate.hypotheses;
    const PoseHypothesis& first = hypotheses.front();
    const bool is_right = IsRight(frame.pose, first, sigma);
    const bool is_restart = k > 0 && tracked.reinitialized;
    world_is_first = world_is_first && !is_restart;
    score->restarts += is_restart ? 1 : 0;
    score->predicted += tracked.predicted_only && !frame.is_occluded ? 1 : 0;
    score->expected_wrong += 1.0 - first.probability;
    score->sure_wrong += !is_right && first.probability >= kSureOfTrack ? 1 : 0;
    ++score->frames;
    score->right += is_right ? 1 : 0;
    if (k < kFramesOfMotion) continue;
    if (CanTell(frame.pose, without_noise.estimate.hypotheses, sigma)) {
      ++score->can_tell;
      score->right_where_told += is_right ? 1 : 0;
    }
    if (is_right && IsNearest(frame.pose, hypotheses) && !setting.odometry && world_is_first)
      Measure(frame.pose, first, sigma, score);
  }
}

void Print(const std::string& name, const Score& s) {
  const auto percent = [](double part, int all) {
    return all > 0 ? FormatFixed(100.0 * part / all, 2) : std::string("-");
  };
  const bool measured = s.measured > 0;
  std::printf("  %-24s %7d %7s %8d %8s %9s %9s %9d %8d %9s %6s\n", name.c_str(), s.frames,
              percent(s.right, s.frames).c_str(), s.can_tell,
              percent(s.right_where_told, s.can_tell).c_str(),
              percent(s.sure_wrong, s.frames).c_str(), percent(s.expected_wrong, s.frames).c_str(),
              s.predicted, s.restarts,
              measured ? FormatFixed(std::sqrt(s.squared / s.bound), 3).c_str() : "-",
              measured ? FormatFixed(s.nees / s.measured, 2).c_str() : "-");
}

}  // namespace

void RunTracking(const ExperimentOptions& options) {
  const int trials = options.Trials(40);
  for (const LossType loss : options.Losses({LossType::kTrivial})) {
    for (const double noise : options.Noises({2.0})) {
      std::printf("Tracking, noise %s px, loss %s, 20 %% of frames occluded\n",
                  FormatPlain(noise).c_str(), LossName(loss));
      std::printf("  %-24s %7s %7s %8s %8s %9s %9s %9s %8s %9s %6s\n", "scene", "frames", "right%",
                  "can tell", "right%", "sure+wr.%", "exp.wr.%", "contrad.", "restarts",
                  "rms/bound", "NEES 2");
      for (const Setting& given : Settings()) {
        Setting setting = given;
        setting.trajectory.noise_px = noise;
        Score score;
        Progress progress(setting.name, trials);
        for (int trial = 0; trial < trials; ++trial) {
          Random seeds = options.TrialRandom(9, trial);
          RunSequence(setting, loss, seeds.Next(), &score);
          progress.Advance();
        }
        progress.Clear();
        Print(setting.name, score);
      }
      std::printf("\n");
    }
  }
}

}  // namespace circline::apps
