// The cost functions of contours: how a circle's image follows from pose and circle.
#include <Eigen/Dense>
#include <algorithm>
#include <utility>
#include <vector>

#include "circline/refine/block_chain.h"
#include "circline/refine/cost_functions.h"

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

// Writes the derivatives by a pose and by a circle of its world: a centre C and a normal N.
// `U`: those of the residuals by the conic.
template <typename Rows>
class CircleChain {
 public:
  CircleChain(const Rows& U, const Eigen::Matrix3d& R, const CircleInCamera& circle,
              const ImagePoints& points)
      : R_(R), by_circle_(U * ImageJacobian(circle, points)) {}

  auto ByPoint() const { return by_circle_.template leftCols<3>(); }
  auto ByNormal() const { return by_circle_.template middleCols<3>(3); }
  auto ByRadius() const { return by_circle_.col(6); }
  void WritePose(const Eigen::Vector3d& C, const Eigen::Vector3d& N, const double* quaternion,
                 int num_residuals, double** jacobians) const {
    WriteJacobian((ByPoint() * (-R_ * CrossMatrix(C)) + ByNormal() * (-R_ * CrossMatrix(N))) *
                      DeltaFromQuaternion(quaternion),
                  num_residuals, 0, jacobians);
    WriteJacobian(ByPoint(), num_residuals, 1, jacobians);
  }

 private:
  const Eigen::Matrix3d& R_;
  Eigen::Matrix<double, Eigen::Dynamic, 7, 0, CurveModel::kMaxSize, 7> by_circle_;
};

CircleInCamera WorldCircle(const Eigen::Matrix3d& R, const double* const* parameters) {
  return {R * Eigen::Vector3d(parameters[2]) + Eigen::Vector3d(parameters[1]),
          R * Eigen::Vector3d(parameters[3]), parameters[4][0]};
}

}  // namespace

CircleContourCost::CircleContourCost(ImagePoints points, Blocks blocks)
    : CurveCost(std::move(points), 5, {4, 3, 3, 3, 1}, blocks.offset, blocks.camera, 0) {}

void CircleContourCost::Distances(const double* const* parameters,
                                  std::vector<double>* distances) const {
  const CircleInCamera circle = WorldCircle(RotationFromBlock(parameters[0]), parameters);
  points()->ConicDistances(ImageOfCircle(circle), Offset(parameters), CameraShifts(parameters),
                           distances);
}

bool CircleContourCost::EvaluateWith(const Weighing& weighing, const double* const* parameters,
                                     double* residuals, double** jacobians) const {
  const Eigen::Matrix3d R = RotationFromBlock(parameters[0]);
  const CircleInCamera circle = WorldCircle(R, parameters);
  Rows U;
  if (!(circle.p.z() > 0.0) ||
      !SumAbout(ImageOfCircle(circle), weighing, parameters, residuals, jacobians, &U))
    return false;
  if (jacobians == nullptr) return true;
  const CircleChain<Rows> by(U, R, circle, *points());
  by.WritePose(Eigen::Vector3d(parameters[2]), Eigen::Vector3d(parameters[3]), parameters[0],
               num_residuals(), jacobians);
  WriteJacobian(by.ByPoint() * R, num_residuals(), 2, jacobians);
  WriteJacobian(by.ByNormal() * R, num_residuals(), 3, jacobians);
  WriteJacobian(by.ByRadius(), num_residuals(), 4, jacobians);
  return true;
}

namespace {

constexpr int kPriorRows = 3;
constexpr double kHeld = 1e-6;  // Stands for a standard deviation of 0.

PlaneCircle InWorld(const double* const* parameters, bool tilted) {
  return {parameters[2], parameters[3][0], tilted ? parameters[4] : nullptr};
}

CircleInCamera InCamera(const PlaneCircle& circle, const Eigen::Matrix3d& R,
                        const double* translation) {
  return {R * circle.center + Eigen::Vector3d(translation), R * circle.normal, circle.radius};
}

}  // namespace

PlaneCircleContourCost::PlaneCircleContourCost(ImagePoints points, Blocks blocks)
    : CurveCost(
          std::move(points), 5,
          blocks.tilt_and_height ? std::vector<int>{4, 3, 2, 1, 3} : std::vector<int>{4, 3, 2, 1},
          blocks.offset, blocks.camera, blocks.tilt_and_height ? kPriorRows : 0),
      blocks_(blocks) {}

void PlaneCircleContourCost::Distances(const double* const* parameters,
                                       std::vector<double>* distances) const {
  const CircleInCamera circle = InCamera(InWorld(parameters, blocks_.tilt_and_height),
                                         RotationFromBlock(parameters[0]), parameters[1]);
  points()->ConicDistances(ImageOfCircle(circle), Offset(parameters), CameraShifts(parameters),
                           distances);
}

bool PlaneCircleContourCost::EvaluateWith(const Weighing& weighing, const double* const* parameters,
                                          double* residuals, double** jacobians) const {
  const bool tilted = blocks_.tilt_and_height;
  const Eigen::Matrix3d R = RotationFromBlock(parameters[0]);
  const PlaneCircle in_world = InWorld(parameters, tilted);
  const CircleInCamera circle = InCamera(in_world, R, parameters[1]);
  Rows U;
  if (!(circle.p.z() > 0.0) || !(circle.r > 0.0) ||
      !SumAbout(ImageOfCircle(circle), weighing, parameters, residuals, jacobians, &U))
    return false;
  const double tilt_sigma = std::max(blocks_.tilt_sigma, kHeld),
               height_sigma = std::max(blocks_.height_sigma, kHeld);
  const double sigmas[kPriorRows] = {tilt_sigma, tilt_sigma, height_sigma};
  double* prior = residuals + num_curve_residuals();
  for (int k = 0; tilted && k < kPriorRows; ++k) prior[k] = parameters[4][k] / sigmas[k];
  if (jacobians == nullptr) return true;
  const int rows = num_residuals();
  const CircleChain<Rows> by(U, R, circle, *points());
  by.WritePose(in_world.center, in_world.normal, parameters[0], rows, jacobians);
  WriteJacobian(by.ByPoint() * R.leftCols<2>(), rows, 2, jacobians);
  const double height = tilted ? parameters[4][2] : 0.0;
  WriteJacobian(by.ByRadius() + height * (by.ByPoint() * R.col(2)), rows, 3, jacobians);
  if (tilted && jacobians[4] != nullptr) {
    Eigen::Matrix<double, Eigen::Dynamic, 3, 0, CurveModel::kMaxSize, 3> by_tilt(U.rows(), 3);
    by_tilt.leftCols<2>() = by.ByNormal() * R.leftCols<2>();
    by_tilt.col(2) = circle.r * (by.ByPoint() * R.col(2));
    WriteJacobian(by_tilt, rows, 4, jacobians);
    for (int k = 0; k < kPriorRows; ++k)
      jacobians[4][(num_curve_residuals() + k) * 3 + k] = 1.0 / sigmas[k];
  }
  return true;
}

}  // namespace circline
