// ViSP: poses of points, and of a circle by virtual visual servoing.
#include "apps/compare/peers.h"

#ifdef CIRCLINE_WITH_VISP
#include <visp3/core/vpCircle.h>
#include <visp3/core/vpPoint.h>
#include <visp3/vision/vpPose.h>
#include <visp3/vision/vpPoseFeatures.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "circline/estimators/conic.h"
#endif

namespace circline::apps {

#ifdef CIRCLINE_WITH_VISP
namespace {

CameraPose FromVisp(const vpHomogeneousMatrix& m) {
  CameraPose pose;
  for (unsigned i = 0; i < 3; ++i) {
    for (unsigned j = 0; j < 3; ++j) pose.rotation(i, j) = m[i][j];
    pose.translation[i] = m[i][3];
  }
  return pose;
}

vpHomogeneousMatrix ToVisp(const CameraPose& pose) {
  vpHomogeneousMatrix m;
  for (unsigned i = 0; i < 3; ++i) {
    for (unsigned j = 0; j < 3; ++j) m[i][j] = pose.rotation(i, j);
    m[i][3] = pose.translation[i];
  }
  return m;
}

// ---- Points ----

// The better of its two linear methods, as its manual advises, and if asked refined from there.
PoseEstimate SolvePoints(const SceneImage& image, const Observations& observations, bool refine) {
  PoseEstimate estimate;
  PeerPoints points;
  estimate.status = UsablePoints(image, observations.camera, &points);
  if (!estimate.status.ok()) return estimate;
  vpPose solver;
  for (std::size_t i = 0; i < points.world.size(); ++i) {
    vpPoint point(points.world[i].x(), points.world[i].y(), points.world[i].z());
    point.set_x(points.calibrated[i].x());
    point.set_y(points.calibrated[i].y());
    solver.addPoint(point);
  }
  vpHomogeneousMatrix best;
  double best_residual = std::numeric_limits<double>::infinity();
  for (const vpPose::vpPoseMethodType method : {vpPose::DEMENTHON, vpPose::LAGRANGE}) {
    vpHomogeneousMatrix pose;
    if (!solver.computePose(method, pose)) continue;
    const double residual = solver.computeResidual(pose);
    if (!(residual < best_residual)) continue;
    best_residual = residual;
    best = pose;
  }
  if (!std::isfinite(best_residual)) return estimate;
  if (refine) solver.computePose(vpPose::VIRTUAL_VS, best);
  estimate.hypotheses.push_back(PointsHypothesis(FromVisp(best), image, observations.camera));
  return estimate;
}

PoseEstimate SolvePointsLinearly(const SceneImage& image, const Observations& observations) {
  return SolvePoints(image, observations, false);
}
PoseEstimate SolvePointsByServoing(const SceneImage& image, const Observations& observations) {
  return SolvePoints(image, observations, true);
}

// ---- A circle ----

struct SeenCircle {
  const CircleObservation* circle = nullptr;
  Ellipse ellipse;  // Calibrated.
};

// The one at the world's origin, else the largest of the world's plane.
SeenCircle CircleToUse(const Observations& observations) {
  const FrameObservation frame = ResolveWorld(observations).frame;
  SeenCircle seen;
  for (const CircleObservation& circle : observations.circles) {
    Ellipse ellipse;
    if (!circle.fit || !ConicToEllipse(circle.fit->conic, &ellipse)) continue;
    const bool is_origin = !circle.id.empty() && circle.id == frame.origin_is_center;
    if (!is_origin && (circle.plane != frame.plane || ellipse.a <= seen.ellipse.a)) continue;
    seen = {&circle, ellipse};
    if (is_origin) break;
  }
  return seen;
}

// ViSP needs a start: the circle as it would be seen from afar, tilted one way or the other. The
// tilt is kept off zero, where both ways coincide and nothing tells the descent where to go. The
// unit of length is about the distance, as ViSP takes for zero whatever is below an absolute bound.
CameraPose Start(const SeenCircle& seen, double side) {
  constexpr double kSmallestTilt = 0.1;
  const double tilt = std::max(kSmallestTilt, std::acos(seen.ellipse.b / seen.ellipse.a));
  const Eigen::Vector3d axis(std::cos(seen.ellipse.angle), std::sin(seen.ellipse.angle), 0.0);
  CameraPose pose;
  pose.rotation = Eigen::AngleAxisd(side * tilt, axis).toRotationMatrix() *
                  Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();  // Its Z axis faces the camera.
  pose.translation = seen.ellipse.center.homogeneous();
  return pose;
}

// From the measured ellipse: its centre, and its second moments over its area. The image of the
// circle's centre is left out, for ViSP weighs all features alike, whatever their noise.
CameraPose Servo(const SeenCircle& seen, const CameraPose& start) {
  vpHomogeneousMatrix pose = ToVisp(start);
  vpCircle circle(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, seen.ellipse.a);
  circle.track(pose);
  const double c = std::cos(seen.ellipse.angle), s = std::sin(seen.ellipse.angle);
  const double along = seen.ellipse.a * seen.ellipse.a / 4.0;
  const double across = seen.ellipse.b * seen.ellipse.b / 4.0;
  circle.p[0] = seen.ellipse.center.x();
  circle.p[1] = seen.ellipse.center.y();
  circle.p[2] = along * c * c + across * s * s;
  circle.p[3] = (along - across) * c * s;
  circle.p[4] = along * s * s + across * c * c;
  vpPoseFeatures solver;
  solver.addFeatureEllipse(circle);
  solver.computePose(pose, vpPoseFeatures::VIRTUAL_VS);
  return FromVisp(pose);
}

PoseHypothesis CircleHypothesis(const SeenCircle& seen, CameraPose pose, bool is_origin) {
  const bool metric = seen.circle->radius > 0.0;
  pose.translation *= metric ? seen.circle->radius / seen.ellipse.a : 1.0 / pose.translation.norm();
  PoseHypothesis hypothesis = PeerHypothesis(pose);
  hypothesis.metric = metric;
  hypothesis.origin_observed = is_origin;
  const Eigen::Vector3d normal = pose.rotation.col(2);  // About it the circle turns unseen.
  hypothesis.free_directions.push_back({normal.x(), normal.y(), normal.z(), 0.0, 0.0, 0.0});
  hypothesis.num_inliers = hypothesis.num_observations = 5;
  return hypothesis;
}

// The poses that the descent reaches from both sides.
std::vector<CameraPose> CirclePosesByServoing(const SeenCircle& seen) {
  constexpr double kSameNormal = 0.9999999;  // Cosine of 0.026 degrees.
  std::vector<CameraPose> poses;
  for (const double side : {1.0, -1.0}) {
    const CameraPose pose = Servo(seen, Start(seen, side));
    const bool again = std::any_of(poses.begin(), poses.end(), [&](const CameraPose& other) {
      return other.rotation.col(2).dot(pose.rotation.col(2)) > kSameNormal;
    });
    const bool finite = pose.rotation.allFinite() && pose.translation.allFinite();
    if (!again && finite && pose.translation.z() > 0.0) poses.push_back(pose);
  }
  return poses;
}

PoseEstimate SolveCircle(const SceneImage& /*image*/, const Observations& observations) {
  PoseEstimate estimate;
  const SeenCircle seen = CircleToUse(observations);
  if (seen.circle == nullptr) {
    estimate.status = Status::Refused("there is no circle in the world's plane");
    return estimate;
  }
  std::vector<CameraPose> poses = CirclePosesByServoing(seen);
  CalibratedPoint center;
  if (seen.circle->center &&
      PixelToCalibrated(observations.camera, *seen.circle->center, &center)) {
    const auto error = [&center](const CameraPose& pose) {
      return (pose.translation.hnormalized() - center.x).norm();
    };
    std::stable_sort(poses.begin(), poses.end(),
                     [&](const CameraPose& a, const CameraPose& b) { return error(a) < error(b); });
    if (poses.size() > 1) estimate.decided_by = "the circle's centre";
  }
  const std::string& origin = observations.frame.origin_is_center;
  for (const CameraPose& pose : poses) {
    estimate.hypotheses.push_back(
        CircleHypothesis(seen, pose, !origin.empty() && origin == seen.circle->id));
  }
  return estimate;
}

}  // namespace

void AddVispPeers(std::vector<PeerSolver>* peers) {
  peers->push_back(
      {"visp_points", SolverStage::kClosedForm, "4 or more known points", SolvePointsLinearly});
  peers->push_back(
      {"visp_points", SolverStage::kRefined, "4 or more known points", SolvePointsByServoing});
  peers->push_back({"visp_circle", SolverStage::kRefined, "a circle; its centre, if given, decides",
                    SolveCircle});
}

#else
void AddVispPeers(std::vector<PeerSolver>* /*peers*/) {}
#endif

}  // namespace circline::apps
