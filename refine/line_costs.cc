// The cost functions of lines and points.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "circline/refine/block_chain.h"
#include "circline/refine/cost_functions.h"
#include "circline/refine/square_root.h"

namespace circline {

// --- Lines of one direction ---

namespace {
constexpr int kDirectionRows = 2;  // A direction has two degrees of freedom.
}  // namespace

ParallelLinesCost::ParallelLinesCost(std::vector<Line> lines, Options options)
    : lines_(std::move(lines)), active_(lines_.size(), 1), options_(options) {
  CurveModel model;
  for (const Line& line : lines_) {
    line.points.SumLine(line.fit, nullptr, Weighing(), {}, &model);
    information_.push_back(model.h);
  }
  for (const int size : {4, 3}) mutable_parameter_block_sizes()->push_back(size);
  if (options.camera) mutable_parameter_block_sizes()->push_back(kCameraSize);
  set_num_residuals(kDirectionRows + (options.camera ? kCameraSize : 0) + 1);
}

// In the camera frame, with m and m' orthonormal across the direction d, a line is m + e d, m
// turned by an angle towards m': two unknowns, of which e has a Gaussian prior, or is 0. If d moves
// by x (across d), m becomes m - (m . x) d and e d becomes e d + e x: the direction acts through m
// . x, against e.
bool ParallelLinesCost::Place(std::size_t index, const Eigen::Vector3d& d, const double* camera,
                              const Weighing& weighing, bool camera_variable, Placed* placed,
                              bool with_model) const {
  const Line& line = lines_[index];
  const double sigma = options_.direction_sigma;
  const double information = sigma > 0.0 ? 1.0 / (sigma * sigma) : 0.0;
  // Own unknowns: the angle, and e where it is not 0.
  const auto system = [&](const Eigen::Vector3d& turned, const Eigen::Matrix3d& h,
                          const Eigen::Vector3d& by_line, double along, Eigen::Matrix2d* H,
                          Eigen::Vector2d* g) {
    Eigen::Matrix<double, 3, 2> J;
    J << turned, d;
    *H = J.transpose() * h * J;
    *g = J.transpose() * by_line;
    (*H)(1, 1) += information;
    (*g)[1] += information * along;
    if (!(sigma > 0.0)) {
      (*H)(0, 1) = (*H)(1, 0) = (*g)[1] = 0.0;
      (*H)(1, 1) = 1.0;
    }
    constexpr double kAnyInformation = 1e-6;  // Where all points are outliers of a bent loss.
    (*H)(0, 0) += kAnyInformation;
  };
  // The quadratic model about its own fit says where to start: the fit as this camera sees it.
  Eigen::Vector3d fit = line.fit;
  Eigen::Matrix3d h_fit = information_[index];
  const bool is_shifted = camera != nullptr && std::any_of(camera, camera + kCameraSize,
                                                           [](double s) { return s != 0.0; });
  if (is_shifted && line.points.LineThrough(camera, line.fit, &fit)) {
    // Lines of this camera to those of the one as given, where the lens does not bend.
    const Eigen::Vector3d back(std::exp(-camera[0]), std::exp(-camera[0] - camera[1]), 1.0);
    const double length = back.cwiseProduct(fit).norm();
    h_fit = back.asDiagonal() * h_fit * back.asDiagonal() / (length * length);
  }
  Eigen::Vector3d m = fit - d * d.dot(fit);
  const double norm = m.norm();
  constexpr double kAcross = 1e-6;  // The fit runs straight across the direction.
  if (!(norm > kAcross * fit.norm())) return false;
  m /= norm;
  const Eigen::Vector3d own_fit = fit / norm;
  double e = sigma > 0.0 ? d.dot(own_fit) : 0.0;
  Eigen::Vector3d turned = d.cross(m);
  Eigen::Matrix2d H;
  Eigen::Vector2d g;
  const auto move = [&](const Eigen::Vector2d& x) {
    m = (std::cos(x[0]) * m + std::sin(x[0]) * turned).normalized();
    e += x[1];
    turned = d.cross(m);
  };
  system(turned, h_fit, h_fit * (m + e * d - own_fit), e, &H, &g);
  constexpr double kMostTurn = 0.3;  // Radians; the model is no good for more.
  const Eigen::Vector2d first = -(H.inverse() * g);
  if (H.determinant() > 0.0 && std::abs(first[0]) < kMostTurn) move(first);

  // Newton steps, as long as the last one has shown the loss's true curvature to allow, halved
  // where one overshoots.
  CurveModel model;
  constexpr int kMaxSteps = 30;
  constexpr double kConverged = 1e-8;  // Of cost.
  const auto cost_at = [&](const Eigen::Vector3d& across, double along, CurveModel* out) {
    return line.points.SumLine(across + along * d, camera, weighing, {}, out) +
           information * along * along;
  };
  double twice_cost = cost_at(m, e, &model);
  Eigen::Vector2d last_step = Eigen::Vector2d::Zero(), last_g = Eigen::Vector2d::Zero();
  double last_curvature = 0.0;  // Of the model, along the last step.
  for (int step = 0; step < kMaxSteps; ++step) {
    if (!std::isfinite(twice_cost)) return false;
    system(turned, model.h, model.g, e, &H, &g);
    if (!(H.determinant() > 0.0)) break;
    Eigen::Vector2d x = -(H.inverse() * g);
    if (!(-g.dot(x) > kConverged)) break;
    if (last_curvature > 0.0) {
      constexpr double kLongest = 10.0;
      const double measured = (g - last_g).dot(last_step) / last_curvature;
      x *= std::clamp(1.0 / std::max(measured, 1.0 / kLongest), 0.2, kLongest);
    }
    last_g = g;
    bool lower = false;
    for (int half = 0; half < 6 && !lower; ++half, x *= 0.5) {
      const Eigen::Vector3d tried = (std::cos(x[0]) * m + std::sin(x[0]) * turned).normalized();
      const double cost = cost_at(tried, e + x[1], &model);
      if (!(cost < twice_cost)) continue;
      lower = true;
      last_step = x;
      last_curvature = x.dot(H * x);
      move(x);
      twice_cost = cost;
    }
    if (!lower) {
      cost_at(m, e, &model);
      break;
    }
  }
  if (camera_variable) {
    line.points.SumLine(m + e * d, camera, weighing, {false, true}, &model);
  }
  placed->line = m + e * d;
  placed->across = m;
  placed->twice_cost = twice_cost;
  if (!with_model) return true;

  // Own unknowns (angle, e), then the direction's m . x, which is -e, then the camera.
  const int n = 1 + (camera_variable ? kCameraSize : 0);
  Eigen::Matrix3d J;
  J << turned, d, -(1.0 + e * e) * d;
  return Eliminate(model, J, e, n, placed);
}

// Chains a line's model to its own unknowns, the direction and the camera, and eliminates the
// first.
bool ParallelLinesCost::Eliminate(const CurveModel& model, const Eigen::Matrix3d& J, double e,
                                  int n, Placed* placed) const {
  const double sigma = options_.direction_sigma;
  const double information = sigma > 0.0 ? 1.0 / (sigma * sigma) : 0.0;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3 + kCameraSize, 3 + kCameraSize> H =
      model.h;
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3 + kCameraSize, 1> g = model.g;
  H.topRows(3) = (J.transpose() * H.topRows(3)).eval();
  H.leftCols(3) = (H.leftCols(3) * J).eval();
  g.head(3) = (J.transpose() * g.head(3)).eval();
  H(1, 1) += information;
  g[1] += information * e;
  if (!(sigma > 0.0)) {
    H.row(1).setZero();
    H.col(1).setZero();
    H(1, 1) = 1.0;
    g[1] = 0.0;
  }
  const Eigen::LLT<Eigen::Matrix2d> own(H.topLeftCorner<2, 2>());
  if (own.info() != Eigen::Success) {  // Nothing known of it: all points far out.
    placed->gradient.setZero(n);
    placed->hessian.setZero(n, n);
  } else {
    const auto cross = H.topRightCorner(2, n);
    Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, 1 + kCameraSize> gain = cross;
    own.solveInPlace(gain);
    placed->hessian = H.bottomRightCorner(n, n) - cross.transpose() * gain;
    placed->gradient = g.tail(n) - gain.transpose() * g.head(2);
  }
  placed->g = placed->gradient[0];
  placed->h = std::max(0.0, placed->hessian(0, 0));
  return std::isfinite(placed->g) && std::isfinite(placed->h);
}

bool ParallelLinesCost::EvaluateWith(const Weighing& weighing, const double* const* parameters,
                                     double* residuals, double** jacobians) const {
  const Eigen::Matrix3d R = RotationFromBlock(parameters[0]);
  const Eigen::Vector3d in_world = Eigen::Vector3d(parameters[1]).normalized();
  const Eigen::Vector3d d = R * in_world;
  const double* camera = options_.camera ? parameters[2] : nullptr;
  const bool camera_variable = options_.camera && jacobians != nullptr && jacobians[2] != nullptr;
  const int n = 3 + (camera_variable ? kCameraSize : 0);
  constexpr int kMax = 3 + kCameraSize;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMax, kMax> H;
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMax, 1> g;
  H.setZero(n, n);
  g.setZero(n);
  double twice_cost = 0.0;
  Placed placed;
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    if (active_[i] == 0) continue;
    if (!Place(i, d, camera, weighing, camera_variable, &placed, jacobians != nullptr))
      return false;
    twice_cost += placed.twice_cost;
    if (jacobians == nullptr) continue;
    const Eigen::Vector3d& m = placed.across;
    H.topLeftCorner<3, 3>() += placed.h * m * m.transpose();
    g.head<3>() += placed.g * m;
    if (!camera_variable) continue;
    const auto by_camera = placed.hessian.row(0).tail(kCameraSize);
    H.topRightCorner(3, kCameraSize) += m * by_camera;
    H.bottomLeftCorner(kCameraSize, 3) += by_camera.transpose() * m.transpose();
    H.bottomRightCorner(kCameraSize, kCameraSize) +=
        placed.hessian.bottomRightCorner(kCameraSize, kCameraSize);
    g.tail(kCameraSize) += placed.gradient.tail(kCameraSize);
  }
  if (jacobians == nullptr) {
    CostOnly(twice_cost, num_residuals(), residuals);
    return true;
  }
  const SquareRoot<kMax> root(H, g, twice_cost, n - 1);
  std::fill(residuals, residuals + num_residuals(), 0.0);
  Eigen::Map<Eigen::VectorXd>(residuals, root.f.size()) = root.f;
  residuals[num_residuals() - 1] = root.rest;
  const auto by_direction = root.U.leftCols(3);
  WriteJacobian(by_direction * (-R * CrossMatrix(in_world)) * DeltaFromQuaternion(parameters[0]),
                num_residuals(), 0, jacobians);
  WriteJacobian(by_direction * R, num_residuals(), 1, jacobians);
  if (camera_variable) WriteJacobian(root.U.rightCols(kCameraSize), num_residuals(), 2, jacobians);
  return true;
}

// --- A line of the plane ---

PlaneLineCost::PlaneLineCost(ImagePoints points, bool camera)
    : points_(std::move(points)), has_camera_(camera) {
  for (const int size : {4, 3, 2, 1}) mutable_parameter_block_sizes()->push_back(size);
  if (camera) mutable_parameter_block_sizes()->push_back(kCameraSize);
  set_num_residuals(2 + (camera ? kCameraSize : 0) + 1);
}

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

Eigen::Vector3d PlaneLineCost::ImageOf(const double* const* parameters) {
  const PlaneLine line(parameters);
  return line.p.cross(line.d);
}

bool PlaneLineCost::EvaluateWith(const Weighing& weighing, const double* const* parameters,
                                 double* residuals, double** jacobians) const {
  const PlaneLine line(parameters);
  const ImagePoints::Variables variables{
      false, has_camera_ && jacobians != nullptr && jacobians[4] != nullptr};
  CurveModel model;
  const double twice_cost =
      points_.SumLine(line.p.cross(line.d), has_camera_ ? parameters[4] : nullptr, weighing,
                      variables, jacobians != nullptr ? &model : nullptr);
  if (!std::isfinite(twice_cost)) return false;
  if (jacobians == nullptr) {
    CostOnly(twice_cost, num_residuals(), residuals);
    return true;
  }
  const int rank = static_cast<int>(model.g.size()) - 1;
  const SquareRoot<CurveModel::kMaxSize> root(model.h, model.g, twice_cost, rank);
  std::fill(residuals, residuals + num_residuals(), 0.0);
  Eigen::Map<Eigen::VectorXd>(residuals, root.f.size()) = root.f;
  residuals[num_residuals() - 1] = root.rest;
  const auto U = root.U.leftCols(3);
  const Eigen::Matrix3d by_p = -CrossMatrix(line.d), by_d = CrossMatrix(line.p);
  const int rows = num_residuals();
  WriteJacobian(
      U * (by_p * (-line.R * CrossMatrix(line.X)) + by_d * (-line.R * CrossMatrix(line.D))) *
          DeltaFromQuaternion(parameters[0]),
      rows, 0, jacobians);
  WriteJacobian(U * by_p, rows, 1, jacobians);
  WriteJacobian(U * by_p * line.R.leftCols<2>(), rows, 2, jacobians);
  const Eigen::Vector3d turned(-line.D.y(), line.D.x(), 0.0);
  WriteJacobian(U * (by_d * (line.R * turned)), rows, 3, jacobians);
  if (variables.camera) WriteJacobian(root.U.rightCols(kCameraSize), rows, 4, jacobians);
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
  constexpr double kLeastCurvature = 0.4;  // As for curves (image_points.cc).
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
    if (camera.model != CameraModel::kPinhole)
      by_camera.col(4) = LensSlope(camera, 0).At(camera, p.head<2>() / p.z(), nullptr);
    WriteJacobian(root.U * by_camera / sigma_px_, 3, 3, jacobians);
  }
  return true;
}

}  // namespace circline
