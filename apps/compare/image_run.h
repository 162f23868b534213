// One photo through all solvers.
#ifndef CIRCLINE_APPS_COMPARE_IMAGE_RUN_H_
#define CIRCLINE_APPS_COMPARE_IMAGE_RUN_H_

#include <array>
#include <chrono>
#include <opencv2/core.hpp>
#include <string>
#include <utility>
#include <vector>

#include "apps/common/pose_error.h"
#include "apps/common/scene.h"
#include "apps/compare/options.h"
#include "apps/compare/peers.h"
#include "apps/compare/record.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/solver_registry.h"

namespace circline::apps {

// The solvers to run, in the order in which results are written: by name, the closed form before
// its refinements with each loss. Immutable once made; many threads may use it.
class SolverSet {
 public:
  struct Task {
    const Solver* solver;    // One of ours, or
    const PeerSolver* peer;  // one of others.
    int loss;  // Index in CompareOptions::losses; -1 for closed forms, which have none.
  };
  explicit SolverSet(const CompareOptions& options);
  SolverSet(const SolverSet&) = delete;
  SolverSet& operator=(const SolverSet&) = delete;
  const std::vector<Task>& tasks() const { return tasks_; }
  std::vector<SolverKey> Keys(const CompareOptions& options) const;  // Of tasks().

 private:
  std::vector<SolverRegistry> registries_;  // One for each loss; they own the solvers.
  std::vector<PeerSolver> peers_;
  std::vector<Task> tasks_;
};

class Stopwatch {
 public:
  double Microseconds() const {
    return std::chrono::duration<double, std::micro>(Clock::now() - start_).count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

struct SolverRun {
  std::string solver;
  SolverStage stage = SolverStage::kClosedForm;
  const LossSetting* loss = nullptr;  // Null for closed forms.
  PoseEstimate estimate;
  std::vector<PoseErrors> errors;  // One for each hypothesis.
  double microseconds = 0.0;

  bool HasAnswer() const { return estimate.status.ok() && !estimate.hypotheses.empty(); }
  const std::string& name() const { return solver; }
  std::array<int, 4> Rank() const;  // ShowRank of its answer.
};

struct ImageRun {
  const SceneImage* image = nullptr;
  std::string read_error;  // Not empty: the photo could not be used, and nothing else is filled.
  cv::Mat photo;           // May be empty where nothing needed it.
  FileState photo_file;    // As it was read.
  Observations observations;
  std::vector<std::string> problems;  // What could not be fitted or detected, a sentence each.
  std::vector<SolverRun> solvers;
  std::vector<std::pair<std::string, double>>
      stages;  // "read", "detect", "fit", "overlay"; microseconds.
};

// The camera of a photo that has no calibration, where the flags want a guess.
void SetGuessedCamera(const CompareOptions& options, cv::Size photo, SceneImage* image);

// How well an image's camera is known: a guess says so itself; else as --focal_sigma says, else the
// scene file, else the noise model.
CameraSigma CameraSigmaOf(const EstimationOptions& options, const SceneImage& image);

// Everything in the photo detected or fitted, and all solvers run; null: none. `photo`: where it is
// at hand (empty where nothing is to be detected in it), else it is read if need be. A camera that
// is only guessed gets its focal length from the size of the photo. Never throws. Image and solvers
// outlive the result.
ImageRun RunImage(const CompareOptions& options, const SolverSet* solvers, SceneImage* image,
                  const cv::Mat* photo = nullptr);

// Gives it to the circle whose image has the longest axis, whose index is returned; -1: to none.
int SetLargestRadius(double radius, Observations* observations);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_IMAGE_RUN_H_
