// Each cost function, at places that are no minimum: its cost is the same with and without
// derivatives, and the gradient is that of the cost by differences; without a loss its Gauss-Newton
// Hessian is the sum over the points' own residuals, differentiated one by one.
#include "circline/refine/cost_functions.h"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/line.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/random.h"

namespace circline {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Camera LensCamera() {
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

const Eigen::Matrix3d kRotation =
    ExpRotation({0.6, 0.1, 0.2}) * Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
const Eigen::Vector3d kTranslation(0.3, -0.2, 8.0);

// Parameter blocks with their manifolds.
struct Blocks {
  std::vector<std::vector<double>> values;
  std::vector<std::shared_ptr<ceres::Manifold>> manifolds;

  void Add(std::vector<double> value, std::shared_ptr<ceres::Manifold> manifold = nullptr) {
    values.push_back(std::move(value));
    manifolds.push_back(std::move(manifold));
  }
  // A little off the pose that the pixels are made with.
  void AddPose(const Eigen::Vector3d& off = {0.003, -0.002, 0.004}) {
    const Eigen::Quaterniond q(Eigen::Matrix3d(ExpRotation(off) * kRotation));
    Add({q.x(), q.y(), q.z(), q.w()}, std::make_shared<ceres::EigenQuaternionManifold>());
    Add({kTranslation.x(), kTranslation.y() + 0.01, kTranslation.z()});
  }
  std::vector<const double*> Pointers() const {
    std::vector<const double*> pointers;
    for (const auto& v : values) pointers.push_back(v.data());
    return pointers;
  }
};

double CostOf(const ceres::CostFunction& cost, const Blocks& blocks) {
  Eigen::VectorXd r(cost.num_residuals());
  EXPECT_TRUE(cost.Evaluate(blocks.Pointers().data(), r.data(), nullptr));
  return 0.5 * r.squaredNorm();
}

// Residuals, and Jacobian by the tangent spaces of all blocks.
void Linearize(const ceres::CostFunction& cost, const Blocks& blocks, Eigen::VectorXd* r,
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
Blocks Moved(const Blocks& blocks, Eigen::Index coordinate, double size) {
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

// The first `exact` coordinates; further ones, of a camera, leave out that the lens is bent between
// a point and its curve: a thousandth, and here, tens of standard deviations off, at most a
// hundredth.
void ExpectGradientByDifferences(const ceres::CostFunction& cost, const Blocks& blocks,
                                 Eigen::Index exact = 1000, Eigen::Index coordinates = 1000) {
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
    const double tolerance = k < exact ? 2e-5 : 1e-2;
    EXPECT_NEAR(
        gradient[k], slope,
        tolerance * std::abs(slope) + (k < exact ? 1e-6 : 1e-3) * gradient.cwiseAbs().maxCoeff())
        << "coordinate " << k;
  }
}

// Contour of a circle of the plane, or of one anywhere, with noise and a few outliers.
std::vector<Eigen::Vector2d> Contour(const Eigen::Vector3d& center, const Eigen::Vector3d& normal,
                                     double radius, double arc, int outliers) {
  Random random(3);
  const Eigen::Vector3d u = normal.normalized().unitOrthogonal(), v = normal.normalized().cross(u);
  std::vector<Eigen::Vector2d> pixels;
  for (int i = 0; i < 40; ++i) {
    const double a = arc * i / 40.0;
    Eigen::Vector2d pixel;
    CameraToPixel(
        LensCamera(),
        kRotation * (center + radius * (std::cos(a) * u + std::sin(a) * v)) + kTranslation, &pixel);
    const double dx = random.Normal(), dy = random.Normal();
    pixels.push_back(pixel + (i < outliers ? 6.0 : 0.4) * Eigen::Vector2d(dx, dy));
  }
  return pixels;
}

std::vector<Eigen::Vector2d> Line(const Eigen::Vector3d& from, const Eigen::Vector3d& to, int n,
                                  std::uint64_t seed) {
  Random random(seed);
  std::vector<Eigen::Vector2d> pixels;
  for (int i = 0; i < n; ++i) {
    Eigen::Vector2d pixel;
    CameraToPixel(LensCamera(), kRotation * (from + (to - from) * i / (n - 1.0)) + kTranslation,
                  &pixel);
    const double dx = random.Normal(), dy = random.Normal();
    pixels.push_back(pixel + 0.4 * Eigen::Vector2d(dx, dy));
  }
  return pixels;
}

ImagePoints Points(const std::vector<Eigen::Vector2d>& pixels, LossType loss,
                   ConicDistanceType distance = ConicDistanceType::kSampson) {
  ImagePoints::Options options;
  options.sigma_px = 0.4;
  options.weight = 0.7;
  options.loss = loss;
  options.distance = distance;
  options.num_distortion = 5;
  return ImagePoints(LensCamera(), pixels, {}, options);
}

std::vector<double> CameraShifts() {
  return {0.02, 0.003, 1.5, -0.7, 0.01, -0.004, 2e-4, 1e-4, 0.002, 0.0, 0.0, 0.0};
}

constexpr LossType kLosses[] = {LossType::kTrivial,     LossType::kHuber,  LossType::kSoftLOne,
                                LossType::kCauchy,      LossType::kArctan, LossType::kTukey,
                                LossType::kGemanMcClure};

TEST(CostFunctionsTest, ContourOfAPlaneCircle) {
  const Eigen::Vector3d center(0.4, -0.3, 0.0);
  for (const LossType loss : kLosses) {
    for (const auto distance : {ConicDistanceType::kSampson, ConicDistanceType::kOrthogonal}) {
      for (const double arc : {2.0 * kPi, 0.8}) {
        const auto pixels = Contour(center, Eigen::Vector3d::UnitZ(), 1.2, arc, 3);
        PlaneCircleContourCost::Blocks with;
        with.tilt_and_height = with.shape = with.offset = with.camera = true;
        with.tilt_sigma = 0.01;
        with.height_sigma = 0.02;
        const PlaneCircleContourCost cost(Points(pixels, loss, distance), with);
        Blocks blocks;
        blocks.AddPose();
        blocks.Add({0.402, -0.297});
        blocks.Add({1.203});
        blocks.Add({0.004, -0.003, 0.01});
        blocks.Add({0.002, -0.001});
        blocks.Add({0.03});  // How it follows the normals is in no derivative: it has to be small.
        blocks.Add(CameraShifts());
        SCOPED_TRACE(LossName(loss));
        ExpectGradientByDifferences(cost, blocks, 3 + 3 + 2 + 1 + 3 + 2 + 1,
                                    3 + 3 + 2 + 1 + 3 + 2 + 1 + 9);
        const PlaneCircleContourCost plain(Points(pixels, loss, distance), {});
        blocks.values.resize(4);
        blocks.manifolds.resize(4);
        ExpectGradientByDifferences(plain, blocks);
      }
    }
  }
}

TEST(CostFunctionsTest, ContourOfACircleAnywhere) {
  const Eigen::Vector3d center(0.4, -0.3, 0.5),
      normal = Eigen::Vector3d(0.3, 0.1, 1.0).normalized();
  const auto pixels = Contour(center, normal, 1.2, 2.0 * kPi, 3);
  CircleContourCost::Blocks with;
  with.offset = with.camera = true;
  const CircleContourCost cost(Points(pixels, LossType::kCauchy), with);
  Blocks blocks;
  blocks.AddPose();
  blocks.Add({center.x(), center.y() + 0.004, center.z()});
  blocks.Add({normal.x(), normal.y(), normal.z()}, std::make_shared<ceres::SphereManifold<3>>());
  blocks.Add({1.205});
  blocks.Add({-0.1});
  blocks.Add(CameraShifts());
  ExpectGradientByDifferences(cost, blocks, 3 + 3 + 3 + 2 + 1 + 1, 3 + 3 + 3 + 2 + 1 + 1 + 9);
}

TEST(CostFunctionsTest, ALineOfADirection) {
  for (const LossType loss : kLosses) {
    for (const double sigma : {0.0, 0.002}) {
      for (const int points : {2, 30}) {
        for (const double y : {-1.0, 0.2}) {
          const auto pixels = Line({-1.5, y, 0.1}, {1.5, y + 0.01, 0.1}, points, 7);
          ImagePoints prepared = Points(pixels, loss);
          LineFit fit;
          ASSERT_TRUE(FitLine(prepared.points(), 0.4, &fit).ok());
          DirectionLineCost::Options options;
          options.direction_sigma = sigma;
          options.camera = true;
          const DirectionLineCost cost(std::move(prepared), fit.line, options);
          Blocks blocks;
          blocks.AddPose({0.001, 0.0005, -0.001});
          blocks.values.pop_back();  // No translation.
          blocks.manifolds.pop_back();
          const Eigen::Vector3d d = Eigen::Vector3d(1.0, -0.003, -0.001).normalized();
          blocks.Add({d.x(), d.y(), d.z()}, std::make_shared<ceres::SphereManifold<3>>());
          blocks.Add({0.002, -0.001});
          if (sigma == 0.0) blocks.values.back().pop_back();
          const auto own = static_cast<Eigen::Index>(blocks.values.back().size());
          blocks.Add(CameraShifts());
          SCOPED_TRACE(LossName(loss) + std::string(sigma > 0.0 ? " soft " : " hard ") +
                       std::to_string(points));
          ExpectGradientByDifferences(cost, blocks, 3 + 2 + own, 3 + 2 + own + 9);
        }
      }
    }
  }
}

// Where it starts no other place across the direction costs less.
TEST(CostFunctionsTest, ALineStartsWhereItsPointsAskFor) {
  ImagePoints prepared =
      Points(Line({-1.5, 0.4, 0.1}, {1.5, 0.43, 0.1}, 30, 7), LossType::kTrivial);
  LineFit fit;
  ASSERT_TRUE(FitLine(prepared.points(), 0.4, &fit).ok());
  DirectionLineCost::Options options;
  options.camera = true;
  const DirectionLineCost cost(std::move(prepared), fit.line, options);
  Blocks blocks;
  blocks.AddPose();
  blocks.values.pop_back();
  blocks.manifolds.pop_back();
  blocks.Add({1.0, 0.0, 0.0}, std::make_shared<ceres::SphereManifold<3>>());
  blocks.Add({0.0});
  blocks.Add(CameraShifts());
  ASSERT_TRUE(cost.Start(blocks.Pointers().data(), blocks.values[2].data()));
  const double least = CostOf(cost, blocks);
  EXPECT_LT(least, CostOf(cost, Moved(blocks, 5, 1e-4)));
  EXPECT_LT(least, CostOf(cost, Moved(blocks, 5, -1e-4)));
}

TEST(CostFunctionsTest, ALineOfThePlane) {
  for (const LossType loss : kLosses) {
    const PlaneLineCost cost(Points(Line({-1.5, 0.4, 0.0}, {1.5, 0.7, 0.0}, 20, 5), loss), true);
    Blocks blocks;
    blocks.AddPose();
    blocks.Add({0.1, 0.56});
    blocks.Add({0.098});
    blocks.Add(CameraShifts());
    SCOPED_TRACE(LossName(loss));
    ExpectGradientByDifferences(cost, blocks, 3 + 3 + 2 + 1, 3 + 3 + 2 + 1 + 9);
  }
}

// Every corner of the box, all three axes, leaning and not.
TEST(CostFunctionsTest, AnEdgeOfABox) {
  const Eigen::Vector3d size(1.2, 0.7, 0.9), skew(0.01, -0.02, 0.015);
  Eigen::Matrix3d strained;
  strained << 1.0, 0.5 * skew.z(), 0.5 * skew.y(), 0.5 * skew.z(), 1.0, 0.5 * skew.x(),
      0.5 * skew.y(), 0.5 * skew.x(), 1.0;
  for (int edge = 0; edge < 12; ++edge) {
    const int axis = edge % 3;
    const std::array<bool, 3> far = {edge / 3 % 2 == 1, (edge / 3 + axis) / 2 % 2 == 1,
                                     (edge / 3 + axis) % 2 == 1};
    Eigen::Vector3d corner;
    for (int k = 0; k < 3; ++k) corner[k] = far[static_cast<std::size_t>(k)] ? size[k] : 0.0;
    std::vector<Eigen::Vector2d> pixels;
    for (int i = 0; i < 20; ++i) {
      Eigen::Vector3d X = corner;
      X[axis] = 0.05 * i;
      Eigen::Vector2d pixel;
      ASSERT_TRUE(CameraToPixel(LensCamera(), kRotation * (strained * X) + kTranslation, &pixel));
      pixels.push_back(pixel);
    }
    Blocks truth;
    truth.AddPose(Eigen::Vector3d::Zero());
    truth.values[1][1] = kTranslation.y();
    for (int k = 0; k < 3; ++k) truth.Add({size[k]});
    truth.Add({skew.x(), skew.y(), skew.z()});
    const BoxEdgeCost exact(ImagePoints(LensCamera(), pixels, {}, {}), axis, far);
    EXPECT_LT(CostOf(exact, truth), 1e-12) << "edge " << edge;

    Blocks off;
    off.AddPose();
    for (int k = 0; k < 3; ++k) off.Add({1.01 * size[k]});
    off.Add({0.0, 0.0, 0.0});
    off.Add(std::vector<double>(kCameraSize, 0.001));
    ImagePoints::Options options;
    options.loss = LossType::kCauchy;
    const BoxEdgeCost cost(ImagePoints(LensCamera(), pixels, {}, options), axis, far, true);
    ExpectGradientByDifferences(cost, off, 12, 17);
  }
}

TEST(CostFunctionsTest, APointOfThePlane) {
  for (const LossType loss : kLosses) {
    const PlanePointCost cost(LensCamera(), {700.0, 450.0}, 0.5, loss, true);
    Eigen::Vector2d pixel;
    Blocks blocks;
    blocks.AddPose();
    CameraToPixel(LensCamera(), kRotation * Eigen::Vector3d(0.2, 0.3, 0.0) + kTranslation, &pixel);
    blocks.Add({0.22, 0.31});
    blocks.Add(CameraShifts());
    SCOPED_TRACE(LossName(loss));
    const PlanePointCost near(LensCamera(), pixel, 0.5, loss, true);
    ExpectGradientByDifferences(cost, blocks, 3 + 3 + 2, 3 + 3 + 2 + 5);
    ExpectGradientByDifferences(near, blocks, 3 + 3 + 2, 3 + 3 + 2 + 5);
  }
}

TEST(CostFunctionsTest, WhatIsKnownBeside) {
  const Eigen::Vector3d a = Eigen::Vector3d(1.0, 0.1, 0.05).normalized(),
                        b = Eigen::Vector3d(-0.1, 1.0, 0.02).normalized();
  const auto sphere = std::make_shared<ceres::SphereManifold<3>>();
  Blocks directions;
  directions.Add({a.x(), a.y(), a.z()}, sphere);
  directions.Add({b.x(), b.y(), b.z()}, sphere);
  for (const double angle : {0.5 * kPi, 1.3, -1.8, 4.5}) {
    ExpectGradientByDifferences(*std::unique_ptr<ceres::CostFunction>(NewAngleCost(angle, 0.01)),
                                directions);
  }
  Blocks points;
  points.Add({0.1, 0.2});
  points.Add({1.3, -0.4});
  ExpectGradientByDifferences(*std::unique_ptr<ceres::CostFunction>(NewLengthCost(1.2, 0.01)),
                              points);
  Blocks direction;
  direction.Add({a.x(), a.y(), a.z()}, sphere);
  ExpectGradientByDifferences(
      *std::unique_ptr<ceres::CostFunction>(NewDirectionPrior(Eigen::Vector3d::UnitX(), 0.01)),
      direction);
  ExpectGradientByDifferences(
      *std::unique_ptr<ceres::CostFunction>(NewInPlanePrior(Eigen::Vector3d::UnitZ(), 0.01)),
      direction);
  Blocks radius;
  radius.Add({0.31});
  ExpectGradientByDifferences(*std::unique_ptr<ceres::CostFunction>(NewLogPrior(0.3, 0.001)),
                              radius);
  Blocks pose;
  pose.AddPose();
  Matrix6d covariance = 1e-4 * Matrix6d::Identity();
  covariance(0, 4) = covariance(4, 0) = 4e-5;
  ExpectGradientByDifferences(
      *std::unique_ptr<ceres::CostFunction>(NewPosePrior(kRotation, kTranslation, covariance)),
      pose);
  EXPECT_EQ(NewPosePrior(kRotation, kTranslation, -covariance), nullptr);
  Blocks rotation;
  rotation.AddPose();
  rotation.values.pop_back();
  rotation.manifolds.pop_back();
  ExpectGradientByDifferences(
      *std::unique_ptr<ceres::CostFunction>(NewDirectionMeasurement(
          Eigen::Vector3d::UnitZ(), kRotation * Eigen::Vector3d::UnitZ(), 0.01)),
      rotation);
}

// A pose prior's residual is delta of rotation = exp([delta]x) * mean.
TEST(CostFunctionsTest, APosePriorCountsInTheCameraFrame) {
  Matrix6d covariance = Matrix6d::Identity();
  covariance.diagonal() << 0.01, 0.04, 0.09, 1.0, 4.0, 9.0;
  const std::unique_ptr<ceres::CostFunction> cost(
      NewPosePrior(kRotation, kTranslation, covariance));
  const Eigen::Quaterniond q(Eigen::Matrix3d(ExpRotation({0.05, 0.0, 0.0}) * kRotation));
  const double rotation[4] = {q.x(), q.y(), q.z(), q.w()};
  const double translation[3] = {kTranslation.x(), kTranslation.y() + 1.0, kTranslation.z()};
  const double* parameters[2] = {rotation, translation};
  double r[6];
  ASSERT_TRUE(cost->Evaluate(parameters, r, nullptr));
  EXPECT_NEAR(r[0], 0.5, 1e-9);
  EXPECT_NEAR(r[4], 0.5, 1e-9);
  EXPECT_NEAR(r[1], 0.0, 1e-9);
}

// Without loss, the block's J^T J is the sum over the points' residuals differentiated one by one.
TEST(CostFunctionsTest, GaussNewtonHessianIsThatOfThePoints) {
  const auto pixels = Contour({0.4, -0.3, 0.0}, Eigen::Vector3d::UnitZ(), 1.2, 0.9, 0);
  const PlaneCircleContourCost cost(Points(pixels, LossType::kTrivial), {});
  Blocks blocks;
  blocks.AddPose();
  blocks.Add({0.401, -0.299});
  blocks.Add({1.201});
  Eigen::VectorXd r;
  Eigen::MatrixXd J;
  Linearize(cost, blocks, &r, &J);
  const auto distances = [&](const Blocks& at) {
    std::vector<double> d;
    cost.Distances(at.Pointers().data(), &d);
    return Eigen::VectorXd(
        Eigen::Map<Eigen::VectorXd>(d.data(), static_cast<Eigen::Index>(d.size())) *
        std::sqrt(0.7) / 0.4);
  };
  Eigen::MatrixXd by_points(40, J.cols());
  for (Eigen::Index k = 0; k < J.cols(); ++k) {
    constexpr double kStep = 1e-6;
    by_points.col(k) =
        (distances(Moved(blocks, k, kStep)) - distances(Moved(blocks, k, -kStep))) / (2.0 * kStep);
  }
  const Eigen::MatrixXd expected = by_points.transpose() * by_points, H = J.transpose() * J;
  EXPECT_LT((H - expected).norm(), 1e-5 * expected.norm());
}

// Behind the camera there is no image: ceres is told so, and nothing is NaN.
TEST(CostFunctionsTest, BehindTheCameraIsRefused) {
  const auto pixels = Contour({0.4, -0.3, 0.0}, Eigen::Vector3d::UnitZ(), 1.2, 6.0, 0);
  const PlaneCircleContourCost cost(Points(pixels, LossType::kTrivial), {});
  const PlanePointCost point(LensCamera(), {700.0, 450.0}, 0.5, LossType::kTrivial);
  Blocks blocks;
  blocks.AddPose();
  blocks.values[1][2] = -8.0;
  blocks.Add({0.4, -0.3});
  blocks.Add({1.2});
  double r[20];
  EXPECT_FALSE(cost.Evaluate(blocks.Pointers().data(), r, nullptr));
  EXPECT_FALSE(point.Evaluate(blocks.Pointers().data(), r, nullptr));
}

}  // namespace
}  // namespace circline
