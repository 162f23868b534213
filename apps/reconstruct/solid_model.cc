// Models of boxes, round boxes and marked faces.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "apps/compare/plane_evidence.h"
#include "apps/reconstruct/box_geometry.h"
#include "apps/reconstruct/model.h"
#include "circline/estimators/metrology.h"

namespace circline::apps {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Shorter by longer axis of a rim's shadow on the plane: with less it is not parallel to the plane.
constexpr double kLeastRoundness = 0.95;

const CircleEstimate* FindEstimate(const PoseHypothesis& hypothesis, const std::string& id) {
  for (const CircleEstimate& circle : hypothesis.circles) {
    if (circle.id == id) return &circle;
  }
  return nullptr;
}

// A marked quadrilateral, or the box of a polygon, as a parallelogram of the plane.
Status FacePatch(const FaceObservation& face, const std::string& world_plane, const Camera& camera,
                 const CameraPose& pose, Patch* patch) {
  if (!face.plane.empty() && face.plane != world_plane) {
    return Status::Invalid("the face '" + face.id + "' lies in the plane '" + face.plane +
                           "'; only faces of the world's plane, '" + world_plane +
                           "', can be modelled");
  }
  std::vector<Vector2d> corners;
  Eigen::AlignedBox2d extent;
  for (const Vector2d& pixel : face.corners) {
    Vector2d point;
    if (!PixelOnPlane(camera, pose, pixel, &point)) {
      return Status::Refused("the face '" + face.id +
                             "': a corner lies on or beyond the plane's horizon");
    }
    corners.push_back(point);
    extent.extend(point);
  }
  patch->name = "face_" + face.id;
  patch->corner << extent.min(), 0.0;
  patch->u = {extent.sizes().x(), 0.0, 0.0};
  patch->v = {0.0, extent.sizes().y(), 0.0};
  if (corners.size() != 4) return Status::Ok();
  const Vector2d u = 0.5 * (corners[1] - corners[0] + corners[2] - corners[3]),
                 v = 0.5 * (corners[3] - corners[0] + corners[2] - corners[1]),
                 middle = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
  patch->corner << middle - 0.5 * (u + v), 0.0;
  patch->u << u, 0.0;
  patch->v << v, 0.0;
  return Status::Ok();
}

// The upper rim: the image of its centre, with the standard deviation of each coordinate, and its
// radius by its height over the plane.
struct Rim {
  Vector2d center_px;
  double sigma_px = 0.0;
  double radius_on_plane = 0.0;  // Of its shadow on the plane, with a lamp at the camera; 0: none.
};

// As marked, or of the circle of that name, which is the image of one parallel to the plane.
Status FindRim(const CylinderObservation& cylinder, const Observations& observations,
               const CameraPose& pose, double point_sigma_px, Rim* rim) {
  if (cylinder.top) {
    *rim = {*cylinder.top, point_sigma_px, 0.0};
    return Status::Ok();
  }
  const int index = FindCircle(observations, cylinder.rim);
  const std::string name = "the cylinder '" + cylinder.id + "': its rim '" + cylinder.rim + "'";
  Ellipse shadow;
  if (index < 0) return Status::Refused(name + " is not in the photo");
  const CircleObservation& circle = observations.circles[static_cast<std::size_t>(index)];
  if (!circle.fit || !ConicOnPlane(pose, circle.fit->conic, &shadow))
    return Status::Refused(name + " is not the image of a circle before the camera");
  if (shadow.b < kLeastRoundness * shadow.a)
    return Status::Refused(name + " does not lie in a plane parallel to its base");
  const Vector3d center(shadow.center.x(), shadow.center.y(), 0.0);
  if (!CameraToPixel(observations.camera, pose.rotation * center + pose.translation,
                     &rim->center_px))
    return Status::Refused(name + " has its centre where the camera sees nothing");
  const double sigma_px = circle.sigma_px > 0.0 ? circle.sigma_px : point_sigma_px;
  rim->sigma_px = CenterSigmaPx(sigma_px, circle.points.size());
  rim->radius_on_plane = std::sqrt(shadow.a * shadow.b);
  return Status::Ok();
}

// The half of the mantle that faces the camera, and the disc on top.
void AddMantle(const std::string& id, const Vector3d& foot, const Vector3d& top, double radius,
               const Vector3d& eye, Model* model) {
  const Vector3d up = top - foot;
  Vector3d towards = eye - foot;
  towards.z() = 0.0;
  const double distance = towards.norm();
  if (distance > radius) {
    const double half = std::acos(radius / distance);  // To where the surface is seen edge-on.
    Patch mantle;
    mantle.name = id + "_side";
    mantle.shape = PatchShape::kMantle;
    mantle.corner = foot;
    mantle.v = up;
    mantle.angle = 2.0 * half;
    const Vector3d x = towards / distance, y(-x.y(), x.x(), 0.0);
    mantle.u = radius * (std::cos(half) * x - std::sin(half) * y);
    mantle.w = radius * (std::sin(half) * x + std::cos(half) * y);
    if (up.z() < 0.0) {  // Seen from below: counterclockwise all the same.
      mantle.corner = top;
      mantle.v = -up;
    }
    model->patches.push_back(mantle);
  }
  Patch disc;
  disc.name = id + "_top";
  disc.shape = PatchShape::kDisc;
  disc.corner = top - Vector3d(radius, radius, 0.0);
  disc.u = {2.0 * radius, 0.0, 0.0};
  disc.v = {0.0, 2.0 * radius, 0.0};
  model->patches.push_back(disc);
}

Status AddCylinder(const CylinderObservation& cylinder, const Observations& observations,
                   const PoseHypothesis& hypothesis, double point_sigma_px, Model* model) {
  const CameraPose& pose = hypothesis.cam_from_world;
  const CircleEstimate* base = FindEstimate(hypothesis, cylinder.base);
  if (base == nullptr) {
    return Status::Refused("the cylinder '" + cylinder.id + "': its base '" + cylinder.base +
                           "' has no place in this pose");
  }
  Rim rim;
  const Status status = FindRim(cylinder, observations, pose, point_sigma_px, &rim);
  if (!status.ok()) return status;
  Measurement height;
  if (!HeightOverPlane(hypothesis, observations.camera, {base->center_px, rim.center_px},
                       rim.sigma_px, &height)) {
    return Status::Refused("the cylinder '" + cylinder.id +
                           "': its height cannot be told, as where it is seen along its axis");
  }
  const Vector3d eye = -(pose.rotation.transpose() * pose.translation);
  Vector3d foot = pose.rotation.transpose() * (base->center - pose.translation);
  foot.z() = 0.0;
  const double upper = rim.radius_on_plane * (1.0 - height.value / eye.z());
  const double radius = upper > 0.0 ? 0.5 * (base->radius + upper) : base->radius;
  // What was the plane's disc is now the cylinder's.
  const auto is_own = [&](const Patch& patch) {
    return patch.name == "circle_" + cylinder.base || patch.name == "circle_" + cylinder.rim;
  };
  model->patches.erase(std::remove_if(model->patches.begin(), model->patches.end(), is_own),
                       model->patches.end());
  AddMantle("cylinder_" + cylinder.id, foot, foot + Vector3d(0.0, 0.0, height.value), radius, eye,
            model);
  model->heights.push_back(
      {cylinder.id, height.value, height.sigma, std::copysign(cylinder.true_height, height.value)});
  return Status::Ok();
}

}  // namespace

Status AddSolids(const Solids& solids, const Observations& observations,
                 const PoseHypothesis& hypothesis, double point_sigma_px, Model* model) {
  const std::string world_plane = ResolveWorld(observations).frame.plane;
  for (const FaceObservation& face : solids.faces) {
    Patch patch;
    const Status status =
        FacePatch(face, world_plane, observations.camera, hypothesis.cam_from_world, &patch);
    if (!status.ok()) return status;
    model->patches.push_back(patch);
  }
  for (const CylinderObservation& cylinder : solids.cylinders) {
    const Status status = AddCylinder(cylinder, observations, hypothesis, point_sigma_px, model);
    if (!status.ok()) return status;
  }
  return Status::Ok();
}

Model BoxModel(const BoxFit& fit) {
  Model model;
  model.size = fit.length.norm();
  for (int k = 0; k < 3; ++k) {
    const int a = (k + 1) % 3, b = (k + 2) % 3;
    for (const bool far : {false, true}) {
      if (!FaceIsSeen(fit, k, far)) continue;
      Patch patch;
      patch.name = std::string("box_") + "xyz"[k] + (far ? "1" : "0");
      patch.corner = far ? (fit.length[k] * Vector3d::Unit(k)).eval() : Vector3d::Zero().eval();
      patch.u = fit.length[a] * Vector3d::Unit(a);
      patch.v = fit.length[b] * Vector3d::Unit(b);
      // Upright faces have z up.
      if (k == 1 || (k == 2 && !far)) std::swap(patch.u, patch.v);
      model.patches.push_back(patch);
    }
  }
  return model;
}

}  // namespace circline::apps
