#include "circline/refine/pose_seeds.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "circline/estimators/circle_pose.h"
#include "circline/estimators/closed_form_solvers.h"

namespace circline {
namespace {

constexpr std::size_t kMaxCircleSeeds = 6;  // Circles that propose both their planes.

void Add(const Seed& added, std::vector<Seed>* seeds) {
  const bool known = std::any_of(seeds->begin(), seeds->end(), [&](const Seed& seed) {
    return seed.source != added.source && (seed.source < 0) == (added.source < 0) &&
           IsSameSeed(seed, added);
  });
  if (!known) seeds->push_back(added);
}

}  // namespace

bool IsSameSeed(const Seed& a, const Seed& b) {
  constexpr double kSame = 0.02;  // Radians.
  return a.log_focal == b.log_focal && RotationAngle(a.pose.rotation, b.pose.rotation) <= kSame;
}

void AddCircleSeeds(const Observations& resolved, double log_focal, std::vector<Seed>* seeds) {
  std::vector<const CircleObservation*> circles;
  for (const CircleObservation& circle : resolved.circles) {
    if (circle.fit && circle.plane == resolved.frame.plane) circles.push_back(&circle);
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
      if (!WorldRotation(resolved, p.normal, p.center, kAnySigmaPx, &pose.rotation)) continue;
      pose.translation = p.center;
      const auto index = static_cast<int>(circle - resolved.circles.data());
      Add({pose, log_focal, source, index}, seeds);
    }
  }
}

std::vector<Seed> CollectSeeds(const Observations& resolved,
                               const std::vector<std::shared_ptr<const Solver>>& seeders,
                               double log_focal, std::vector<std::string>* reasons) {
  std::vector<Seed> seeds;
  int source = 0;
  for (const std::shared_ptr<const Solver>& seeder : seeders) {
    if (seeder->stage() != SolverStage::kClosedForm) continue;
    const PoseEstimate estimate = seeder->Seeds(resolved);
    if (!estimate.status.ok()) {
      if (reasons != nullptr) reasons->push_back(seeder->name() + ": " + estimate.status.message);
      continue;
    }
    ++source;
    for (const PoseHypothesis& h : estimate.hypotheses) {
      CameraPose pose = h.cam_from_world;
      // A solver that leaves the spin about the normal open has chosen it by convention; the other
      // evidence knows better.
      if (h.RotationIsFree() && !WorldRotation(resolved, pose.rotation.col(2), pose.translation,
                                               kAnySigmaPx, &pose.rotation)) {
        continue;
      }
      Add({pose, log_focal, source, -1}, &seeds);
    }
  }
  AddCircleSeeds(resolved, log_focal, &seeds);
  return seeds;
}

// Calibrated coordinates shrink: x' = A x, A = diag(s, s, 1), s = exp(-log_focal) (the lens bends
// the same rays, which is right at the middle of the photo). Covariances follow to first order.
Observations Refocused(const Observations& resolved, double log_focal) {
  Observations out = resolved;
  out.camera.fx *= std::exp(log_focal);
  out.camera.fy *= std::exp(log_focal);
  const double s = std::exp(-log_focal);
  const Eigen::Vector3d a(s, s, 1.0), inverse(1.0 / s, 1.0 / s, 1.0);
  const auto turn = [](Eigen::Vector3d* v, Eigen::Matrix3d* covariance, const Eigen::Vector3d& by) {
    *v = by.cwiseProduct(*v);
    const double norm = v->norm();
    *v /= norm;
    const Eigen::Matrix3d J =
        (Eigen::Matrix3d::Identity() - *v * v->transpose()) * by.asDiagonal() / norm;
    *covariance = J * *covariance * J.transpose();
  };
  for (CircleObservation& circle : out.circles) {
    if (!circle.fit) continue;
    Eigen::Matrix3d conic;
    if (NormalizeEllipse(inverse.asDiagonal() * circle.fit->conic * inverse.asDiagonal(), &conic))
      circle.fit->conic = conic;
  }
  for (PencilObservation& pencil : out.pencils) {
    if (pencil.fit) turn(&pencil.fit->direction, &pencil.fit->covariance, a);
    for (LineObservation& line : pencil.lines) {
      if (line.fit) turn(&line.fit->line, &line.fit->covariance, inverse);
    }
  }
  return out;
}

}  // namespace circline
