#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "circline/estimators/circle_pose.h"
#include "circline/estimators/closed_form_solvers.h"
#include "circline/refine/joint/readings.h"

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

// Whether the ellipse of an arc leaves its planes open: whether one standard deviation of it turns
// them by much, or leads beyond the ellipses. Where they lie then is no matter of small errors.
bool PlanesAreOpen(const ConicFit& fit) {
  constexpr double kOpen = 0.1;  // Radians; of 0.02 to 0.2, on drawn scenes ("lone_arcs").
  std::array<CirclePose, 2> poses, moved;
  const int count = CirclePoses(fit.conic, &poses);
  const Eigen::SelfAdjointEigenSolver<Matrix6d> spread(fit.Covariance());
  const Vector6d widest =
      std::sqrt(std::max(0.0, spread.eigenvalues()[5])) * spread.eigenvectors().col(5);
  for (const double side : {-1.0, 1.0}) {
    Eigen::Matrix3d conic = VectorToConic(ConicToVector(fit.conic) + side * widest);
    const int count_moved = NormalizeEllipse(conic, &conic) ? CirclePoses(conic, &moved) : 0;
    for (int i = 0; i < count; ++i) {
      double least = 1.0;
      for (int k = 0; k < count_moved; ++k)
        least = std::min(least, poses[static_cast<std::size_t>(i)]
                                    .normal.cross(moved[static_cast<std::size_t>(k)].normal)
                                    .norm());
      if (least > kOpen) return true;
    }
  }
  return false;
}

// The direction of the plane's one pencil, camera frame; none where there are several, as two know
// the plane.
std::optional<Eigen::Vector3d> OnlyDirection(const Observations& resolved) {
  std::optional<Eigen::Vector3d> direction;
  for (const PencilObservation& pencil : resolved.pencils) {
    if (!pencil.fit || pencil.plane != resolved.frame.plane) continue;
    if (direction || pencil.direction == PencilDirection::kZ) return {};
    direction = pencil.fit->direction;
  }
  return direction;
}

// Planes of an arc that leaves them open, all about the one direction that is known of them. Their
// tilts are even in the inverse Gudermannian function: the foreshortening changes from one to the
// next by the same factor, the steeper they are.
void AddSweep(const Observations& resolved, const CircleObservation& arc,
              const Eigen::Vector3d& direction, const Seed& like, std::vector<Seed>* seeds) {
  constexpr int kPlanes = 12;
  constexpr double kSteepest = 3.3;       // A tilt of 85.8 degrees.
  std::size_t i = arc.points.size() / 2;  // The inlier in the middle, or the next one.
  while (i < arc.inliers.size() && arc.inliers[i] == 0) ++i;
  CalibratedPoint middle;
  if (i >= arc.points.size() || !PixelToCalibrated(resolved.camera, arc.points[i], &middle)) return;
  Seed seed = like;
  seed.pose.translation = middle.Homogeneous().normalized();
  const Eigen::Vector3d across = direction.cross(seed.pose.translation).normalized(),
                        facing = direction.cross(across);
  for (int k = 0; k < kPlanes; ++k) {
    const double tilt = kSteepest * ((2.0 * k + 1.0) / kPlanes - 1.0);
    const Eigen::Vector3d normal = facing / std::cosh(tilt) + std::tanh(tilt) * across;
    if (WorldRotation(resolved, normal, seed.pose.translation, kAnySigmaPx, &seed.pose.rotation))
      Add(seed, seeds);
  }
}

// Unit normals n of the plane, camera frame: of a pencil across it its direction; of any other, n
// is orthogonal to the pencil's direction d and as far from gravity g as the world has it. In the
// plane across d, in which g is seen with the length s, that is an angle to either side of g. None
// where g runs along d.
std::vector<Eigen::Vector3d> NormalsByGravity(const GravityPrior& gravity,
                                              const PencilObservation& pencil) {
  constexpr double kAlong = 0.02;  // Radians: then it hardly tells the turn about the pencil.
  const Eigen::Vector3d &d = pencil.fit->direction, &g = gravity.in_camera;
  const Eigen::Vector3d g_across = g - d.dot(g) * d;
  const double s = g_across.norm();
  if (!(s > kAlong)) return {};
  if (pencil.direction == PencilDirection::kZ) return {d};
  const double cosine = std::clamp(gravity.in_world.z() / s, -1.0, 1.0),
               sine = std::sqrt(1.0 - cosine * cosine);
  const Eigen::Vector3d u = g_across / s, v = d.cross(u);
  return {cosine * u + sine * v, cosine * u - sine * v};
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
  const std::optional<Eigen::Vector3d> direction = OnlyDirection(resolved);
  if (circles.empty() || !direction || !PlanesAreOpen(*circles[0]->fit)) return;
  const auto index = static_cast<int>(circles[0] - resolved.circles.data());
  AddSweep(resolved, *circles[0], *direction, {CameraPose(), log_focal, -1, index}, seeds);
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

void AddPriorSeeds(const EstimationOptions& options, const Observations& resolved, double log_focal,
                   std::vector<Seed>* seeds) {
  constexpr int kSource = 1;
  if (options.pose_prior) seeds->push_back({options.pose_prior->mean, log_focal, kSource, -1});
  if (!options.gravity_prior) return;
  CameraPose pose;
  pose.translation = Eigen::Vector3d::UnitZ();  // As of lines alone, if the origin is not seen.
  CalibratedPoint origin;
  if (resolved.frame.origin && PixelToCalibrated(resolved.camera, *resolved.frame.origin, &origin))
    pose.translation = origin.Homogeneous();
  for (const PencilObservation& pencil : resolved.pencils) {
    if (!pencil.fit) continue;
    for (const Eigen::Vector3d& normal : NormalsByGravity(*options.gravity_prior, pencil)) {
      if (WorldRotation(resolved, normal, pose.translation, kAnySigmaPx, &pose.rotation))
        seeds->push_back({pose, log_focal, kSource, -1});
    }
  }
}

Observations Refocused(const JointProblem& problem, double log_focal) {
  Observations out = problem.observations();
  out.camera.fx *= std::exp(log_focal);
  out.camera.fy *= std::exp(log_focal);
  if (problem.camera_sigma().BendsWithFocal(out.camera)) {
    ResetFits(&out);
    FitDirect(kAnySigmaPx, &out, nullptr, problem.options().noise_model);
    return out;
  }
  // Else calibrated coordinates shrink: x' = A x, A = diag(s, s, 1), s = exp(-log_focal).
  // Covariances follow to first order.
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
