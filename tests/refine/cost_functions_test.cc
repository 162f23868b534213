// Each cost function of a feature, at places that are no minimum: its cost is the same with and
// without derivatives, and the gradient is that of the cost by differences; without a loss its
// Gauss-Newton Hessian is the sum over the points' own residuals, differentiated one by one.
#include "circline/refine/cost_functions.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/line.h"
#include "circline/estimators/pose.h"
#include "tests/basics.h"
#include "tests/refine/cost_function_checks.h"

namespace circline::cost_function_checks {
namespace {

TEST(CostFunctionsTest, ContourOfAPlaneCircle) {
  const Eigen::Vector3d center(0.4, -0.3, 0.0);
  for (const LossType loss : kLosses) {
    for (const auto distance : {ConicDistanceType::kSampson, ConicDistanceType::kOrthogonal}) {
      for (const double arc : {2.0 * kPi, 0.8}) {
        const auto pixels = Contour(center, Eigen::Vector3d::UnitZ(), 1.2, arc, 3);
        PlaneCircleContourCost::Blocks with;
        with.tilt_and_height = with.shape = with.offset = with.camera = true;
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
        with.tilt_sigmas = {0.01, 0.01, 0.02};
        const PlaneCircleContourCost with_prior(Points(pixels, loss, distance), with);
        ExpectGradientByDifferences(with_prior, blocks, 3 + 3 + 2 + 1 + 3 + 2 + 1,
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
          blocks.AddRotation({0.001, 0.0005, -0.001});
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
  blocks.AddRotation();
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
    ExpectGradientByDifferences(cost, blocks, 3 + 3 + 2, 3 + 3 + 2 + 9);
    ExpectGradientByDifferences(near, blocks, 3 + 3 + 2, 3 + 3 + 2 + 9);
  }
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

// The same by the shifts of a camera, whether its lens is an unknown or not: lines are bent by the
// focal length, too, by which straightness tells of that.
TEST(CostFunctionsTest, NoInformationOnACameraIsLost) {
  const auto pixels = Line({-1.5, 0.2, 0.1}, {1.5, 0.21, 0.1}, 30, 7);
  for (const int num_distortion : {0, 1, 2}) {
    ImagePoints::Options how;
    how.num_distortion = num_distortion;
    const ImagePoints points(LensCamera(), pixels, {}, how);
    LineFit fit;
    ASSERT_TRUE(FitLine(points.points(), how.sigma_px, &fit).ok());
    DirectionLineCost::Options options;
    options.camera = true;
    const DirectionLineCost cost(points, fit.line, options);
    Blocks blocks;
    blocks.AddRotation({0.0, 0.0, 0.0});
    blocks.Add({3.0, 0.01, 0.0});  // The direction.
    blocks.Add({0.0});
    blocks.Add(std::vector<double>(kCameraSize, 0.0));
    ASSERT_TRUE(cost.Start(blocks.Pointers().data(), blocks.values[2].data()));
    Eigen::VectorXd r;
    Eigen::MatrixXd J;
    Linearize(cost, blocks, &r, &J);
    const auto distances = [&](Eigen::Index k, double step) {
      std::vector<double> d;
      cost.Distances(Moved(blocks, k, step).Pointers().data(), &d);
      return Eigen::VectorXd(
          Eigen::Map<Eigen::VectorXd>(d.data(), static_cast<Eigen::Index>(d.size())));
    };
    const Eigen::Index of_curve = 3 + 3 + 1, variables = of_curve + 4 + num_distortion;
    Eigen::MatrixXd by_points(static_cast<Eigen::Index>(pixels.size()), variables);
    for (Eigen::Index k = 0; k < variables; ++k) {
      constexpr double kStep = 1e-6;
      by_points.col(k) = (distances(k, kStep) - distances(k, -kStep)) / (2.0 * kStep);
    }
    // Of a camera's shift, what no move of the line does: its bend.
    const auto bend = [&](const Eigen::MatrixXd& by, Eigen::Index k) {
      constexpr double kNoise = 1e-3;  // Points off the line tell moves apart that are the same.
      Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> moves(by.rows(), of_curve);
      moves.setThreshold(kNoise);
      moves.compute(by.leftCols(of_curve));
      return (by.col(k) - by.leftCols(of_curve) * moves.solve(by.col(k))).norm();
    };
    for (Eigen::Index k = of_curve; k < variables; ++k) {
      const double expected = bend(by_points, k);
      EXPECT_NEAR(bend(J, k), expected, 0.01 * expected) << k << ", " << num_distortion;
    }
  }
}

// Whatever its focal length, aspect and principal point, a camera without distortion sees some
// conic exactly as any other one does: a contour alone tells nothing of them, however small it is
// against the noise. What its derivatives did tell would be taken for evidence once the lens has
// unknowns.
TEST(CostFunctionsTest, AContourTellsNothingOfACameraWithoutDistortion) {
  Camera camera = LensCamera();
  camera.distortion = {};
  for (const auto distance : {ConicDistanceType::kSampson, ConicDistanceType::kOrthogonal}) {
    const Ellipse ellipse{{700.0, 300.0}, 20.0, 6.0, 0.3};
    Random random(5);
    std::vector<Eigen::Vector2d> pixels;
    for (int i = 0; i < 60; ++i) {
      pixels.push_back(EllipsePoint(ellipse, 0.1 * i) + Noise2(1.0, &random));
    }
    ImagePoints::Options options;
    options.distance = distance;
    const ImagePoints points(camera, pixels, {}, options);
    Eigen::Matrix3d K;
    K << camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0;
    CurveModel model;
    points.SumConic(TransformConic(EllipseToConic(ellipse), K), 0.0, nullptr, Weighing(),
                    {false, true}, &model);
    const Eigen::MatrixXd H = model.h, A = H.topLeftCorner(6, 6), B = H.block(0, 6, 6, 4);
    const Eigen::MatrixXd left =
        H.block(6, 6, 4, 4) - B.transpose() * A.completeOrthogonalDecomposition().solve(B);
    for (int k = 0; k < 4; ++k) EXPECT_LT(std::abs(left(k, k)), 1e-9 * H(6 + k, 6 + k)) << k;
  }
}

// A contour of which no point is left, here as none is an inlier, says nothing.
TEST(CostFunctionsTest, NoPointsSayNothing) {
  const auto pixels = Contour({0.4, -0.3, 0.0}, Eigen::Vector3d::UnitZ(), 1.2, 6.0, 0);
  const ImagePoints none(LensCamera(), pixels, {0}, {});
  const PlaneCircleContourCost cost(none, {});
  Blocks blocks;
  blocks.AddPose();
  blocks.Add({0.4, -0.3});
  blocks.Add({1.2});
  std::vector<double> r(static_cast<std::size_t>(cost.num_residuals()), 1.0);
  EXPECT_TRUE(cost.Evaluate(blocks.Pointers().data(), r.data(), nullptr));
  for (const double residual : r) EXPECT_EQ(residual, 0.0);
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
}  // namespace circline::cost_function_checks
