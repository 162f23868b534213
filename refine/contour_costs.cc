// The cost functions of contours: how a circle's image follows from pose and circle.
#include <Eigen/Dense>
#include <utility>
#include <vector>

#include "circline/refine/block_chain.h"
#include "circline/refine/cost_functions.h"

namespace circline {
namespace {

// A circle in the camera frame: centre p, normal m of any length, radius r, and its shape: the
// points y of its plane with (y - p)^T M (y - p) = r^2, M = I where it is round.
struct CircleInCamera {
  Eigen::Vector3d p, m;
  double r;
  Eigen::Matrix3d M = Eigen::Matrix3d::Identity();

  // A ray x meets the plane in x d / (m . x), d = m . p, which lies Q x / (m . x) from p.
  Eigen::Matrix3d Q() const { return m.dot(p) * Eigen::Matrix3d::Identity() - p * m.transpose(); }
};

// Its image, negative inside.
Eigen::Matrix3d ImageOfCircle(const CircleInCamera& c) {
  const Eigen::Matrix3d Q = c.Q();
  return Q.transpose() * c.M * Q - c.r * c.r * c.m * c.m.transpose();
}

// d ConicToVector(points.Normalized(image)) / d (p, m, r).
Eigen::Matrix<double, 6, 7> ImageJacobian(const CircleInCamera& c, const ImagePoints& points) {
  const Eigen::Matrix3d MQ = c.M * c.Q();
  const auto by = [&points](const Eigen::Matrix3d& half) {
    return ConicToVector(points.Normalized(half + half.transpose()));
  };
  Eigen::Matrix<double, 6, 7> J;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d row = MQ.row(i), e = Eigen::Vector3d::Unit(i);
    J.col(i) = by(c.m[i] * MQ - c.m * row.transpose());
    J.col(3 + i) = by(c.p[i] * MQ - e * (c.p.transpose() * MQ) - c.r * c.r * e * c.m.transpose());
  }
  J.col(6) = by(-c.r * c.m * c.m.transpose());
  return J;
}

// Writes the derivatives by a pose and by a circle of its world: a centre C and a normal N.
// `U`: those of the residuals by the conic.
template <typename Rows>
class CircleChain {
  template <int n>
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, n, 0, CurveModel::kMaxSize, n>;

 public:
  CircleChain(const Rows& U, const Eigen::Matrix3d& R, const CircleInCamera& circle,
              const ImagePoints& points)
      : U_(U),
        R_(R),
        circle_(circle),
        points_(points),
        by_circle_(U * ImageJacobian(circle, points)) {}

  auto ByPoint() const { return by_circle_.template leftCols<3>(); }
  auto ByNormal() const { return by_circle_.template middleCols<3>(3); }
  auto ByRadius() const { return by_circle_.col(6); }
  // By a shape R^T M R of the world that changes so.
  Columns<1> ByShape(const Eigen::Matrix3d& rate) const {
    const Eigen::Matrix3d RtQ = R_.transpose() * circle_.Q();
    return U_ * ConicToVector(points_.Normalized(RtQ.transpose() * rate * RtQ));
  }
  // `M`: the shape in the world; null where the circle is round.
  void WritePose(const Eigen::Vector3d& C, const Eigen::Vector3d& N, const Eigen::Matrix3d* M,
                 const double* quaternion, int num_residuals, double** jacobians) const {
    Columns<3> by_turn = ByPoint() * (-R_ * CrossMatrix(C)) + ByNormal() * (-R_ * CrossMatrix(N));
    for (int i = 0; M != nullptr && i < 3; ++i) {
      const Eigen::Matrix3d half = CrossMatrix(Eigen::Vector3d::Unit(i)) * *M;
      by_turn.col(i) += ByShape(half + half.transpose());
    }
    WriteJacobian(by_turn * DeltaFromQuaternion(quaternion), num_residuals, 0, jacobians);
    WriteJacobian(ByPoint(), num_residuals, 1, jacobians);
  }

 private:
  const Rows& U_;
  const Eigen::Matrix3d& R_;
  const CircleInCamera& circle_;
  const ImagePoints& points_;
  Columns<7> by_circle_;
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
  by.WritePose(Eigen::Vector3d(parameters[2]), Eigen::Vector3d(parameters[3]), nullptr,
               parameters[0], num_residuals(), jacobians);
  WriteJacobian(by.ByPoint() * R, num_residuals(), 2, jacobians);
  WriteJacobian(by.ByNormal() * R, num_residuals(), 3, jacobians);
  WriteJacobian(by.ByRadius(), num_residuals(), 4, jacobians);
  return true;
}

namespace {

PlaneCircle InWorld(const double* const* parameters, bool tilted) {
  return {parameters[2], parameters[3][0], tilted ? parameters[4] : nullptr};
}

// Of M in the world, by each component of the shape.
Eigen::Matrix3d ShapeRate(int component) {
  Eigen::Matrix3d rate = Eigen::Matrix3d::Zero();
  if (component == 0) rate.diagonal() << -2.0, 2.0, 0.0;
  if (component == 1) rate(0, 1) = rate(1, 0) = -2.0;
  return rate;
}

Eigen::Matrix3d ShapeInWorld(const double* shape) {
  return Eigen::Matrix3d::Identity() + shape[0] * ShapeRate(0) + shape[1] * ShapeRate(1);
}

// Without its shape.
CircleInCamera InCamera(const PlaneCircle& circle, const Eigen::Matrix3d& R,
                        const double* translation) {
  return {R * circle.center + Eigen::Vector3d(translation), R * circle.normal, circle.radius};
}

std::vector<int> BlockSizes(const PlaneCircleContourCost::Blocks& blocks) {
  std::vector<int> sizes = {4, 3, 2, 1};
  if (blocks.tilt_and_height) sizes.push_back(3);
  if (blocks.shape) sizes.push_back(2);
  return sizes;
}

}  // namespace

PlaneCircleContourCost::PlaneCircleContourCost(ImagePoints points, Blocks blocks)
    : CurveCost(std::move(points), 5, BlockSizes(blocks), blocks.offset, blocks.camera,
                NumPriors(blocks)),
      blocks_(blocks) {}

void PlaneCircleContourCost::Distances(const double* const* parameters,
                                       std::vector<double>* distances) const {
  const Eigen::Matrix3d R = RotationFromBlock(parameters[0]);
  CircleInCamera circle = InCamera(InWorld(parameters, blocks_.tilt_and_height), R, parameters[1]);
  if (blocks_.shape) circle.M = R * ShapeInWorld(parameters[ShapeBlock()]) * R.transpose();
  points()->ConicDistances(ImageOfCircle(circle), Offset(parameters), CameraShifts(parameters),
                           distances);
}

bool PlaneCircleContourCost::EvaluateWith(const Weighing& weighing, const double* const* parameters,
                                          double* residuals, double** jacobians) const {
  const bool tilted = blocks_.tilt_and_height;
  const Eigen::Matrix3d R = RotationFromBlock(parameters[0]);
  const PlaneCircle in_world = InWorld(parameters, tilted);
  CircleInCamera circle = InCamera(in_world, R, parameters[1]);
  Eigen::Matrix3d M;
  if (blocks_.shape) {
    M = ShapeInWorld(parameters[ShapeBlock()]);
    circle.M = R * M * R.transpose();
  }
  Rows U;
  if (!(circle.p.z() > 0.0) || !(circle.r > 0.0) ||
      !SumAbout(ImageOfCircle(circle), weighing, parameters, residuals, jacobians, &U))
    return false;
  const int rows = num_residuals(), prior = num_curve_residuals();
  for (int k = 0; prior + k < rows; ++k)
    residuals[prior + k] = parameters[4][k] / blocks_.tilt_sigmas[static_cast<std::size_t>(k)];
  if (jacobians == nullptr) return true;
  const CircleChain<Rows> by(U, R, circle, *points());
  by.WritePose(in_world.center, in_world.normal, blocks_.shape ? &M : nullptr, parameters[0], rows,
               jacobians);
  WriteJacobian(by.ByPoint() * R.leftCols<2>(), rows, 2, jacobians);
  const double height = tilted ? parameters[4][2] : 0.0;
  WriteJacobian(by.ByRadius() + height * (by.ByPoint() * R.col(2)), rows, 3, jacobians);
  if (tilted && jacobians[4] != nullptr) {
    Eigen::Matrix<double, Eigen::Dynamic, 3, 0, CurveModel::kMaxSize, 3> by_tilt(U.rows(), 3);
    by_tilt.leftCols<2>() = by.ByNormal() * R.leftCols<2>();
    by_tilt.col(2) = circle.r * (by.ByPoint() * R.col(2));
    WriteJacobian(by_tilt, rows, 4, jacobians);
    for (int k = 0; prior + k < rows; ++k)
      jacobians[4][(prior + k) * 3 + k] = 1.0 / blocks_.tilt_sigmas[static_cast<std::size_t>(k)];
  }
  if (blocks_.shape && jacobians[ShapeBlock()] != nullptr) {
    Eigen::Matrix<double, Eigen::Dynamic, 2, 0, CurveModel::kMaxSize, 2> by_shape(U.rows(), 2);
    for (int k = 0; k < 2; ++k) by_shape.col(k) = by.ByShape(ShapeRate(k));
    WriteJacobian(by_shape, rows, ShapeBlock(), jacobians);
  }
  return true;
}

}  // namespace circline
