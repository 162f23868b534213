// A change of a pose in the tangents of other libraries, against their own definitions: with the
// exponential of 4x4 matrices, and with the retraction of gtsam::Pose3 that does without it.
#include "circline/estimators/pose_tangent.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <vector>

#include "circline/estimators/random.h"
#include "tests/basics.h"
#include "tests/trials.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector3d;

const std::vector<PoseTangent>& AllTangents() {
  static const auto* const all = new std::vector<PoseTangent>{
      {false, false, false}, {false, false, true}, {false, true, false}, {false, true, true},
      {true, false, false},  {true, false, true},  {true, true, false},  {true, true, true}};
  return *all;
}

CameraPose DrawPose(Random* random) {
  return {ExpRotation(Noise3(1.5, random)), Noise3(3.0, random)};
}

Matrix4d Homogeneous(const CameraPose& pose) {
  Matrix4d T = Matrix4d::Identity();
  T.topLeftCorner<3, 3>() = pose.rotation;
  T.topRightCorner<3, 1>() = pose.translation;
  return T;
}

// The pose that a change [delta, delta_t] makes, by its definition.
CameraPose Changed(const CameraPose& pose, const Vector6d& change) {
  return {ExpRotation(change.head<3>()) * pose.rotation, pose.translation + change.tail<3>()};
}

Vector3d Omega(const Vector6d& xi, bool rotation_first) {
  return rotation_first ? xi.head<3>() : xi.tail<3>();
}
Vector3d V(const Vector6d& xi, bool rotation_first) {
  return rotation_first ? xi.tail<3>() : xi.head<3>();
}

// exp of the twist's 4x4 matrix by its series.
Matrix4d Exp(const Vector6d& xi, bool rotation_first) {
  Matrix4d hat = Matrix4d::Zero();
  hat.topLeftCorner<3, 3>() = CrossMatrix(Omega(xi, rotation_first));
  hat.topRightCorner<3, 1>() = V(xi, rotation_first);
  Matrix4d sum = Matrix4d::Identity(), term = Matrix4d::Identity();
  for (int k = 1; k < 20; ++k) sum += term = term * hat / k;
  return sum;
}

// What the other library keeps.
Matrix4d Kept(const CameraPose& pose, const PoseTangent& tangent) {
  const Matrix4d T = Homogeneous(pose);
  return tangent.world_from_cam ? Matrix4d(T.inverse()) : T;
}

Matrix4d Retracted(const CameraPose& pose, const Vector6d& xi, const PoseTangent& tangent) {
  const Matrix4d step = Exp(xi, tangent.rotation_first), kept = Kept(pose, tangent);
  return tangent.right ? kept * step : step * kept;
}

// The twist from the estimate to another pose, to second order in it.
Vector6d Local(const CameraPose& from, const CameraPose& to, const PoseTangent& tangent) {
  const Matrix4d a = Kept(from, tangent), b = Kept(to, tangent);
  const Matrix4d step = tangent.right ? Matrix4d(a.inverse() * b) : Matrix4d(b * a.inverse());
  const Vector3d omega = LogRotation(step.topLeftCorner<3, 3>());
  // The inverse of exp's V = I + [omega]x / 2 + ...
  const Vector3d p = step.topRightCorner<3, 1>(), v = p - 0.5 * omega.cross(p);
  Vector6d xi;
  if (tangent.rotation_first) {
    xi << omega, v;
  } else {
    xi << v, omega;
  }
  return xi;
}

TEST(PoseTangentTest, MovesThePoseAsTheLibraryDoes) {
  Random random(1);
  constexpr double kStep = 1e-5;  // The rest is of its square.
  for (int trial = 0; trial < 100; ++trial) {
    const CameraPose pose = DrawPose(&random);
    Vector6d change;
    change << Noise3(kStep, &random), Noise3(kStep, &random);
    for (const PoseTangent& tangent : AllTangents()) {
      const Vector6d xi = TangentJacobian(pose, tangent) * change;
      const double off =
          (Retracted(pose, xi, tangent) - Kept(Changed(pose, change), tangent)).norm();
      EXPECT_LT(off, 50.0 * kStep * kStep);
    }
  }
}

// Without GTSAM_POSE3_EXPMAP: (R, t) -> (R exp(omega), t + R v), rotation first.
TEST(PoseTangentTest, AgreesWithTheOtherRetractionOfGtsam) {
  Random random(2);
  constexpr double kStep = 1e-5;
  for (int trial = 0; trial < 100; ++trial) {
    const CameraPose pose = DrawPose(&random);
    Vector6d change;
    change << Noise3(kStep, &random), Noise3(kStep, &random);
    const Vector6d xi = TangentJacobian(pose, kGtsamPose3) * change;
    const Matrix4d kept = Kept(pose, kGtsamPose3);
    const Matrix3d R = kept.topLeftCorner<3, 3>();
    const CameraPose moved = {R * ExpRotation(xi.head<3>()),
                              kept.topRightCorner<3, 1>() + R * xi.tail<3>()};
    EXPECT_LT((Homogeneous(moved) - Kept(Changed(pose, change), kGtsamPose3)).norm(),
              100.0 * kStep * kStep);  // Second order; poses are some units away.
  }
}

// The named ones, in numbers worked out by hand: t = (0, 0, 2), R turns by 90 degrees about z, so
// that R^T x = -y. Turning the camera about its x while t stays needs v = t x delta = (0, 2, 0).
TEST(PoseTangentTest, NamesTheRightConventions) {
  const CameraPose pose = {ExpRotation({0.0, 0.0, 1.5707963267948966}), {0.0, 0.0, 2.0}};
  Vector6d turn = Vector6d::Zero(), shift = Vector6d::Zero(), expected;
  turn[0] = shift[3] = 1.0;
  expected << -1.0, 0.0, 0.0, 0.0, -2.0, 0.0;
  EXPECT_LT((TangentJacobian(pose, kGtsamPose3) * turn - expected).norm(), 1e-12);
  expected << 0.0, 2.0, 0.0, 1.0, 0.0, 0.0;
  EXPECT_LT((TangentJacobian(pose, kSophusLeft) * turn - expected).norm(), 1e-12);
  expected << 0.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  EXPECT_LT((TangentJacobian(pose, kSophusRight) * turn - expected).norm(), 1e-12);
  expected << 0.0, 0.0, 0.0, -1.0, 0.0, 0.0;
  EXPECT_LT((TangentJacobian(pose, kGtsamPose3) * shift - expected).norm(), 1e-12);
  expected << 1.0, 0.0, 0.0, 0.0, 0.0, 0.0;
  EXPECT_LT((TangentJacobian(pose, kSophusLeft) * shift - expected).norm(), 1e-12);
  expected << 0.0, -1.0, 0.0, 0.0, 0.0, 0.0;
  EXPECT_LT((TangentJacobian(pose, kSophusRight) * shift - expected).norm(), 1e-12);
}

// Poses drawn by the covariance scatter in the other library's tangent as J C J^T says.
TEST(PoseTangentTest, CarriesCovariancesOver) {
  Random random(3);
  const CameraPose pose = DrawPose(&random);
  Matrix6d root;  // Of a covariance with all correlations, 1 degree and 3 cm or so.
  for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = 0.01 * random.Normal();
  const Matrix6d covariance = root * root.transpose();
  const int num_trials = Trials(20000);
  for (const PoseTangent& tangent : {kGtsamPose3, kSophusLeft, kSophusRight}) {
    Matrix6d scatter = Matrix6d::Zero();
    for (int trial = 0; trial < num_trials; ++trial) {
      Vector6d unit;
      for (int k = 0; k < 6; ++k) unit[k] = random.Normal();
      const Vector6d xi = Local(pose, Changed(pose, root * unit), tangent);
      scatter += xi * xi.transpose() / num_trials;
    }
    if (kSanitized) continue;
    const Matrix6d J = TangentJacobian(pose, tangent);
    const Eigen::LLT<Matrix6d> expected(J * covariance * J.transpose());
    const Matrix6d relative =
        expected.matrixL().solve(expected.matrixL().solve(scatter).transpose());
    // Each entry is good to sqrt(2 / trials) = 0.01, and linear to about that.
    EXPECT_LT((relative - Matrix6d::Identity()).cwiseAbs().maxCoeff(), 0.06);
  }
}

}  // namespace
}  // namespace circline
