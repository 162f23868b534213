#include "circle_pencil.h"

#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "circline/estimators/circle_pose.h"
#include "circline/estimators/error_propagation.h"

using namespace circline;

namespace {

// Inputs: the conic, the pencil's direction, the radius (0: not known). X runs along the pencil,
// towards the right of the photo, Z towards the camera; the origin is the circle's centre. What
// contradicts a pose is its normal's share along the pencil.
std::vector<ClosedFormPose> Poses(const std::vector<MeasuredInput>& inputs) {
  std::array<CirclePose, 2> circles;
  const int count = CirclePoses(inputs[0].AsConic(), &circles);
  const Eigen::Vector3d direction = inputs[1].AsVector().normalized();
  const double radius = inputs[2].value[0];
  std::vector<ClosedFormPose> poses;
  for (int i = 0; i < count; ++i) {
    const CirclePose& circle = circles[static_cast<std::size_t>(i)];
    Eigen::Vector3d x = direction - circle.normal * circle.normal.dot(direction);
    if (x.norm() < 1e-9) continue;  // The pencil is orthogonal to this plane.
    x = x.normalized() * (x.x() < 0.0 ? -1.0 : 1.0);
    ClosedFormPose pose;
    pose.pose.rotation << x, circle.normal.cross(x), circle.normal;
    pose.pose.translation = radius > 0.0 ? radius * circle.center : circle.center.normalized();
    pose.contradiction = {circle.normal.dot(direction)};
    poses.push_back(std::move(pose));
  }
  return poses;
}

}  // namespace

// A pencil with a fit and the first circle of its plane, the plane Z = 0.
Observations CirclePencilSolver::Evidence(const Observations& observations) const {
  Observations fitted = observations;
  FitDirect(options_.sigma_px, &fitted, nullptr, options_.noise_model);
  fitted = ResolveWorld(fitted);
  Observations evidence;
  evidence.camera = fitted.camera;
  evidence.frame.plane = fitted.frame.plane;
  for (const CircleObservation& circle : fitted.circles) {
    if (evidence.circles.empty() && circle.fit && circle.plane == fitted.frame.plane)
      evidence.circles.push_back(circle);
  }
  for (const PencilObservation& pencil : fitted.pencils) {
    if (evidence.pencils.empty() && pencil.fit && pencil.plane == fitted.frame.plane)
      evidence.pencils.push_back(pencil);
  }
  if (!evidence.pencils.empty()) evidence.pencils.front().direction = PencilDirection::kX;
  return evidence;
}

PoseEstimate CirclePencilSolver::Solve(const Observations& observations) const {
  PoseEstimate estimate;
  estimate.solver = name_;
  estimate.status = observations.Validate();
  if (!estimate.status.ok()) return estimate;
  const Observations evidence = Evidence(observations);
  if (evidence.circles.empty() || evidence.pencils.empty()) {
    estimate.status = Status::Refused("the world's plane does not hold " + needs());
    return estimate;
  }
  const CircleObservation& circle = evidence.circles.front();
  const double relative =
      circle.radius_sigma > 0.0 ? circle.radius_sigma : options_.noise_model.radius;
  const std::vector<MeasuredInput> inputs = {
      MeasuredInput::Conic(*circle.fit, circle.contrast),
      MeasuredInput::Direction(*evidence.pencils.front().fit),
      MeasuredInput::Number(circle.radius, circle.radius * relative)};
  UnknownOfPose unknown;
  unknown.scale = !(circle.radius > 0.0);
  estimate.status = PropagateErrors(Poses, inputs, evidence.camera, options_.noise_model, unknown,
                                    &estimate.hypotheses);
  if (estimate.status.ok() && estimate.hypotheses.empty())
    estimate.status = Status::Refused("the ellipse of circle '" + circle.id + "' is degenerate");
  estimate.decided_by = "the plane that holds the pencil";
  return estimate;
}

void AddCirclePencilSolver(const ClosedFormOptions& options, SolverRegistry* registry) {
  registry->Add(std::make_shared<CirclePencilSolver>(options));
}
