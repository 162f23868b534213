// What the output files say of one photo: the one source of the summary and the report, so that a
// run that was interrupted, split over machines or done at one go gives the same pages.
#ifndef CIRCLINE_APPS_COMPARE_RECORD_H_
#define CIRCLINE_APPS_COMPARE_RECORD_H_

#include <Eigen/Core>
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/common/photo_file.h"
#include "apps/common/pose_error.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/status.h"

namespace circline::apps {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// Which solver, at which stage, with which loss: a row of every table.
struct SolverKey {
  std::string solver;
  std::string stage;      // "closed_form" or "refined".
  std::string loss;       // Empty for closed forms, which have none.
  double scale_px = 0.0;  // 0 = auto.

  bool refined() const { return !loss.empty(); }  // By us, with a loss.
  std::string ScaleText() const;                  // "auto", the number, or "-" for closed forms.
  std::string LossText() const;                   // "huber, 0.5"; "-" for closed forms.
  std::string Name() const;  // "circle_center", "circle_center refined, huber 0.5".
  bool operator==(const SolverKey& other) const;
};

// One hypothesis; numbers that the files do not have are NaN.
struct HypothesisRecord {
  double probability = kUnknown;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  bool metric = false, rotation_is_free = false;
  std::optional<Camera> camera;                           // As it was estimated, where it was.
  double focal_px = kUnknown, focal_sigma_px = kUnknown;  // Where they are stated.
  double rms_px = kUnknown;
  int num_inliers = 0, num_observations = 0;
  Eigen::Vector3d sigma_rotation_deg = Eigen::Vector3d::Zero();
  double sigma_normal_deg = kUnknown;
  PoseErrors errors;
};

struct SolverRecord {
  SolverKey key;
  std::string status, message, decided_by;
  std::vector<std::string> notes;
  std::vector<HypothesisRecord> hypotheses;  // Empty unless the status is "ok".
  double microseconds = kUnknown;

  bool HasAnswer() const { return !hypotheses.empty(); }
  const std::string& name() const { return key.solver; }
  std::array<int, 4> Rank() const;  // ShowRank of its answer.
};

struct ImageRecord {
  std::size_t index = 0;  // In the whole set, whatever the shard.
  std::size_t set_size = 0;
  std::string name;
  std::string error;    // Not empty: the photo could not be used.
  std::string overlay;  // Relative to the output folder; empty if none was drawn.
  bool detected = false;
  std::size_t num_ellipses = 0, num_segments = 0, num_pencils = 0;
  Camera camera;
  std::string camera_from;  // SceneImage::camera_from.
  std::vector<std::string> problems;
  std::vector<std::string> flags;                      // CompareOptions::unusual_flags.
  std::vector<std::pair<std::string, double>> stages;  // "read", "detect", "fit"; microseconds.
  std::optional<FileState> photo_file;                 // Where the photo was read.
  std::vector<SolverRecord> solvers;
};

// Whether both see the same pixel along the same ray. Their sizes may be those of photos.
bool IsSameLens(const Camera& a, const Camera& b);

// Of its solvers, in order.
std::vector<SolverKey> KeysOf(const ImageRecord& record);

// The lines of one photo in results.jsonl, observations.jsonl (one line) and timings.jsonl.
struct ImageLines {
  std::string results, observations, timings;
};

// What became of a photo.
struct WorkedImage {
  ImageLines lines;
  std::string read_error;  // Not empty: the photo could not be used.
  Status status;           // Of writing its overlay.
};

// Not ok: a sentence that says what is not as this program writes it. `timings` may be empty.
Status ParseRecord(const ImageLines& lines, ImageRecord* record);

// Of one observations.jsonl line: how many lines of the other files belong to it.
struct LineCounts {
  std::size_t index = 0, results = 0, timings = 0;
};
bool ReadLineCounts(const std::string& observation_line, LineCounts* counts);

// The solver that weighs all evidence. Where it refuses there is no answer to show: what others say
// of parts of the evidence is no pose of the photo.
inline constexpr const char* kJoint = "joint";

// The larger, the sooner an answer is the one to show for its photo: joint, else the refined answer
// with the most evidence, else a closed form, and last the answers of peers, which state no
// probability.
std::array<int, 4> ShowRank(const std::string& solver, bool refined, double probability,
                            int num_observations);

// "--seed=2 --max_pencils=3", or that none was given.
std::string FlagText(const std::vector<std::string>& flags);

// The answer to show of a photo's solvers, records or runs: of the largest rank, and of the first
// loss. Null if every solver refused, or joint did.
template <typename Solver>
const Solver* AnswerToShow(const std::vector<Solver>& solvers) {
  const Solver* best = nullptr;
  bool joint_refuses = false;
  for (const Solver& candidate : solvers) {
    if (!candidate.HasAnswer()) {
      joint_refuses = joint_refuses || candidate.name() == kJoint;
    } else if (best == nullptr || candidate.Rank() > best->Rank()) {
      best = &candidate;
    }
  }
  return best != nullptr && joint_refuses && best->name() != kJoint ? nullptr : best;
}

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_RECORD_H_
