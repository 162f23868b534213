#include "circline/refine/pose_seeds.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "circline/estimators/circle_pose.h"
#include "circline/estimators/closed_form_solvers.h"
#include "circline/refine/noise_scales.h"

namespace circline {
namespace {

// Seeds closer than this are one; far inside the basin of convergence of each other.
constexpr double kSameSeed = 0.02;  // Radians.
constexpr std::size_t kMaxSeeds = 8;
constexpr std::size_t kMaxCircleSeeds = 6;  // Circles that propose both their planes.

struct Seed {
  CameraPose pose;
  double cost;
  int source;  // The two poses of one circle, however close, are two seeds.
};

struct SeedList {
  const JointProblem& problem;
  std::vector<Seed> seeds = {};
  Status refusal = {};  // Why the last one that was refused was.

  void Add(const CameraPose& pose, int source) {
    const auto same = std::find_if(seeds.begin(), seeds.end(), [&](const Seed& seed) {
      return seed.source != source && RotationAngle(seed.pose.rotation, pose.rotation) <= kSameSeed;
    });
    // The better of the two matters only where outliers make the way to the minimum hard.
    if (same != seeds.end() && !problem.is_contaminated()) return;
    double cost;
    const Status status = problem.SeedCost(pose, &cost);
    if (!status.ok()) {
      refusal = status;
    } else if (same == seeds.end()) {
      seeds.push_back({pose, cost, source});
    } else if (cost < same->cost) {
      *same = {pose, cost, source};
    }
  }
};

// The rotations about the plane's normal under which one line or another of a pencil along an axis
// has its direction: some of these lines may be wrong. The senses of the axes are those of
// `rotation`.
void AddSpinSeeds(const Observations& observations, const CameraPose& pose, int source,
                  SeedList* list) {
  constexpr int kMaxLines = 8;
  int lines = 0;
  const Eigen::Vector3d n = pose.rotation.col(2);
  for (const PencilObservation& pencil : observations.pencils) {
    if (pencil.direction != PencilDirection::kX && pencil.direction != PencilDirection::kY)
      continue;
    const Eigen::Vector3d axis = pose.rotation.col(static_cast<int>(pencil.direction));
    for (const LineObservation& line : pencil.lines) {
      if (!line.fit || ++lines > kMaxLines) continue;
      Eigen::Vector3d direction = n.cross(line.fit->line);
      if (direction.dot(axis) < 0.0) direction = -direction;
      const double angle = std::atan2(axis.cross(direction).dot(n), axis.dot(direction));
      list->Add({ExpRotation(angle * n) * pose.rotation, pose.translation}, source);
    }
  }
}

// Both planes of the largest circles of the world plane, turned in the plane as the other evidence
// says.
void AddCircleSeeds(const Observations& observations, SeedList* list) {
  std::vector<const CircleObservation*> circles;
  for (const CircleObservation& circle : observations.circles) {
    if (circle.fit && circle.plane == observations.frame.plane) circles.push_back(&circle);
  }
  std::stable_sort(circles.begin(), circles.end(),
                   [](const CircleObservation* a, const CircleObservation* b) {
                     return a->fit->Covariance().trace() < b->fit->Covariance().trace();
                   });
  circles.resize(std::min(circles.size(), kMaxCircleSeeds));
  int source = 0;
  for (const CircleObservation* circle : circles) {
    --source;  // Closed forms count upwards.
    std::array<CirclePose, 2> poses;
    const int count = CirclePoses(circle->fit->conic, &poses);
    for (int i = 0; i < count; ++i) {
      const CirclePose& p = poses[static_cast<std::size_t>(i)];
      CameraPose pose;
      if (!WorldRotation(observations, p.normal, p.center, kDefaultLineSigmaPx, &pose.rotation))
        continue;
      pose.translation = p.center;
      list->Add(pose, source);
      if (list->problem.is_contaminated()) AddSpinSeeds(observations, pose, source, list);
    }
  }
}

}  // namespace

std::vector<CameraPose> CollectSeeds(const Observations& observations,
                                     const std::vector<std::shared_ptr<const Solver>>& seeders,
                                     const EstimationOptions& options, const JointProblem& problem,
                                     std::vector<std::string>* reasons) {
  SeedList list{problem};
  int source = 0;
  for (const std::shared_ptr<const Solver>& seeder : seeders) {
    const PoseEstimate estimate = seeder->Seeds(observations);
    if (!estimate.status.ok()) {
      reasons->push_back(seeder->name() + ": " + estimate.status.message);
      continue;
    }
    ++source;
    for (const PoseHypothesis& h : estimate.hypotheses) {
      CameraPose pose = h.cam_from_world;
      // A solver that leaves the spin about the normal open has chosen it by convention; the other
      // evidence knows better.
      if (h.RotationIsFree() && !WorldRotation(observations, pose.rotation.col(2), pose.translation,
                                               kDefaultLineSigmaPx, &pose.rotation)) {
        continue;
      }
      list.Add(pose, source);
    }
  }
  AddCircleSeeds(observations, &list);
  std::vector<Seed>& seeds = list.seeds;
  if (seeds.empty() && !list.refusal.ok())
    reasons->insert(reasons->begin(), "no pose agrees with all evidence: " + list.refusal.message);
  std::stable_sort(seeds.begin(), seeds.end(),
                   [](const Seed& a, const Seed& b) { return a.cost < b.cost; });
  seeds.resize(std::min(seeds.size(), kMaxSeeds));
  // A closed form lies so near its minimum that one that costs far more leads to none that counts.
  constexpr double kMargin = 4.0;
  std::vector<CameraPose> poses;
  for (const Seed& seed : seeds) {
    if (seed.cost <= kMargin * (seeds.front().cost + options.max_cost_gap))
      poses.push_back(seed.pose);
  }
  return poses;
}

}  // namespace circline
