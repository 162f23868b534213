#include "circline/refine/cost_functions.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "circline/estimators/conic.h"
#include "circline/estimators/geometric_residuals.h"
#include "circline/estimators/pose.h"

namespace circline {
namespace {

// Residual and Jacobian factor of sqrt(rho((d / sigma)^2)): the squared sum is exactly sum rho, and
// Ceres needs no loss of its own for each point.
struct Robust {
  double residual, factor;  // d residual = factor * d distance.
};

Robust ApplyLoss(LossType type, double distance, double sigma, double stretch) {
  if (type == LossType::kTrivial) return {distance / sigma, 1.0 / sigma};
  const double width = sigma * stretch;
  const double r = distance / width;
  const double s = r * r;
  if (s < 1e-16) return {distance / sigma, 1.0 / sigma};
  const LossValue loss = EvaluateLoss(type, s);
  const double ratio = std::sqrt(loss.rho / s);
  return {stretch * r * ratio, loss.rho_prime / (ratio * sigma)};
}

template <int kRows, int kCols>
using RowMajor =
    Eigen::Matrix<double, kRows, kCols, (kCols == 1 ? Eigen::ColMajor : Eigen::RowMajor)>;

// The whole conic as a function of its parameters.
struct ProjectedCircle {
  Eigen::Matrix3d conic;
  Eigen::Matrix<double, 6, 6>
      jacobian;  // d ConicToVector(conic) / d (body rotation, cx, cy, radius).
};

ProjectedCircle ProjectPlaneCircle(const Eigen::Matrix3d& R, double facing, double cx, double cy,
                                   double radius) {
  // A calibrated point x meets the plane at y = R^T x; with Q the circle in (X, Y, 1) and
  // (X, Y, 1) ~ (y1, y2, facing y3), the image is R M R^T, M = D Q D, D = diag(1, 1, facing).
  Eigen::Matrix3d M;
  M << 1.0, 0.0, -facing * cx, 0.0, 1.0, -facing * cy, -facing * cx, -facing * cy,
      cx * cx + cy * cy - radius * radius;
  ProjectedCircle out;
  out.conic = R * M * R.transpose();
  const auto set = [&](int column, const Eigen::Matrix3d& dM) {
    out.jacobian.col(column) = ConicToVector(R * dM * R.transpose());
  };
  for (int k = 0; k < 3; ++k) {
    const Eigen::Matrix3d W = CrossMatrix(Eigen::Vector3d::Unit(k));
    set(k, W * M - M * W);
  }
  Eigen::Matrix3d dM = Eigen::Matrix3d::Zero();
  dM(0, 2) = dM(2, 0) = -facing;
  dM(2, 2) = 2.0 * cx;
  set(3, dM);
  dM.setZero();
  dM(1, 2) = dM(2, 1) = -facing;
  dM(2, 2) = 2.0 * cy;
  set(4, dM);
  dM.setZero();
  dM(2, 2) = -2.0 * radius;
  set(5, dM);
  return out;
}

}  // namespace

RotationChart::RotationChart(const Eigen::Matrix3d& base, const double* w) {
  const Eigen::Vector3d v(w[0], w[1], w[2]);
  rotation = base * ExpRotation(v);
  const double s = v.squaredNorm();
  const double angle = std::sqrt(s);
  const Eigen::Matrix3d W = CrossMatrix(v);
  const double b = angle < 1e-4 ? 0.5 - s / 24.0 : (1.0 - std::cos(angle)) / s;
  const double c = angle < 1e-4 ? 1.0 / 6.0 - s / 120.0 : (angle - std::sin(angle)) / (s * angle);
  right_jacobian = Eigen::Matrix3d::Identity() - b * W + c * W * W;
}

CircleCost::CircleCost(const PointSet* set, const double* stretch, const Eigen::Matrix3d& base,
                       double facing, bool split, double factor)
    : set_(set), stretch_(stretch), base_(base), facing_(facing), split_(split), factor_(factor) {
  set_num_residuals(static_cast<int>(set->points.size()));
  *mutable_parameter_block_sizes() = split ? std::vector<int>{3, 2, 1} : std::vector<int>{3, 3};
}

bool CircleCost::Evaluate(double const* const* parameters, double* residuals,
                          double** jacobians) const {
  const RotationChart chart(base_, parameters[0]);
  const double* center = parameters[1];
  const double radius = split_ ? factor_ * parameters[2][0] : parameters[1][2];
  const ProjectedCircle circle =
      ProjectPlaneCircle(chart.rotation, facing_, center[0], center[1], radius);
  Eigen::Matrix<double, 6, 6> to_parameters = circle.jacobian;
  to_parameters.leftCols<3>() = (circle.jacobian.leftCols<3>() * chart.right_jacobian).eval();
  Vector6d per_conic;
  for (std::size_t i = 0; i < set_->points.size(); ++i) {
    const double d = ConicDistance(set_->points[i], circle.conic, &per_conic);
    if (!std::isfinite(d)) return false;
    const Robust robust = ApplyLoss(set_->loss, d, set_->sigma_px, *stretch_);
    residuals[i] = robust.residual;
    if (jacobians == nullptr) continue;
    const Eigen::Matrix<double, 1, 6> row = robust.factor * per_conic.transpose() * to_parameters;
    if (jacobians[0] != nullptr) Eigen::Map<RowMajor<1, 3>>(jacobians[0] + 3 * i) = row.head<3>();
    if (split_) {
      if (jacobians[1] != nullptr)
        Eigen::Map<RowMajor<1, 2>>(jacobians[1] + 2 * i) = row.segment<2>(3);
      if (jacobians[2] != nullptr) jacobians[2][i] = factor_ * row[5];
    } else if (jacobians[1] != nullptr) {
      Eigen::Map<RowMajor<1, 3>>(jacobians[1] + 3 * i) = row.tail<3>();
    }
  }
  return true;
}

Eigen::Matrix3d CircleCost::Conic(double const* const* parameters) const {
  const double radius = split_ ? factor_ * parameters[2][0] : parameters[1][2];
  const RotationChart chart(base_, parameters[0]);
  return ProjectPlaneCircle(chart.rotation, facing_, parameters[1][0], parameters[1][1], radius)
      .conic;
}

void PencilBasis(const Eigen::Vector3d& direction, Eigen::Vector3d* a, Eigen::Vector3d* b) {
  *a = direction.unitOrthogonal();
  *b = direction.cross(*a);
}

LineCost::LineCost(Kind kind, const PointSet* set, const double* stretch,
                   const Eigen::Matrix3d& base, double facing, const Eigen::Vector3d& direction)
    : kind_(kind),
      set_(set),
      stretch_(stretch),
      base_(base),
      facing_(facing),
      direction_(direction) {
  set_num_residuals(static_cast<int>(set->points.size()));
  std::vector<int>& sizes = *mutable_parameter_block_sizes();
  switch (kind) {
    case Kind::kFixedDirection:
      sizes = {3, 1};
      break;
    case Kind::kInPlane:
      sizes = {3, 1, 1};
      break;
    case Kind::kXAxis:
    case Kind::kYAxis:
      sizes = {3, 2};
      break;
    case Kind::kDiameter:
      sizes = {3, 2, 1};
      break;
  }
}

Eigen::Vector3d LineCost::WorldNormal(double const* const* parameters,
                                      Eigen::Matrix3d* derivatives) const {
  Eigen::Matrix3d dm = Eigen::Matrix3d::Zero();
  Eigen::Vector3d m;
  switch (kind_) {
    case Kind::kFixedDirection: {
      Eigen::Vector3d a, b;
      PencilBasis(direction_, &a, &b);
      const double phi = parameters[1][0];
      m = std::cos(phi) * a + std::sin(phi) * b;
      dm.col(0) = -std::sin(phi) * a + std::cos(phi) * b;
      break;
    }
    case Kind::kInPlane: {
      // Basis across (cos theta, sin theta, 0): the in-plane normal and Z.
      const double c = std::cos(parameters[1][0]), s = std::sin(parameters[1][0]);
      const double cp = std::cos(parameters[2][0]), sp = std::sin(parameters[2][0]);
      m = Eigen::Vector3d(-s * cp, c * cp, sp);
      dm.col(0) = Eigen::Vector3d(-c * cp, -s * cp, 0.0);
      dm.col(1) = Eigen::Vector3d(s * sp, -c * sp, cp);
      break;
    }
    case Kind::kXAxis:
      m = Eigen::Vector3d(0.0, 1.0, -facing_ * parameters[1][1]);
      dm.col(1) = Eigen::Vector3d(0.0, 0.0, -facing_);
      break;
    case Kind::kYAxis:
      m = Eigen::Vector3d(1.0, 0.0, -facing_ * parameters[1][0]);
      dm.col(0) = Eigen::Vector3d(0.0, 0.0, -facing_);
      break;
    case Kind::kDiameter: {
      const double x = parameters[1][0], y = parameters[1][1];
      const double c = std::cos(parameters[2][0]), s = std::sin(parameters[2][0]);
      m = Eigen::Vector3d(-s, c, facing_ * (s * x - c * y));
      dm.col(0) = Eigen::Vector3d(0.0, 0.0, facing_ * s);
      dm.col(1) = Eigen::Vector3d(0.0, 0.0, -facing_ * c);
      dm.col(2) = Eigen::Vector3d(-c, -s, facing_ * (c * x + s * y));
      break;
    }
  }
  if (derivatives != nullptr) *derivatives = dm;
  return m;
}

Eigen::Vector3d LineCost::Line(double const* const* parameters) const {
  return (RotationChart(base_, parameters[0]).rotation * WorldNormal(parameters, nullptr))
      .normalized();
}

bool LineCost::Evaluate(double const* const* parameters, double* residuals,
                        double** jacobians) const {
  Eigen::Matrix3d dm;
  const Eigen::Vector3d m = WorldNormal(parameters, &dm);
  const RotationChart chart(base_, parameters[0]);
  const Eigen::Vector3d line = chart.rotation * m;
  const Eigen::Matrix3d by_rotation = -chart.rotation * CrossMatrix(m) * chart.right_jacobian;
  const Eigen::Matrix3d by_others = chart.rotation * dm;
  Eigen::Vector3d per_line;
  for (std::size_t i = 0; i < set_->points.size(); ++i) {
    const double d = LineDistance(set_->points[i], line, &per_line);
    if (!std::isfinite(d)) return false;
    const Robust robust = ApplyLoss(set_->loss, d, set_->sigma_px, *stretch_);
    residuals[i] = robust.residual;
    if (jacobians == nullptr) continue;
    const Eigen::Vector3d row = robust.factor * per_line;
    if (jacobians[0] != nullptr) {
      Eigen::Map<RowMajor<1, 3>>(jacobians[0] + 3 * i) = row.transpose() * by_rotation;
    }
    int column = 0;
    for (std::size_t block = 1; block < parameter_block_sizes().size(); ++block) {
      const int size = parameter_block_sizes()[block];
      for (int k = 0; k < size; ++k, ++column) {
        if (jacobians[block] == nullptr) continue;
        jacobians[block][static_cast<std::size_t>(size) * i + static_cast<std::size_t>(k)] =
            row.dot(by_others.col(column));
      }
    }
  }
  return true;
}

PointCost::PointCost(const CalibratedPoint& measured, double sigma_px, LossType loss,
                     const double* stretch, const Eigen::Matrix3d& base, double facing)
    : x_(measured.x), loss_(loss), stretch_(stretch), base_(base), facing_(facing) {
  Eigen::Matrix2d x_from_pixel;
  x_from_pixel << measured.x_from_pixel[0], measured.x_from_pixel[1], measured.x_from_pixel[2],
      measured.x_from_pixel[3];
  whitener_ = x_from_pixel.inverse() / sigma_px;
  set_num_residuals(2);
  *mutable_parameter_block_sizes() = {3, 2};
}

bool PointCost::Evaluate(double const* const* parameters, double* residuals,
                         double** jacobians) const {
  const RotationChart chart(base_, parameters[0]);
  const Eigen::Vector3d p(parameters[1][0], parameters[1][1], facing_);
  const Eigen::Vector3d X = chart.rotation * p;
  if (!(X.z() > 0.0)) return false;  // Behind the camera.
  const Eigen::Vector2d miss = whitener_ * (X.head<2>() / X.z() - x_);
  // sqrt(rho(|miss|^2)) along miss, as ApplyLoss does for a scalar.
  const double norm = miss.norm();
  const Robust robust = ApplyLoss(loss_, norm, 1.0, *stretch_);
  const double ratio = norm > 1e-8 ? robust.residual / norm : 1.0;
  Eigen::Map<Eigen::Vector2d>{residuals} = ratio * miss;
  if (jacobians == nullptr) return true;
  Eigen::Matrix2d by_miss = ratio * Eigen::Matrix2d::Identity();
  if (norm > 1e-8) by_miss += (robust.factor - ratio) / (norm * norm) * miss * miss.transpose();
  Eigen::Matrix<double, 2, 3> project;
  project << 1.0, 0.0, -X.x() / X.z(), 0.0, 1.0, -X.y() / X.z();
  const Eigen::Matrix<double, 2, 3> by_point = by_miss * whitener_ * project / X.z();
  if (jacobians[0] != nullptr) {
    Eigen::Map<RowMajor<2, 3>>{jacobians[0]} =
        -by_point * chart.rotation * CrossMatrix(p) * chart.right_jacobian;
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<RowMajor<2, 2>>{jacobians[1]} = (by_point * chart.rotation).leftCols<2>();
  }
  return true;
}

AngleCost::AngleCost(double value, double sigma, const double fixed[2])
    : value_(value), sigma_(sigma), fixed_{fixed[0], fixed[1]} {
  set_num_residuals(1);
  for (double f : fixed_) {
    if (std::isnan(f)) mutable_parameter_block_sizes()->push_back(1);
  }
}

bool AngleCost::Evaluate(double const* const* parameters, double* residuals,
                         double** jacobians) const {
  double theta[2];
  int block = 0;
  for (int i = 0; i < 2; ++i) theta[i] = std::isnan(fixed_[i]) ? parameters[block++][0] : fixed_[i];
  // Directions have no sense: the difference counts modulo 180 degrees, and so does its sign.
  constexpr double kPi = 3.14159265358979323846;
  const double difference = theta[1] - theta[0];
  const double plus = std::remainder(difference - value_, kPi),
               minus = std::remainder(difference + value_, kPi);
  residuals[0] = (std::abs(plus) < std::abs(minus) ? plus : minus) / sigma_;
  if (jacobians == nullptr) return true;
  block = 0;
  for (int i = 0; i < 2; ++i) {
    if (!std::isnan(fixed_[i])) continue;
    if (jacobians[block] != nullptr) jacobians[block][0] = (i == 0 ? -1.0 : 1.0) / sigma_;
    ++block;
  }
  return true;
}

LengthCost::LengthCost(double length) : length_(length) {
  set_num_residuals(1);
  *mutable_parameter_block_sizes() = {2, 2, 1};
}

bool LengthCost::Evaluate(double const* const* parameters, double* residuals,
                          double** jacobians) const {
  constexpr double kRelativeSigma = 1e-4;
  const Eigen::Vector2d difference(parameters[1][0] - parameters[0][0],
                                   parameters[1][1] - parameters[0][1]);
  const double distance = difference.norm();
  const double scale = parameters[2][0];
  if (!(distance > 0.0) || !(scale > 0.0)) return false;
  residuals[0] = std::log(distance / (length_ * scale)) / kRelativeSigma;
  if (jacobians == nullptr) return true;
  const Eigen::Vector2d gradient = difference / (distance * distance * kRelativeSigma);
  if (jacobians[0] != nullptr) Eigen::Map<Eigen::RowVector2d>{jacobians[0]} = -gradient.transpose();
  if (jacobians[1] != nullptr) Eigen::Map<Eigen::RowVector2d>{jacobians[1]} = gradient.transpose();
  if (jacobians[2] != nullptr) jacobians[2][0] = -1.0 / (scale * kRelativeSigma);
  return true;
}

}  // namespace circline
