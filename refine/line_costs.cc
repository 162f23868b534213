// The cost functions of lines and points.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/refine/block_chain.h"
#include "circline/refine/cost_functions.h"
#include "circline/refine/mostly_exact.h"
#include "circline/refine/point_sums.h"
#include "circline/refine/square_root.h"

namespace circline {
namespace {

// A residual under MostlyExact, as one that is squared: its value, and that by the residual.
struct AsSquare {
  double value, slope;

  explicit AsSquare(double r) {
    double rho[3];
    MostlyExact().Evaluate(r * r, rho);
    slope = std::sqrt(rho[1]);
    value = slope * r;
    constexpr double kNone = 1e-6;  // There they are the limits.
    if (std::abs(r) < kNone) return;
    value = std::copysign(std::sqrt(rho[0]), r);
    slope = rho[1] * r / value;
  }
};

}  // namespace

// --- A line of a direction ---

// In the camera frame, with d the direction, the line is m + e d: m is what of the fit lies across
// d, a unit vector, turned about d by the angle. The fit is where it is seen: a camera that shifts
// takes it along.
struct DirectionLineCost::Placed {
  Eigen::Matrix3d R;
  Eigen::Vector3d in_world, fit, d, m, turned, line, by_angle;
  double c, s, e, along, norm;

  Eigen::Matrix3d ByAcross() const {
    const Eigen::Matrix3d by_m = c * Eigen::Matrix3d::Identity() + s * CrossMatrix(d);
    return by_m * (Eigen::Matrix3d::Identity() - m * m.transpose()) / norm;
  }
  Eigen::Matrix3d ByDirection() const {
    const Eigen::Matrix3d across_by_d = -d * fit.transpose() - along * Eigen::Matrix3d::Identity();
    return ByAcross() * across_by_d - s * CrossMatrix(m) + e * Eigen::Matrix3d::Identity();
  }
  // By the shifts that are not of the lens.
  Eigen::Matrix<double, 3, 4> ByCamera(const Camera& camera, const Eigen::Vector3d& given) const {
    Eigen::Matrix<double, 3, 4> fit_by_shifts = Eigen::Matrix<double, 3, 4>::Zero();
    fit_by_shifts.block<2, 1>(0, 0) = fit.head<2>();
    fit_by_shifts(1, 1) = fit.y();
    fit_by_shifts(2, 2) = given.x() / camera.fx;
    fit_by_shifts(2, 3) = given.y() / camera.fy;
    return ByAcross() * (Eigen::Matrix3d::Identity() - d * d.transpose()) * fit_by_shifts;
  }
};

DirectionLineCost::DirectionLineCost(ImagePoints points, const Eigen::Vector3d& fit,
                                     Options options)
    : CurveCost(std::move(points), 2, {4, 3, options.direction_sigma > 0.0 ? 2 : 1}, false,
                options.camera, options.direction_sigma > 0.0 ? 1 : 0),
      fit_(fit.normalized()),
      options_(options) {}

void DirectionLineCost::Exchange(ImagePoints* points, const Eigen::Vector3d& fit) {
  ExchangePoints(points);
  fit_ = fit.normalized();
}

bool DirectionLineCost::Place(const double* const* parameters, const double* camera,
                              Placed* placed) const {
  Placed& p = *placed;
  p.fit = camera != nullptr ? ShiftedLine(points()->camera(), camera, fit_) : fit_;
  p.R = RotationFromBlock(parameters[0]);
  p.in_world = Eigen::Vector3d(parameters[1]).normalized();
  p.d = p.R * p.in_world;
  p.e = options_.direction_sigma > 0.0 ? parameters[2][1] : 0.0;
  p.along = p.d.dot(p.fit);
  p.m = p.fit - p.along * p.d;
  p.norm = p.m.norm();
  constexpr double kAcross = 1e-6;  // The fit runs straight across the direction.
  if (!(p.norm > kAcross)) return false;
  p.m /= p.norm;
  p.turned = p.d.cross(p.m);
  p.c = std::cos(parameters[2][0]);
  p.s = std::sin(parameters[2][0]);
  p.line = p.c * p.m + p.s * p.turned + p.e * p.d;
  p.by_angle = p.c * p.turned - p.s * p.m;
  return true;
}

void DirectionLineCost::Distances(const double* const* parameters,
                                  std::vector<double>* distances) const {
  Placed placed;
  distances->clear();
  if (Place(parameters, CameraShifts(parameters), &placed))
    points()->LineDistances(placed.line, CameraShifts(parameters), distances);
}

// The line through the vanishing point and the middle of the points.
bool DirectionLineCost::Start(const double* const* parameters, double* line) const {
  std::fill(line, line + parameter_block_sizes()[2], 0.0);
  const double* with[3] = {parameters[0], parameters[1], line};
  Placed placed;
  if (!Place(with, CameraShifts(parameters), &placed)) return false;
  const Eigen::Vector3d middle = points()->Middle(CameraShifts(parameters));
  const double along = placed.line.dot(middle), across = placed.by_angle.dot(middle);
  if (!(std::hypot(along, across) > 0.0)) return false;
  line[0] = across != 0.0 ? std::atan(-along / across) : 0.5 * kPi;
  return true;
}

bool DirectionLineCost::EvaluateWith(const Weighing& weighing, const double* const* parameters,
                                     double* residuals, double** jacobians) const {
  Placed p;
  const double* camera = CameraShifts(parameters);
  if (!Place(parameters, camera, &p)) return false;
  const bool soft = options_.direction_sigma > 0.0;
  const int rows = num_residuals(), line_rows = num_curve_residuals();
  Rows U;
  if (!SumAbout(p.line, weighing, parameters, residuals, jacobians, &U)) return false;
  const double deviation = soft ? p.e / options_.direction_sigma : 0.0;
  const AsSquare prior(deviation);
  if (soft) residuals[line_rows] = weighing.inliers_only ? deviation : prior.value;
  if (jacobians == nullptr) return true;
  const int own_size = soft ? 2 : 1;
  const Eigen::Matrix3d by_world = p.ByDirection() * p.R;
  Eigen::Matrix<double, 3, 2> by_own;
  by_own << p.by_angle, p.d;
  WriteJacobian(U * (by_world * -CrossMatrix(p.in_world)) * DeltaFromQuaternion(parameters[0]),
                rows, 0, jacobians);
  WriteJacobian(U * by_world, rows, 1, jacobians);
  WriteJacobian(U * by_own.leftCols(own_size), rows, 2, jacobians);
  if (soft && jacobians[2] != nullptr) {
    jacobians[2][own_size * line_rows + 1] =
        (weighing.inliers_only ? 1.0 : prior.slope) / options_.direction_sigma;
  }
  if (camera != nullptr && jacobians[3] != nullptr) {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, kCameraSize, Eigen::RowMajor>;
    Eigen::Map<RowMajor>(jacobians[3], rows, kCameraSize).topLeftCorner(U.rows(), 4) +=
        U * p.ByCamera(points()->camera(), fit_);
  }
  return true;
}

// --- A line of the plane ---

PlaneLineCost::PlaneLineCost(ImagePoints points, bool camera)
    : CurveCost(std::move(points), 2, {4, 3, 2, 1}, false, camera, 0) {}

namespace {

struct PlaneLine {
  Eigen::Matrix3d R;
  Eigen::Vector3d X, D;  // Point and direction, world frame.
  Eigen::Vector3d p, d;  // Camera frame.

  explicit PlaneLine(const double* const* parameters)
      : R(RotationFromBlock(parameters[0])),
        X(parameters[2][0], parameters[2][1], 0.0),
        D(std::cos(parameters[3][0]), std::sin(parameters[3][0]), 0.0),
        p(R * X + Eigen::Vector3d(parameters[1])),
        d(R * D) {}
};

}  // namespace

void PlaneLineCost::Distances(const double* const* parameters,
                              std::vector<double>* distances) const {
  const PlaneLine line(parameters);
  points()->LineDistances(line.p.cross(line.d), CameraShifts(parameters), distances);
}

bool PlaneLineCost::EvaluateWith(const Weighing& weighing, const double* const* parameters,
                                 double* residuals, double** jacobians) const {
  const PlaneLine line(parameters);
  const int rows = num_residuals();
  Rows U;
  if (!SumAbout(line.p.cross(line.d), weighing, parameters, residuals, jacobians, &U)) return false;
  if (jacobians == nullptr) return true;
  const Eigen::Matrix3d by_p = -CrossMatrix(line.d), by_d = CrossMatrix(line.p);
  WriteJacobian(
      U * (by_p * (-line.R * CrossMatrix(line.X)) + by_d * (-line.R * CrossMatrix(line.D))) *
          DeltaFromQuaternion(parameters[0]),
      rows, 0, jacobians);
  WriteJacobian(U * by_p, rows, 1, jacobians);
  WriteJacobian(U * by_p * line.R.leftCols<2>(), rows, 2, jacobians);
  const Eigen::Vector3d turned(-line.D.y(), line.D.x(), 0.0);
  WriteJacobian(U * (by_d * (line.R * turned)), rows, 3, jacobians);
  return true;
}

// --- A point of the plane ---

PlanePointCost::PlanePointCost(const Camera& camera, const Eigen::Vector2d& pixel, double sigma_px,
                               LossType loss, bool camera_block)
    : camera_(camera), pixel_(pixel), sigma_px_(sigma_px), loss_(loss), has_camera_(camera_block) {
  for (const int size : {4, 3, 2}) mutable_parameter_block_sizes()->push_back(size);
  if (camera_block) mutable_parameter_block_sizes()->push_back(kCameraSize);
  set_num_residuals(3);
}

void PlanePointCost::Reset(const Camera& camera, const Eigen::Vector2d& pixel, double sigma_px) {
  camera_ = camera;
  camera_.id.clear();  // As ImagePoints' camera.
  pixel_ = pixel;
  sigma_px_ = sigma_px;
}

double PlanePointCost::MissPx(const double* const* parameters) const {
  const Eigen::Vector3d p =
      RotationFromBlock(parameters[0]) * Eigen::Vector3d(parameters[2][0], parameters[2][1], 0.0) +
      Eigen::Vector3d(parameters[1]);
  Eigen::Vector2d pixel;
  const Camera camera = has_camera_ ? ShiftedCamera(camera_, parameters[3]) : camera_;
  if (!CameraToPixel(camera, p, &pixel)) return std::numeric_limits<double>::infinity();
  return (pixel - pixel_).norm();
}

bool PlanePointCost::EvaluateWith(const Weighing& weighing, const double* const* parameters,
                                  double* residuals, double** jacobians) const {
  const Eigen::Matrix3d R = RotationFromBlock(parameters[0]);
  const Eigen::Vector3d X(parameters[2][0], parameters[2][1], 0.0);
  const Eigen::Vector3d p = R * X + Eigen::Vector3d(parameters[1]);
  if (!(p.z() > 0.0)) return false;
  const Camera camera = has_camera_ ? ShiftedCamera(camera_, parameters[3]) : camera_;
  Eigen::Vector2d pixel;
  std::array<double, 4> J;
  DistortWithJacobian(camera, p.head<2>() / p.z(), &pixel, &J);
  const Eigen::Vector2d r = (pixel - pixel_) / sigma_px_;
  const double stretch2 = weighing.stretch * weighing.stretch;
  const double s = weighing.inliers_only ? r.squaredNorm() : r.squaredNorm() / stretch2;
  if (!std::isfinite(s)) return false;
  const bool inlier = s <= weighing.gate * weighing.gate;
  const LossSlopes loss =
      weighing.inliers_only ? LossSlopes{inlier ? 1.0 : 0.0, 0.0} : LossSlopesAt(loss_, s);
  const double twice_cost =
      weighing.scale * (weighing.inliers_only ? (inlier ? s : 0.0) : stretch2 * LossRho(loss_, s));
  if (jacobians == nullptr) {
    CostOnly(twice_cost, 3, residuals);
    return true;
  }
  Eigen::Matrix2d W = loss.first * Eigen::Matrix2d::Identity();
  if (s > 0.0) {
    const double along = std::max(loss.first + 2.0 * s * loss.second, kLeastCurvature * loss.first);
    W += (along - loss.first) / r.squaredNorm() * r * r.transpose();
  }
  const SquareRoot<2> root(weighing.scale * W, weighing.scale * loss.first * r, twice_cost, 2);
  residuals[0] = root.f[0];
  residuals[1] = root.f[1];
  residuals[2] = root.rest;
  Eigen::Matrix2d pixel_from_x;
  pixel_from_x << J[0], J[1], J[2], J[3];
  Eigen::Matrix<double, 2, 3> project;
  project << 1.0, 0.0, -p.x() / p.z(), 0.0, 1.0, -p.y() / p.z();
  const Eigen::Matrix<double, 2, 3> by_p = root.U * (pixel_from_x * project) / (p.z() * sigma_px_);
  WriteJacobian(by_p * (-R * CrossMatrix(X)) * DeltaFromQuaternion(parameters[0]), 3, 0, jacobians);
  WriteJacobian(by_p, 3, 1, jacobians);
  WriteJacobian(by_p * R.leftCols<2>(), 3, 2, jacobians);
  if (has_camera_ && jacobians[3] != nullptr) {
    Eigen::Matrix<double, 2, kCameraSize> by_camera = Eigen::Matrix<double, 2, kCameraSize>::Zero();
    by_camera.col(0) = pixel - Eigen::Vector2d(camera.cx, camera.cy);
    by_camera(1, 1) = pixel.y() - camera.cy;
    by_camera.block<2, 2>(0, 2).setIdentity();
    for (int k = 0; camera.model != CameraModel::kPinhole && 4 + k < kCameraSize; ++k)
      by_camera.col(4 + k) = LensSlope(camera, k).At(camera, p.head<2>() / p.z(), nullptr);
    WriteJacobian(root.U * by_camera / sigma_px_, 3, 3, jacobians);
  }
  return true;
}

}  // namespace circline
