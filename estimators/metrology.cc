#include "circline/estimators/metrology.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "circline/estimators/basics.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

Vector3d CameraCenter(const CameraPose& pose) {
  return -(pose.rotation.transpose() * pose.translation);
}

// Columns of the homography that takes (X, Y, 1) to the image.
Matrix3d ImageFromPlane(const CameraPose& pose) {
  Matrix3d H = pose.rotation;
  H.col(2) = pose.translation;
  return H;
}

// Both segments as vectors on the plane.
bool VectorsOnPlane(const CameraPose& pose, const SegmentPair& segments, Vector2d* first,
                    Vector2d* second) {
  std::array<Vector2d, 4> p;
  for (std::size_t i = 0; i < 4; ++i) {
    if (!PointOnPlane(pose, segments[i], &p[i])) return false;
  }
  *first = p[1] - p[0];
  *second = p[3] - p[2];
  return true;
}

// Writes what is finite.
bool Return(double value, double* result) {
  if (!std::isfinite(value)) return false;
  *result = value;
  return true;
}
template <typename Vector>
bool Return(const Vector& value, Vector* result) {
  if (!value.allFinite()) return false;
  *result = value;
  return true;
}

// `pose` moved along one of the six parameters of its covariance.
CameraPose Moved(const CameraPose& pose, int parameter, double by) {
  CameraPose moved = pose;
  Vector3d step = Vector3d::Zero();
  step[parameter % 3] = by;
  if (parameter < 3) {
    moved.rotation = ExpRotation(step) * pose.rotation;
  } else {
    moved.translation += step;
  }
  return moved;
}

// Image points of pixels, and what a pixel is worth at each.
bool Calibrate(const Camera& camera, double longer, const std::vector<Vector2d>& pixels,
               std::vector<CalibratedPoint>* points, std::vector<Vector3d>* x) {
  Camera scaled = camera;
  scaled.fx *= longer;
  scaled.fy *= longer;
  if (PixelsToCalibrated(scaled, pixels, points) > 0) return false;
  x->clear();
  for (const CalibratedPoint& p : *points) x->push_back(p.Homogeneous());
  return true;
}

// The value of `function` and its variance, by central differences along every pixel coordinate,
// every parameter of the pose and the focal length. Values that differ by `period` are the same.
bool Propagate(const PlaneFunction& function, double period, const PoseHypothesis& hypothesis,
               const Camera& given, const std::vector<Vector2d>& pixels, double sigma_px,
               Measurement* result) {
  const CameraPose& pose = hypothesis.cam_from_world;
  const Camera camera = CameraOf(hypothesis, given);
  std::vector<CalibratedPoint> points, unused;
  std::vector<Vector3d> x, x_high, x_low;
  Measurement m;
  if (!Calibrate(camera, 1.0, pixels, &points, &x) || !function(pose, x, &m.value)) return false;
  constexpr double kStepPx = 1e-3;
  double variance = 0.0, high, low;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector3d at = x[i];
    for (std::size_t k = 0; k < 2; ++k) {
      const Vector3d step(kStepPx * points[i].x_from_pixel[k],
                          kStepPx * points[i].x_from_pixel[2 + k], 0.0);
      x[i] = at + step;
      if (!function(pose, x, &high)) return false;
      x[i] = at - step;
      if (!function(pose, x, &low)) return false;
      const double gradient = std::remainder(high - low, period) / (2.0 * kStepPx);
      variance += gradient * gradient * sigma_px * sigma_px;
    }
    x[i] = at;
  }
  constexpr double kStep = 1e-6;  // Radians, in units of the translation's length, and relative.
  const double length = pose.translation.norm();
  Vector6d gradient;
  for (int k = 0; k < 6; ++k) {
    const double h = k < 3 ? kStep : kStep * length;
    if (!function(Moved(pose, k, h), x, &high) || !function(Moved(pose, k, -h), x, &low))
      return false;
    gradient[k] = std::remainder(high - low, period) / (2.0 * h);
  }
  variance += gradient.dot(hypothesis.Covariance() * gradient);
  if (hypothesis.focal_sigma > 0.0) {
    const double h = kStep * hypothesis.focal_scale;
    if (!Calibrate(camera, 1.0 + kStep, pixels, &unused, &x_high) ||
        !Calibrate(camera, 1.0 - kStep, pixels, &unused, &x_low) ||
        !function(pose, x_high, &high) || !function(pose, x_low, &low)) {
      return false;
    }
    const double by_focal = std::remainder(high - low, period) / (2.0 * h);
    const Eigen::Map<const Vector6d> with_pose(hypothesis.focal_covariance.data());
    variance += by_focal * (2.0 * gradient.dot(with_pose) +
                            by_focal * hypothesis.focal_sigma * hypothesis.focal_sigma);
  }
  m.sigma = std::sqrt(std::fmax(0.0, variance));
  if (!std::isfinite(variance) || !std::isfinite(m.value)) return false;
  *result = m;
  return true;
}

}  // namespace

bool RayOfPoint(const CameraPose& pose, const Vector3d& x, WorldRay* ray) {
  const WorldRay result = {CameraCenter(pose), pose.rotation.transpose() * x.stableNormalized()};
  if (!result.origin.allFinite() || !result.direction.allFinite() ||
      !(result.direction.squaredNorm() > 0.0)) {
    return false;
  }
  *ray = result;
  return true;
}

bool PlaneOfLine(const CameraPose& pose, const Vector3d& line, WorldPlane* plane) {
  const Vector3d unit = line.stableNormalized();
  const WorldPlane result = {pose.rotation.transpose() * unit, unit.dot(pose.translation)};
  if (!result.normal.allFinite() || !std::isfinite(result.offset) ||
      !(result.normal.squaredNorm() > 0.0)) {
    return false;
  }
  *plane = result;
  return true;
}

bool ConeOfConic(const CameraPose& pose, const Matrix3d& conic, WorldCone* cone) {
  const WorldCone result = {CameraCenter(pose), pose.rotation.transpose() * conic * pose.rotation};
  if (!result.apex.allFinite() || !result.form.allFinite() || result.form.isZero(0.0)) return false;
  *cone = result;
  return true;
}

bool PointOnPlane(const CameraPose& pose, const Vector3d& x, Vector2d* point) {
  // The ray meets r3 . (X - t) = 0 at depth X = s x; s > 0 is this side of the horizon.
  const Vector3d r3 = pose.rotation.col(2);
  const double s = r3.dot(pose.translation) / r3.dot(x);
  if (!(s > 0.0)) return false;
  const Vector3d offset = s * x - pose.translation;
  return Return(Vector2d(pose.rotation.col(0).dot(offset), pose.rotation.col(1).dot(offset)),
                point);
}

bool LineOnPlane(const CameraPose& pose, const Vector3d& line, Vector3d* plane_line) {
  const Vector3d l = ImageFromPlane(pose).transpose() * line.stableNormalized();
  const double norm = l.head<2>().norm();
  constexpr double kMinSine = 1e-15;  // Of the angle to the horizon; below, all is rounding.
  if (!(norm > kMinSine)) return false;
  return Return(Vector3d(l / norm), plane_line);
}

bool ConicOnPlane(const CameraPose& pose, const Matrix3d& conic, Ellipse* ellipse) {
  // A length of order 1 on the plane, whatever the unit of the translation.
  const double unit = pose.translation.norm();
  if (!(unit > 0.0) || !std::isfinite(unit)) return false;
  const CameraPose scaled = {pose.rotation, pose.translation / unit};
  Matrix3d image;
  Ellipse result;
  const Matrix3d H = ImageFromPlane(scaled);
  if (!NormalizeEllipse(conic, &image) || !ConicToEllipse(TransformConic(image, H), &result)) {
    return false;
  }
  // An ellipse all of which lies beyond the horizon is one of the plane behind the camera.
  const Vector3d center = H * result.center.homogeneous();
  if (!(center.z() > 0.0)) return false;
  result.center *= unit;
  result.a *= unit;
  result.b *= unit;
  if (!std::isfinite(result.a) || !result.center.allFinite() || !(result.b > 0.0)) return false;
  *ellipse = result;
  return true;
}

bool RectifyingHomography(const CameraPose& pose, Matrix3d* plane_from_image) {
  // The inverse of [r1 r2 t] up to the factor r3 . t.
  const Vector3d r1 = pose.rotation.col(0), r2 = pose.rotation.col(1), r3 = pose.rotation.col(2);
  const Vector3d& t = pose.translation;
  const double distance = r3.dot(t);
  Matrix3d H;
  H.row(0) = r2.cross(t);
  H.row(1) = t.cross(r1);
  H.row(2) = r3;
  if (distance < 0.0) H = -H;
  const double norm = H.norm();
  constexpr double kMinSine = 1e-15;  // Of the angle at which the plane's origin is seen.
  if (!(std::abs(distance) > kMinSine * t.norm()) || !std::isfinite(norm)) return false;
  *plane_from_image = H / norm;
  return true;
}

bool LengthOnPlane(const CameraPose& pose, const Vector3d& a, const Vector3d& b, double* length) {
  Vector2d p, q;
  if (!PointOnPlane(pose, a, &p) || !PointOnPlane(pose, b, &q)) return false;
  return Return((q - p).stableNorm(), length);
}

bool LengthRatio(const CameraPose& pose, const SegmentPair& segments, double* ratio) {
  Vector2d first, second;
  if (!VectorsOnPlane(pose, segments, &first, &second)) return false;
  return Return(first.stableNorm() / second.stableNorm(), ratio);
}

bool AngleOnPlane(const CameraPose& pose, const SegmentPair& segments, double* angle) {
  Vector2d first, second;
  if (!VectorsOnPlane(pose, segments, &first, &second)) return false;
  first = first.stableNormalized();
  second = second.stableNormalized();
  if (!(first.squaredNorm() > 0.0) || !(second.squaredNorm() > 0.0)) return false;
  return Return(std::atan2(Cross(first, second), first.dot(second)), angle);
}

bool AreaOnPlane(const CameraPose& pose, const std::vector<Vector3d>& corners, double* area) {
  if (corners.size() < 3) return false;
  // A fan of triangles about the first corner: no large coordinates cancel.
  Vector2d first, previous, next;
  if (!PointOnPlane(pose, corners[0], &first) || !PointOnPlane(pose, corners[1], &previous)) {
    return false;
  }
  double sum = 0.0;
  for (std::size_t i = 2; i < corners.size(); ++i) {
    if (!PointOnPlane(pose, corners[i], &next)) return false;
    sum += Cross(previous - first, next - first);
    previous = next;
  }
  return Return(0.5 * std::abs(sum), area);
}

bool HeightOverPlane(const CameraPose& pose, const Vector3d& foot, const Vector3d& top,
                     double* height) {
  Vector2d on_plane;
  if (!PointOnPlane(pose, foot, &on_plane)) return false;
  const Vector3d base = ImageFromPlane(pose) * on_plane.homogeneous();
  const Vector3d r3 = pose.rotation.col(2), ray = top.stableNormalized();
  // base + h r3 is along the ray, as far as noise allows: least squares over h.
  const Vector3d moment = r3.cross(ray);
  const double square = moment.squaredNorm();
  constexpr double kMinSine = 1e-12;
  if (!(square > kMinSine * kMinSine)) return false;
  const double h = -base.cross(ray).dot(moment) / square;
  return ray.dot(base + h * r3) > 0.0 && Return(h, height);
}

bool LengthOnPlane(const PoseHypothesis& pose, const Camera& camera,
                   const std::array<Vector2d, 2>& segment, double sigma_px, Measurement* length) {
  const auto function = [](const CameraPose& at, const std::vector<Vector3d>& x, double* value) {
    return LengthOnPlane(at, x[0], x[1], value);
  };
  return MeasureOnPlane(function, pose, camera, {segment.begin(), segment.end()}, sigma_px, length);
}

bool LengthRatio(const PoseHypothesis& pose, const Camera& camera,
                 const std::array<Vector2d, 4>& segments, double sigma_px, Measurement* ratio) {
  const auto function = [](const CameraPose& at, const std::vector<Vector3d>& x, double* value) {
    return LengthRatio(at, {x[0], x[1], x[2], x[3]}, value);
  };
  return MeasureOnPlane(function, pose, camera, {segments.begin(), segments.end()}, sigma_px,
                        ratio);
}

bool AngleOnPlane(const PoseHypothesis& pose, const Camera& camera,
                  const std::array<Vector2d, 4>& segments, double sigma_px, Measurement* angle) {
  const auto function = [](const CameraPose& at, const std::vector<Vector3d>& x, double* value) {
    return AngleOnPlane(at, {x[0], x[1], x[2], x[3]}, value);
  };
  return Propagate(function, 2.0 * kPi, pose, camera, {segments.begin(), segments.end()}, sigma_px,
                   angle);
}

bool AreaOnPlane(const PoseHypothesis& pose, const Camera& camera,
                 const std::vector<Vector2d>& corners, double sigma_px, Measurement* area) {
  const auto function = [](const CameraPose& at, const std::vector<Vector3d>& x, double* value) {
    return AreaOnPlane(at, x, value);
  };
  return MeasureOnPlane(function, pose, camera, corners, sigma_px, area);
}

bool HeightOverPlane(const PoseHypothesis& pose, const Camera& camera,
                     const std::array<Vector2d, 2>& foot_and_top, double sigma_px,
                     Measurement* height) {
  const auto function = [](const CameraPose& at, const std::vector<Vector3d>& x, double* value) {
    return HeightOverPlane(at, x[0], x[1], value);
  };
  return MeasureOnPlane(function, pose, camera, {foot_and_top.begin(), foot_and_top.end()},
                        sigma_px, height);
}

bool MeasureOnPlane(const PlaneFunction& function, const PoseHypothesis& pose, const Camera& camera,
                    const std::vector<Vector2d>& pixels, double sigma_px,
                    Measurement* measurement) {
  return Propagate(function, std::numeric_limits<double>::infinity(), pose, camera, pixels,
                   sigma_px, measurement);
}

}  // namespace circline
