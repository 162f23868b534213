// What a solver returns: every pose that the evidence admits, ranked, each with its uncertainty.
#ifndef CIRCLINE_ESTIMATORS_POSE_H_
#define CIRCLINE_ESTIMATORS_POSE_H_

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/export.h"
#include "circline/estimators/status.h"

namespace CIRCLINE_EXPORT circline {

// X_cam = rotation * X_world + translation.
struct CameraPose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // World to camera.
  Eigen::Vector3d translation = Eigen::Vector3d::UnitZ();  // The world origin in the camera frame.
};

// A circle as a hypothesis places it, camera frame, in the unit of its pose's translation.
struct CircleEstimate {
  std::string id;                                       // CircleObservation::id.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();     // Unit; faces the camera.
  Eigen::Vector3d center = Eigen::Vector3d::Zero();     // Camera frame.
  Eigen::Vector2d center_px = Eigen::Vector2d::Zero();  // Its image (NOT the ellipse's centre);
                                                        // zero where the camera cannot see it.
  double radius = 0.0;                                  // In the same unit as the centre.
};

// A pencil as a hypothesis sees it.
struct PencilEstimate {
  std::string id;                                       // PencilObservation::id.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  // Unit, camera frame, without sense.
  double sigma_deg = 0.0;  // Standard deviation, the larger of the two components; degrees.
};

// One pose that the evidence admits, with its uncertainty.
struct PoseHypothesis {
  CameraPose cam_from_world;  // The pose itself.
  bool metric = false;        // Else the translation has unit norm.
  double probability = 1.0;   // Posterior among the hypotheses of the estimate; they sum to 1.
  // 1/2 sum rho(r^2), residuals in standard deviations, and what features left out speak against
  // the pose.
  double cost = 0.0;
  // Log determinant of the covariance of all parameters, but for what is alike among the hypotheses
  // of the estimate (Laplace's term): to compare them, not those of another photo.
  double log_det = 0.0;
  // Of [delta, delta_t], 6x6 row-major; rotation = exp([delta]x) * estimate, delta in the camera
  // frame, radians. Directions listed in `free_directions` are left out (they carry no variance
  // here, but are unbounded), and so is the length of t where it is a unit vector.
  std::array<double, 36> covariance{};
  int rank = 0;  // Of that covariance.
  // Orthonormal directions of [delta, delta_t] in which the evidence says nothing.
  std::vector<std::array<double, 6>> free_directions;
  // Where the focal length was refined too: what fx and fy are to be multiplied by, the standard
  // deviation of that, and its covariance with [delta, delta_t]. Else 1 and 0.
  double focal_scale = 1.0, focal_sigma = 0.0;
  std::array<double, 6> focal_covariance{};
  // The camera that it sees through, where that was refined; see CameraOf.
  std::optional<Camera> camera;
  // Features that contradict the rest and have no part in it: "c1", "kerbs[3]" for the fourth line
  // of a pencil, "c1.center", "length[0]", "angle[0]"; a pencil's id: its tie to its axis.
  std::vector<std::string> left_out;
  std::string structure;  // Which plane and reading of the evidence; equal where two share it.
  double rms_px = 0.0;    // Of the inlier residuals of all evidence, pixels of the photo.
  int num_inliers = 0, num_observations = 0;  // Scalar residuals.
  bool origin_observed =
      false;  // Whether evidence fixes the world origin (else it is a convention).
  std::vector<CircleEstimate> circles;  // Those that take part.
  std::vector<PencilEstimate> pencils;  // Likewise.

  // `covariance` as a matrix.
  Eigen::Map<const Matrix6d> Covariance() const {
    return Eigen::Map<const Matrix6d>(covariance.data());
  }
  // True if some rotation is free; the normal may be known all the same.
  bool RotationIsFree() const;
  // Standard deviations of delta's three components, radians; +infinity where unbounded.
  Eigen::Vector3d SigmaRotation() const;
  // Standard deviation of the normal of the world's plane, where it is largest, radians; +infinity
  // where unbounded, NaN of a solver that gives no covariance.
  double SigmaNormal() const;
};

// What a solver or EstimatePose returns.
struct PoseEstimate {
  Status status;       // Not ok: `hypotheses` is empty and the message says what was missing.
  std::string solver;  // Who made it.
  std::vector<PoseHypothesis> hypotheses;  // Best first. Ambiguity is data, not an error.
  std::string decided_by;  // Which evidence tells the first hypothesis from the others, in words.
  std::vector<std::string> notes;  // Evidence left out, and why; what was found on the way.
};

// The camera that the hypothesis sees through: its own, else the one given with its focal scale.
Camera CameraOf(const PoseHypothesis& hypothesis, const Camera& given);

// Sorts by posterior, proportional to exp(-cost) sqrt(det covariance), and fills the probabilities.
// Those that tie with the best (odds below 11 to 10) keep the order in which they came.
void RankHypotheses(std::vector<PoseHypothesis>* hypotheses);

// Fills covariance and rank, that of the correlations: whatever the units of delta and delta_t.
// What rounding leaves of a direction without variance, -1e-17, is zero, its covariances, too.
// `free_directions` are filled already: they add nothing to the rank, whatever rounding has left of
// their variances. `num_variables` is 5 where t is a direction.
void SetCovariance(Matrix6d covariance, PoseHypothesis* hypothesis, int num_variables = 6);

// Rotation vector <-> matrix (Rodrigues), and the angle between two rotations, radians.
Eigen::Matrix3d ExpRotation(const Eigen::Vector3d& delta);
Eigen::Vector3d LogRotation(const Eigen::Matrix3d& rotation);
double RotationAngle(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b);

// [v]x: the matrix of the cross product, [v]x w = v x w.
Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_POSE_H_
