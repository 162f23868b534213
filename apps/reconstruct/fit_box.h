// A box from the images of its edges: pose and the lengths of its three edges at once, by maximum
// likelihood, with their covariance.
#ifndef CIRCLINE_APPS_RECONSTRUCT_FIT_BOX_H_
#define CIRCLINE_APPS_RECONSTRUCT_FIT_BOX_H_

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "apps/common/solids.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/status.h"

namespace circline::apps {

struct BoxFit {
  CameraPose cam_from_box;
  Eigen::Vector3d length = Eigen::Vector3d::Ones();  // Of the edges along x, y, z; positive.
  bool metric = false;                               // Else the translation has unit norm.
  Camera camera;             // As estimated, where its focal length is not known to 1 %.
  double focal_sigma = 0.0;  // Of log f; 0 where it was not estimated.
  // Of [delta, delta_t, length], delta as in PoseHypothesis.
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();
  double cost = 0.0;               // 1/2 sum rho.
  double rms_px = 0.0;             // Of the points about the edges.
  std::vector<std::size_t> edges;  // Of the observation's: those that agree.
  std::vector<std::string> notes;  // What was left out.

  Eigen::Vector3d InCamera(const Eigen::Vector3d& in_box) const {
    return cam_from_box.rotation * in_box + cam_from_box.translation;
  }
};

// A line on one of a box's faces, parallel to its edges along an axis: what is printed there is.
struct FaceLine {
  int axis = 0;
  std::vector<Eigen::Vector2d> points;  // Pixels, 2 or more.
  double sigma_px = 0.0;                // Standard deviation of each across the line; > 0.
};

struct BoxOptions {
  NoiseModel noise;
  CameraSigma camera;
  double point_sigma_px = 0.3;  // Of points of which nothing else is known; > 0.
  std::vector<FaceLine> lines;  // They tell the box's directions, beside its edges.
};

// `start`: the box's axes in the camera (columns), where about known; besides, they are found from
// three edges that differ in direction. Refuses where the edges do not fix the
// box's form: an axis without edges, or without one at its near and one at its far end. Where axes
// as marked are left-handed the fit's z begins at the other end.
Status FitBox(const Camera& camera, const BoxObservation& box, const BoxOptions& options,
              const std::optional<Eigen::Matrix3d>& start, BoxFit* fit);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_FIT_BOX_H_
