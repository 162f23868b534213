#include "circline/ransac/oriented_conic_model.h"

#include <gtest/gtest.h>

#include <array>

#include "apps/benchmark/robust_fit_scenes.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/random.h"
#include "circline/ransac/ransac.h"
#include "tests/pinhole_camera.h"

namespace circline {
namespace {

using apps::ConicScene;
using apps::MakeConicScene;

// Points of a calibrated ellipse, seen through a lens, with their exact normals on the photo.
ConicScene ExactScene(const Ellipse& ellipse, int num_points) {
  Camera camera = PinholeCamera();
  camera.model = CameraModel::kOpenCV;
  camera.distortion = {-0.3, 0.1, 1e-3, -1e-3, 0.0, 0.0, 0.0, 0.0};
  ConicScene scene;
  std::vector<Eigen::Vector2d> pixels;
  for (int i = 0; i < num_points; ++i) {
    std::array<Eigen::Vector2d, 3> p;  // The point and its neighbours on the contour.
    for (int k = -1; k <= 1; ++k) {
      const Eigen::Vector2d x = EllipsePoint(ellipse, 2.0 * kPi * i / num_points + 1e-5 * k);
      EXPECT_TRUE(CameraToPixel(camera, {x.x(), x.y(), 1.0}, &p[static_cast<std::size_t>(k + 1)]));
    }
    const Eigen::Vector2d along = (p[2] - p[0]).normalized();
    pixels.push_back(p[1]);
    scene.directions.normals.emplace_back(-along.y(), along.x());
  }
  PixelsToCalibrated(camera, pixels, &scene.points);
  return scene;
}

TEST(OrientedConicModel, ThreeExactPointsGiveTheExactEllipse) {
  Ellipse truth;
  truth.center = {0.1, -0.05};
  truth.a = 0.2;
  truth.b = 0.12;
  truth.angle = 0.6;
  const ConicScene scene = ExactScene(truth, 40);
  const ConicModel points(scene.points, scene.directions);
  const OrientedConicModel model(points);
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    std::array<int, 3> sample;
    sample[0] = random.UniformInt(40);
    sample[1] = (sample[0] + 1 + random.UniformInt(19)) % 40;
    sample[2] = (sample[0] + 21 + random.UniformInt(19)) % 40;
    ConicModel::Value value;
    ASSERT_TRUE(model.Fit(sample.data(), &value)) << trial;
    Ellipse ellipse;
    ASSERT_TRUE(ConicToEllipse(points.ToConic(value), &ellipse));
    EXPECT_NEAR(ellipse.center.x(), truth.center.x(), 1e-5);
    EXPECT_NEAR(ellipse.center.y(), truth.center.y(), 1e-5);
    EXPECT_NEAR(ellipse.a, truth.a, 1e-5);
    EXPECT_NEAR(ellipse.b, truth.b, 1e-5);
    EXPECT_NEAR(ellipse.angle, truth.angle, 1e-4);
  }
}

// Where the model has each of the points.
std::vector<int> Positions(const ConicModel& points) {
  std::vector<int> position(static_cast<std::size_t>(points.NumData()));
  for (int i = 0; i < points.NumData(); ++i) {
    position[static_cast<std::size_t>(points.PointIndex(i))] = i;
  }
  return position;
}

// Share of samples of three of the points from..to-1 that give an ellipse.
double FitShare(const ConicModel& points, int from, int to) {
  const OrientedConicModel model(points);
  const std::vector<int> position = Positions(points);
  Random random(3);
  constexpr int kTrials = 4000;
  int fitted = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::array<int, 3> sample;
    for (int& s : sample) {
      s = position[static_cast<std::size_t>(from + random.UniformInt(to - from))];
    }
    ConicModel::Value value;
    fitted += model.Fit(sample.data(), &value) ? 1 : 0;
  }
  return static_cast<double>(fitted) / kTrials;
}

TEST(OrientedConicModel, RefusesMostSamplesOfOutliersAndFewOfInliers) {
  const ConicScene scene = MakeConicScene({100, 0.7}, 1);
  const ConicModel points(scene.points, scene.directions);
  const double inliers = FitShare(points, 0, 100);
  const double outliers = FitShare(points, 100, points.NumData());
  EXPECT_GT(inliers, 0.7);
  EXPECT_LT(outliers, 0.25);
}

TEST(OrientedConicModel, ResidualsHoldDistanceAndDirection) {
  const ConicScene scene = MakeConicScene({100, 0.5}, 2);
  const double threshold = 2.0;
  const ConicModel model(scene.points, scene.directions, threshold);
  ConicFit truth;
  ASSERT_TRUE(FitConic(scene.truth, 1.0, &truth).ok());
  ConicModel::Value value;
  ASSERT_TRUE(model.FromConic(truth.conic, &value));
  std::array<float, kRansacBlock> r2;
  model.SquaredResiduals(value, 0, kRansacBlock, r2.data());
  for (int i = 0; i < kRansacBlock; ++i) {
    const std::size_t point = static_cast<std::size_t>(model.PointIndex(i));
    const CalibratedPoint& p = scene.points[point];
    const Eigen::Vector3d gradient = truth.conic * p.Homogeneous();
    const Eigen::Vector2d normal = p.GradientPerPixel(gradient.head<2>()).normalized();
    const Eigen::Vector2d& given = scene.directions.normals[point];
    const double sine = normal.x() * given.y() - normal.y() * given.x();
    const double distance = ConicDistancePx(p, truth.conic);
    const double scaled = sine / scene.directions.sigma_rad * threshold / kInlierSigmas;
    const double expected = distance * distance + scaled * scaled;
    EXPECT_NEAR(static_cast<double>(r2[static_cast<std::size_t>(i)]), expected,
                2e-3 * (1.0 + expected));
  }
}

TEST(OrientedConicModel, NeedsFarFewerDraws) {
  const ConicScene scene = MakeConicScene({100, 0.7}, 4);
  const ConicModel points(scene.points, scene.directions);
  const ConicModel plain(scene.points);
  RansacOptions options;
  options.threshold = kInlierSigmas;
  RansacReport<ConicModel::Value> oriented, five;
  Ransac<OrientedConicModel>(options).Run(OrientedConicModel(points), &oriented);
  Ransac<ConicModel>(options).Run(plain, &five);
  ASSERT_TRUE(oriented.success);
  ASSERT_TRUE(five.success);
  EXPECT_GE(oriented.num_inliers, 90);
  EXPECT_LT(oriented.num_iterations, 400);
  EXPECT_GT(five.num_iterations, 1500);
}

TEST(OrientedConicModel, RefusesDegenerateSamples) {
  ConicScene scene = MakeConicScene({100, 0.0}, 1);
  scene.directions.normals[1].setZero();
  scene.points[3] = scene.points[2];
  const ConicModel points(scene.points, scene.directions);
  const OrientedConicModel model(points);
  const std::vector<int> position = Positions(points);
  ConicModel::Value value;
  const std::array<int, 3> unknown{position[1], position[40], position[70]};
  EXPECT_FALSE(model.Fit(unknown.data(), &value));
  const std::array<int, 3> same{position[2], position[3], position[70]};
  EXPECT_FALSE(model.Fit(same.data(), &value));
}

}  // namespace
}  // namespace circline
