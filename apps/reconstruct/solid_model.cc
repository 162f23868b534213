// Models of boxes, round boxes and marked faces.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "apps/reconstruct/model.h"
#include "circline/estimators/metrology.h"

namespace circline::apps {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kParallelCosine = 0.98;  // Of rims that count as parallel to the plane.

bool SeenOnPlane(const Camera& camera, const CameraPose& pose, const Vector2d& pixel,
                 Vector2d* point) {
  CalibratedPoint ray;
  return PixelToCalibrated(camera, pixel, &ray) && PointOnPlane(pose, ray.Homogeneous(), point);
}

const CircleEstimate* FindEstimate(const PoseHypothesis& hypothesis, const std::string& id) {
  for (const CircleEstimate& circle : hypothesis.circles) {
    if (circle.id == id) return &circle;
  }
  return nullptr;
}

// A marked quadrilateral, or the box of a polygon, as a parallelogram of the plane.
Status FacePatch(const FaceObservation& face, const Camera& camera, const CameraPose& pose,
                 Patch* patch) {
  std::vector<Vector2d> corners;
  for (const Vector2d& pixel : face.corners) {
    Vector2d point;
    if (!SeenOnPlane(camera, pose, pixel, &point)) {
      return Status::Refused("the face '" + face.id +
                             "': a corner lies on or beyond the plane's horizon");
    }
    corners.push_back(point);
  }
  Vector2d least = corners[0], most = corners[0];
  for (const Vector2d& corner : corners) {
    least = least.cwiseMin(corner);
    most = most.cwiseMax(corner);
  }
  patch->name = "face_" + FileSafe(face.id);
  patch->corner << least, 0.0;
  patch->u = {most.x() - least.x(), 0.0, 0.0};
  patch->v = {0.0, most.y() - least.y(), 0.0};
  if (corners.size() != 4) return Status::Ok();
  const Vector2d u = 0.5 * (corners[1] - corners[0] + corners[2] - corners[3]),
                 v = 0.5 * (corners[3] - corners[0] + corners[2] - corners[1]),
                 middle = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
  patch->corner << middle - 0.5 * (u + v), 0.0;
  patch->u << u, 0.0;
  patch->v << v, 0.0;
  return Status::Ok();
}

// Height of the upper rim over the plane, and its centre and radius.
Status UpperRim(const CylinderObservation& cylinder, const CircleEstimate& base,
                const Observations& observations, const PoseHypothesis& hypothesis,
                Vector3d* center, double* radius) {
  const CameraPose& pose = hypothesis.cam_from_world;
  const auto world = [&](const Vector3d& x) {
    return (pose.rotation.transpose() * (x - pose.translation)).eval();
  };
  const Vector3d foot = world(base.center);
  *radius = base.radius;
  if (cylinder.top) {
    CalibratedPoint top;
    double height = 0.0;
    if (!PixelToCalibrated(observations.camera, *cylinder.top, &top) ||
        !HeightOverPlane(pose, base.center, top.Homogeneous(), &height)) {
      return Status::Refused("the cylinder '" + cylinder.id + "': its top cannot be seen");
    }
    *center = foot + Vector3d(0.0, 0.0, height);
    return Status::Ok();
  }
  const CircleEstimate* rim = FindEstimate(hypothesis, cylinder.rim);
  const int index = FindCircle(observations, cylinder.rim);
  if (rim == nullptr || index < 0) {
    return Status::Refused("the cylinder '" + cylinder.id + "': its rim '" + cylinder.rim +
                           "' has no place in this pose");
  }
  if (std::abs(rim->normal.dot(pose.rotation.col(2))) < kParallelCosine) {
    return Status::Refused("the cylinder '" + cylinder.id +
                           "': its rims do not lie in parallel planes");
  }
  // Its own cone gives its place up to scale. Its axis is the base's.
  const Vector3d ray = pose.rotation.transpose() * rim->center,
                 eye = -(pose.rotation.transpose() * pose.translation);
  const Vector2d apart = (foot - eye).head<2>();
  const double scale = ray.head<2>().dot(apart) / ray.head<2>().squaredNorm();
  if (!(scale > 0.0) || !std::isfinite(scale)) {
    return Status::Refused("the cylinder '" + cylinder.id +
                           "': seen along its axis, its height cannot be told");
  }
  *center = eye + scale * ray;
  center->head<2>() = foot.head<2>();
  *radius = scale * rim->radius;
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

}  // namespace

Status AddSolids(const Solids& solids, const Observations& observations,
                 const PoseHypothesis& hypothesis, Model* model) {
  const CameraPose& pose = hypothesis.cam_from_world;
  const Vector3d eye = -(pose.rotation.transpose() * pose.translation);
  for (const FaceObservation& face : solids.faces) {
    Patch patch;
    const Status status = FacePatch(face, observations.camera, pose, &patch);
    if (!status.ok()) return status;
    model->patches.push_back(patch);
  }
  for (const CylinderObservation& cylinder : solids.cylinders) {
    const CircleEstimate* base = FindEstimate(hypothesis, cylinder.base);
    if (base == nullptr) {
      return Status::Refused("the cylinder '" + cylinder.id + "': its base '" + cylinder.base +
                             "' has no place in this pose");
    }
    Vector3d top;
    double radius;
    const Status status = UpperRim(cylinder, *base, observations, hypothesis, &top, &radius);
    if (!status.ok()) return status;
    const Vector3d foot = pose.rotation.transpose() * (base->center - pose.translation);
    // What was the plane's disc is now the cylinder's.
    model->patches.erase(std::remove_if(model->patches.begin(), model->patches.end(),
                                        [&](const Patch& patch) {
                                          return patch.name ==
                                                     "circle_" + FileSafe(cylinder.base) ||
                                                 patch.name == "circle_" + FileSafe(cylinder.rim);
                                        }),
                         model->patches.end());
    AddMantle("cylinder_" + FileSafe(cylinder.id), foot, top, 0.5 * (base->radius + radius), eye,
              model);
    model->heights.push_back({cylinder.id, top.z() - foot.z(), cylinder.true_height});
  }
  return Status::Ok();
}

Model BoxModel(const BoxFit& fit) {
  Model model;
  model.size = fit.length.norm();
  const Vector3d eye = -(fit.cam_from_box.rotation.transpose() * fit.cam_from_box.translation);
  for (int k = 0; k < 3; ++k) {
    const int a = (k + 1) % 3, b = (k + 2) % 3;
    for (const bool far : {false, true}) {
      if (!(far ? eye[k] > fit.length[k] : eye[k] < 0.0)) continue;
      Patch patch;
      patch.name = std::string("box_") + "xyz"[k] + (far ? "1" : "0");
      patch.corner = far ? (fit.length[k] * Vector3d::Unit(k)).eval() : Vector3d::Zero().eval();
      patch.u = fit.length[a] * Vector3d::Unit(a);
      patch.v = fit.length[b] * Vector3d::Unit(b);
      // Upright faces have z up; their outside is where u and v turn counterclockwise.
      if (k == 0 && !far) {
        patch.corner.y() = fit.length[a];
        patch.u = -patch.u;
      }
      if (k == 1) {
        std::swap(patch.u, patch.v);
        if (far) {
          patch.corner.x() = fit.length[b];
          patch.u = -patch.u;
        }
      }
      if (k == 2 && !far) std::swap(patch.u, patch.v);
      model.patches.push_back(patch);
    }
  }
  return model;
}

}  // namespace circline::apps
