// The cost functions of contours: how a circle's image follows from pose and circle.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "circline/refine/block_chain.h"
#include "circline/refine/cost_functions.h"
#include "circline/refine/square_root.h"

namespace circline {
namespace {

// A circle in the camera frame: centre p, normal m of any length, radius r.
struct CircleInCamera {
  Eigen::Vector3d p, m;
  double r;
};

// Its image. A ray x meets the plane in x d / (m . x), d = m . p; that this is at distance r from p
// is x^T C x = 0 with C = d^2 I - d (m p^T + p m^T) + (p . p - r^2) m m^T, negative inside.
Eigen::Matrix3d ImageOfCircle(const CircleInCamera& c) {
  const double d = c.m.dot(c.p);
  const Eigen::Matrix3d mp = c.m * c.p.transpose();
  return d * d * Eigen::Matrix3d::Identity() - d * (mp + mp.transpose()) +
         (c.p.squaredNorm() - c.r * c.r) * c.m * c.m.transpose();
}

// d ConicToVector(points.Normalized(image)) / d (p, m, r).
Eigen::Matrix<double, 6, 7> ImageJacobian(const CircleInCamera& c, const ImagePoints& points) {
  const double d = c.m.dot(c.p), k = c.p.squaredNorm() - c.r * c.r;
  const Eigen::Matrix3d mp = c.m * c.p.transpose(), both = mp + mp.transpose(),
                        mm = c.m * c.m.transpose();
  Eigen::Matrix<double, 6, 7> J;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d e = Eigen::Vector3d::Unit(i);
    const Eigen::Matrix3d me = c.m * e.transpose(), pe = c.p * e.transpose();
    const Eigen::Matrix3d by_p = 2.0 * d * c.m[i] * Eigen::Matrix3d::Identity() - c.m[i] * both -
                                 d * (me + me.transpose()) + 2.0 * c.p[i] * mm;
    const Eigen::Matrix3d by_m = 2.0 * d * c.p[i] * Eigen::Matrix3d::Identity() - c.p[i] * both -
                                 d * (pe + pe.transpose()) + k * (me + me.transpose());
    J.col(i) = ConicToVector(points.Normalized(by_p));
    J.col(3 + i) = ConicToVector(points.Normalized(by_m));
  }
  J.col(6) = ConicToVector(points.Normalized(-2.0 * c.r * mm));
  return J;
}

using ContourRoot = SquareRoot<CurveModel::kMaxSize>;

// Residuals of a contour, and U by (p, m, r). The caller chains to its blocks.
struct ContourResiduals {
  ContourRoot root;
  Eigen::Matrix<double, Eigen::Dynamic, 7, 0, CurveModel::kMaxSize, 7> by_circle;
};

ContourResiduals EvaluateContour(const ImagePoints& points, const CircleInCamera& circle,
                                 const CurveModel& model, int rank) {
  ContourResiduals out{SquareRootOf<CurveModel::kMaxSize>(model, rank, 6, 5), {}};
  out.by_circle = out.root.U.leftCols(6) * ImageJacobian(circle, points);
  return out;
}

// The contour's own residuals, and columns of the optional blocks, of `num_residuals` rows.
void WriteContour(const ContourRoot& root, const ImagePoints::Variables& variables, int own_rows,
                  int num_residuals, int block, double* residuals, double** jacobians) {
  std::fill(residuals, residuals + own_rows, 0.0);
  Eigen::Map<Eigen::VectorXd>(residuals, root.f.size()) = root.f;
  residuals[own_rows - 1] = root.rest;
  int column = 6;
  if (variables.offset) WriteJacobian(root.U.col(column++), num_residuals, block++, jacobians);
  if (variables.camera)
    WriteCameraJacobian(root.U.rightCols(root.U.cols() - column), num_residuals, block, jacobians);
}

// The offset and a variable lens can do what no conic can; the camera's other shifts cannot, but
// for what the lens bends.
int RankOf(const ImagePoints& points, bool offset, bool camera) {
  return 5 + (offset ? 1 : 0) + (camera ? points.options().num_distortion : 0);
}

}  // namespace

CircleContourCost::CircleContourCost(ImagePoints points, Blocks blocks)
    : points_(std::move(points)), blocks_(blocks) {
  for (const int size : {4, 3, 3, 3, 1}) mutable_parameter_block_sizes()->push_back(size);
  if (blocks.offset) mutable_parameter_block_sizes()->push_back(1);
  if (blocks.camera) mutable_parameter_block_sizes()->push_back(kCameraSize);
  set_num_residuals(RankOf(points_, blocks.offset, blocks.camera) + 1);
}

void CircleContourCost::Distances(const double* const* parameters,
                                  std::vector<double>* distances) const {
  const Eigen::Matrix3d R = RotationFromBlock(parameters[0]);
  const CircleInCamera circle{R * Eigen::Vector3d(parameters[2]) + Eigen::Vector3d(parameters[1]),
                              R * Eigen::Vector3d(parameters[3]), parameters[4][0]};
  points_.ConicDistances(ImageOfCircle(circle), blocks_.offset ? parameters[5][0] : 0.0,
                         blocks_.camera ? parameters[5 + (blocks_.offset ? 1 : 0)] : nullptr,
                         distances);
}

bool CircleContourCost::EvaluateWith(const Weighing& weighing, const double* const* parameters,
                                     double* residuals, double** jacobians) const {
  const Eigen::Matrix3d R = RotationFromBlock(parameters[0]);
  const Eigen::Vector3d center(parameters[2]), normal(parameters[3]);
  const CircleInCamera circle{R * center + Eigen::Vector3d(parameters[1]), R * normal,
                              parameters[4][0]};
  const double offset = blocks_.offset ? parameters[5][0] : 0.0;
  const double* camera = blocks_.camera ? parameters[5 + (blocks_.offset ? 1 : 0)] : nullptr;
  const ImagePoints::Variables variables{blocks_.offset, blocks_.camera};
  CurveModel model;
  const double twice_cost = points_.SumConic(ImageOfCircle(circle), offset, camera, weighing,
                                             variables, jacobians != nullptr ? &model : nullptr);
  if (!(circle.p.z() > 0.0) || !std::isfinite(twice_cost)) return false;
  if (jacobians == nullptr) {
    CostOnly(twice_cost, num_residuals(), residuals);
    return true;
  }
  const ContourResiduals out =
      EvaluateContour(points_, circle, model, RankOf(points_, variables.offset, variables.camera));
  const auto by_p = out.by_circle.leftCols<3>(), by_m = out.by_circle.middleCols<3>(3);
  WriteContour(out.root, variables, num_residuals(), num_residuals(), 5, residuals, jacobians);
  WriteJacobian((by_p * (-R * CrossMatrix(center)) + by_m * (-R * CrossMatrix(normal))) *
                    DeltaFromQuaternion(parameters[0]),
                num_residuals(), 0, jacobians);
  WriteJacobian(by_p, num_residuals(), 1, jacobians);
  WriteJacobian(by_p * R, num_residuals(), 2, jacobians);
  WriteJacobian(by_m * R, num_residuals(), 3, jacobians);
  WriteJacobian(out.by_circle.col(6), num_residuals(), 4, jacobians);
  return true;
}

namespace {

constexpr int kPriorRows = 3;
constexpr double kHeld = 1e-6;  // Stands for a standard deviation of 0.

// In the world: centre (cx, cy, height * r) and normal (tilt, 1).
struct PlaneCircle {
  Eigen::Vector3d center, normal;
  double radius;

  PlaneCircle(const double* const* parameters, bool tilt_and_height) : radius(parameters[3][0]) {
    const double* tilt = tilt_and_height ? parameters[4] : nullptr;
    center = {parameters[2][0], parameters[2][1], tilt != nullptr ? tilt[2] * radius : 0.0};
    normal = {tilt != nullptr ? tilt[0] : 0.0, tilt != nullptr ? tilt[1] : 0.0, 1.0};
  }
  CircleInCamera InCamera(const Eigen::Matrix3d& R, const double* translation) const {
    return {R * center + Eigen::Vector3d(translation), R * normal, radius};
  }
};

}  // namespace

PlaneCircleContourCost::PlaneCircleContourCost(ImagePoints points, Blocks blocks)
    : points_(std::move(points)), blocks_(blocks) {
  for (const int size : {4, 3, 2, 1}) mutable_parameter_block_sizes()->push_back(size);
  if (blocks.tilt_and_height) mutable_parameter_block_sizes()->push_back(3);
  if (blocks.offset) mutable_parameter_block_sizes()->push_back(1);
  if (blocks.camera) mutable_parameter_block_sizes()->push_back(kCameraSize);
  set_num_residuals(RankOf(points_, blocks.offset, blocks.camera) + 1 +
                    (blocks.tilt_and_height ? kPriorRows : 0));
}

void PlaneCircleContourCost::Exchange(ImagePoints* points) {
  std::swap(points_, *points);
  set_num_residuals(RankOf(points_, blocks_.offset, blocks_.camera) + 1 +
                    (blocks_.tilt_and_height ? kPriorRows : 0));
}

void PlaneCircleContourCost::Distances(const double* const* parameters,
                                       std::vector<double>* distances) const {
  const PlaneCircle circle(parameters, blocks_.tilt_and_height);
  const int offset = 4 + (blocks_.tilt_and_height ? 1 : 0),
            camera = offset + (blocks_.offset ? 1 : 0);
  points_.ConicDistances(
      ImageOfCircle(circle.InCamera(RotationFromBlock(parameters[0]), parameters[1])),
      blocks_.offset ? parameters[offset][0] : 0.0, blocks_.camera ? parameters[camera] : nullptr,
      distances);
}

bool PlaneCircleContourCost::EvaluateWith(const Weighing& weighing, const double* const* parameters,
                                          double* residuals, double** jacobians) const {
  const bool tilted = blocks_.tilt_and_height;
  const Eigen::Matrix3d R = RotationFromBlock(parameters[0]);
  const PlaneCircle in_world(parameters, tilted);
  const CircleInCamera circle = in_world.InCamera(R, parameters[1]);
  // Only where somebody asks: a camera that is held has no derivatives.
  const int first = 4 + (tilted ? 1 : 0), camera_block = first + (blocks_.offset ? 1 : 0);
  const ImagePoints::Variables variables{
      blocks_.offset, blocks_.camera && jacobians != nullptr && jacobians[camera_block] != nullptr};
  CurveModel model;
  const double twice_cost =
      points_.SumConic(ImageOfCircle(circle), blocks_.offset ? parameters[first][0] : 0.0,
                       blocks_.camera ? parameters[camera_block] : nullptr, weighing, variables,
                       jacobians != nullptr ? &model : nullptr);
  if (!(circle.p.z() > 0.0) || !(circle.r > 0.0) || !std::isfinite(twice_cost)) return false;

  const double tilt_sigma = std::max(blocks_.tilt_sigma, kHeld),
               height_sigma = std::max(blocks_.height_sigma, kHeld);
  const double sigmas[kPriorRows] = {tilt_sigma, tilt_sigma, height_sigma};
  const int curve_rows = num_residuals() - (tilted ? kPriorRows : 0);
  double* prior = residuals + curve_rows;
  for (int k = 0; tilted && k < kPriorRows; ++k) prior[k] = parameters[4][k] / sigmas[k];
  if (jacobians == nullptr) {
    CostOnly(twice_cost, curve_rows, residuals);
    return true;
  }
  const ContourResiduals out =
      EvaluateContour(points_, circle, model, RankOf(points_, variables.offset, variables.camera));
  const auto by_p = out.by_circle.leftCols<3>(), by_m = out.by_circle.middleCols<3>(3);
  const int rows = num_residuals();
  WriteContour(out.root, variables, curve_rows, rows, first, residuals, jacobians);
  WriteJacobian(
      (by_p * (-R * CrossMatrix(in_world.center)) + by_m * (-R * CrossMatrix(in_world.normal))) *
          DeltaFromQuaternion(parameters[0]),
      rows, 0, jacobians);
  WriteJacobian(by_p, rows, 1, jacobians);
  WriteJacobian(by_p * R.leftCols<2>(), rows, 2, jacobians);
  const double height = tilted ? parameters[4][2] : 0.0;
  WriteJacobian(out.by_circle.col(6) + height * (by_p * R.col(2)), rows, 3, jacobians);
  if (tilted && jacobians[4] != nullptr) {
    Eigen::Matrix<double, Eigen::Dynamic, 3, 0, CurveModel::kMaxSize, 3> by_tilt(by_p.rows(), 3);
    by_tilt.leftCols<2>() = by_m * R.leftCols<2>();
    by_tilt.col(2) = circle.r * (by_p * R.col(2));
    WriteJacobian(by_tilt, rows, 4, jacobians);
    for (int k = 0; k < kPriorRows; ++k) jacobians[4][(curve_rows + k) * 3 + k] = 1.0 / sigmas[k];
  }
  return true;
}

}  // namespace circline
