// Cost functions at places that are no minimum: their gradients against differences, the camera and
// the pixels of the tests.
#ifndef CIRCLINE_TESTS_REFINE_COST_FUNCTION_CHECKS_H_
#define CIRCLINE_TESTS_REFINE_COST_FUNCTION_CHECKS_H_

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "circline/estimators/pose.h"
#include "circline/estimators/random.h"
#include "circline/refine/cost_functions.h"
#include "tests/basics.h"

namespace circline::cost_function_checks {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

inline Camera LensCamera() {
  Camera camera;
  camera.id = "cam0";
  camera.model = CameraModel::kOpenCV;
  camera.width = 1280;
  camera.height = 960;
  camera.fx = 1010.0;
  camera.fy = 1000.0;
  camera.cx = 640.0;
  camera.cy = 480.0;
  camera.distortion = {-0.2, 0.05, 1e-3, -5e-4, 0.0};
  return camera;
}

inline const Eigen::Matrix3d kRotation =
    ExpRotation({0.6, 0.1, 0.2}) * Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
inline const Eigen::Vector3d kTranslation(0.3, -0.2, 8.0);
inline const Eigen::Vector3d kOff(0.003, -0.002, 0.004);  // A turn.

// Parameter blocks with their manifolds.
struct Blocks {
  std::vector<std::vector<double>> values;
  std::vector<std::shared_ptr<ceres::Manifold>> manifolds;

  void Add(std::vector<double> value, std::shared_ptr<ceres::Manifold> manifold = nullptr) {
    values.push_back(std::move(value));
    manifolds.push_back(std::move(manifold));
  }
  // A little off the pose that the pixels are made with.
  void AddRotation(const Eigen::Vector3d& off = kOff) {
    const Eigen::Quaterniond q(Eigen::Matrix3d(ExpRotation(off) * kRotation));
    Add({q.x(), q.y(), q.z(), q.w()}, std::make_shared<ceres::EigenQuaternionManifold>());
  }
  void AddPose(const Eigen::Vector3d& off = kOff) {
    AddRotation(off);
    Add({kTranslation.x(), kTranslation.y() + 0.01, kTranslation.z()});
  }
  std::vector<const double*> Pointers() const {
    std::vector<const double*> pointers;
    for (const auto& v : values) pointers.push_back(v.data());
    return pointers;
  }
};

inline double CostOf(const ceres::CostFunction& cost, const Blocks& blocks) {
  Eigen::VectorXd r(cost.num_residuals());
  EXPECT_TRUE(cost.Evaluate(blocks.Pointers().data(), r.data(), nullptr));
  return 0.5 * r.squaredNorm();
}

// Residuals, and Jacobian by the tangent spaces of all blocks.
inline void Linearize(const ceres::CostFunction& cost, const Blocks& blocks, Eigen::VectorXd* r,
                      Eigen::MatrixXd* J) {
  r->resize(cost.num_residuals());
  std::vector<RowMajor> ambient;
  std::vector<double*> pointers;
  for (const auto& v : blocks.values)
    ambient.emplace_back(cost.num_residuals(), static_cast<Eigen::Index>(v.size()));
  for (RowMajor& a : ambient) pointers.push_back(a.data());
  ASSERT_TRUE(cost.Evaluate(blocks.Pointers().data(), r->data(), pointers.data()));
  J->resize(cost.num_residuals(), 0);
  for (std::size_t k = 0; k < ambient.size(); ++k) {
    Eigen::MatrixXd tangent = ambient[k];
    if (blocks.manifolds[k]) {
      RowMajor P(blocks.manifolds[k]->AmbientSize(), blocks.manifolds[k]->TangentSize());
      blocks.manifolds[k]->PlusJacobian(blocks.values[k].data(), P.data());
      tangent = ambient[k] * P;
    }
    const Eigen::Index before = J->cols();
    J->conservativeResize(Eigen::NoChange, before + tangent.cols());
    J->rightCols(tangent.cols()) = tangent;
  }
}

// A step of `size` in one tangent coordinate, counted over all blocks.
inline Blocks Moved(const Blocks& blocks, Eigen::Index coordinate, double size) {
  Blocks moved = blocks;
  for (std::size_t k = 0; k < blocks.values.size(); ++k) {
    const auto& manifold = blocks.manifolds[k];
    const auto n = manifold ? manifold->TangentSize() : static_cast<int>(blocks.values[k].size());
    if (coordinate >= n) {
      coordinate -= n;
      continue;
    }
    if (manifold) {
      Eigen::VectorXd delta = Eigen::VectorXd::Zero(n);
      delta[coordinate] = size;
      manifold->Plus(blocks.values[k].data(), delta.data(), moved.values[k].data());
    } else {
      moved.values[k][static_cast<std::size_t>(coordinate)] += size;
    }
    break;
  }
  return moved;
}

// The first `exact` coordinates; further ones, of a camera, leave out how a contour's offset, and a
// distance to first order, follow the bends of a lens.
inline void ExpectGradientByDifferences(const ceres::CostFunction& cost, const Blocks& blocks,
                                        Eigen::Index exact = 1000,
                                        Eigen::Index coordinates = 1000) {
  Eigen::VectorXd r;
  Eigen::MatrixXd J;
  Linearize(cost, blocks, &r, &J);
  EXPECT_NEAR(0.5 * r.squaredNorm(), CostOf(cost, blocks), 1e-9 * (1.0 + r.squaredNorm()));
  const Eigen::VectorXd gradient = J.transpose() * r;
  for (Eigen::Index k = 0; k < std::min(coordinates, gradient.size()); ++k) {
    // Of five points: the priors bend within a ten-thousandth.
    constexpr double kStep = 1e-6;
    const auto difference = [&](double step) {
      return CostOf(cost, Moved(blocks, k, step)) - CostOf(cost, Moved(blocks, k, -step));
    };
    const double slope = (8.0 * difference(kStep) - difference(2.0 * kStep)) / (12.0 * kStep);
    const double tolerance = k < exact ? 2e-5 : 1e-3;
    EXPECT_NEAR(
        gradient[k], slope,
        tolerance * std::abs(slope) + (k < exact ? 1e-6 : 1e-4) * gradient.cwiseAbs().maxCoeff())
        << "coordinate " << k;
  }
}

// Contour of a circle of the plane, or of one anywhere, with noise and a few outliers.
inline std::vector<Eigen::Vector2d> Contour(const Eigen::Vector3d& center,
                                            const Eigen::Vector3d& normal, double radius,
                                            double arc, int outliers) {
  Random random(3);
  const Eigen::Vector3d u = normal.normalized().unitOrthogonal(), v = normal.normalized().cross(u);
  std::vector<Eigen::Vector2d> pixels;
  for (int i = 0; i < 40; ++i) {
    const double a = arc * i / 40.0;
    Eigen::Vector2d pixel;
    CameraToPixel(
        LensCamera(),
        kRotation * (center + radius * (std::cos(a) * u + std::sin(a) * v)) + kTranslation, &pixel);
    pixels.push_back(pixel + Noise2(i < outliers ? 6.0 : 0.4, &random));
  }
  return pixels;
}

inline std::vector<Eigen::Vector2d> Line(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                         int n, std::uint64_t seed) {
  Random random(seed);
  std::vector<Eigen::Vector2d> pixels;
  for (int i = 0; i < n; ++i) {
    Eigen::Vector2d pixel;
    CameraToPixel(LensCamera(), kRotation * (from + (to - from) * i / (n - 1.0)) + kTranslation,
                  &pixel);
    pixels.push_back(pixel + Noise2(0.4, &random));
  }
  return pixels;
}

inline ImagePoints Points(const std::vector<Eigen::Vector2d>& pixels, LossType loss,
                          ConicDistanceType distance = ConicDistanceType::kSampson) {
  ImagePoints::Options options;
  options.sigma_px = 0.4;
  options.weight = 0.7;
  options.loss = loss;
  options.distance = distance;
  options.num_distortion = 5;
  return ImagePoints(LensCamera(), pixels, {}, options);
}

inline std::vector<double> CameraShifts() {
  return {0.02, 0.003, 1.5, -0.7, 0.01, -0.004, 2e-4, 1e-4, 0.002, 0.0, 0.0, 0.0};
}

inline constexpr LossType kLosses[] = {
    LossType::kTrivial, LossType::kHuber, LossType::kSoftLOne,    LossType::kCauchy,
    LossType::kArctan,  LossType::kTukey, LossType::kGemanMcClure};

}  // namespace circline::cost_function_checks

#endif  // CIRCLINE_TESTS_REFINE_COST_FUNCTION_CHECKS_H_
