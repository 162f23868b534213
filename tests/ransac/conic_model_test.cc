#include "circline/ransac/robust_conic.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "circline/estimators/conic.h"
#include "circline/estimators/random.h"

namespace circline {
namespace {

constexpr double kPi = 3.14159265358979323846;

Camera TestCamera() {
  Camera camera;
  camera.id = "cam";
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 800.0;
  camera.cx = 320.0;
  camera.cy = 240.0;
  return camera;
}

enum class Clutter { kUniform, kEllipse, kEdge, kCluster };

// 100 points of an ellipse with semi-axes 100 and 60 px, sigma 1 px, and outliers in 1.5 times its
// bounding box.
struct Scene {
  std::vector<CalibratedPoint> points;  // The contour first, then the clutter.
  std::vector<CalibratedPoint> truth;   // The contour without noise.

  // RMS error of a curve along the true contour in units of the Cramer-Rao bound (5 parameters).
  double Error(const Eigen::Matrix3d& conic) const {
    double sum = 0.0;
    for (const CalibratedPoint& p : truth) {
      const double d = ConicDistancePx(p, conic);
      sum += d * d;
    }
    return std::sqrt(sum / 5.0);
  }
};

Scene MakeScene(std::uint64_t seed, double outlier_ratio, double arc_deg = 360.0,
                Clutter clutter = Clutter::kUniform, double sigma = 1.0) {
  Random random(seed);
  Ellipse ellipse;
  ellipse.center = {320.0, 240.0};
  ellipse.a = 100.0;
  ellipse.b = 60.0;
  ellipse.angle = random.Uniform(-1.5, 1.5);
  const auto noise = [&] {
    const double x = random.Normal(), y = random.Normal();
    return Eigen::Vector2d(sigma * x, sigma * y);
  };
  std::vector<Eigen::Vector2d> truth, pixels;
  const double start = random.Uniform(0.0, 2.0 * kPi);
  for (int i = 0; i < 100; ++i) {
    truth.push_back(EllipsePoint(ellipse, start + arc_deg / 180.0 * kPi * i / 100.0));
    pixels.push_back(truth.back() + noise());
  }
  Eigen::Vector2d half = Eigen::Vector2d::Zero();
  for (int i = 0; i < 360; ++i) {
    half = half.cwiseMax((EllipsePoint(ellipse, i * kPi / 180.0) - ellipse.center).cwiseAbs());
  }
  half *= 1.5;
  const auto in_box = [&] {
    const double x = random.Uniform(-1.0, 1.0), y = random.Uniform(-1.0, 1.0);
    return Eigen::Vector2d(ellipse.center + half.cwiseProduct(Eigen::Vector2d(x, y)));
  };
  Ellipse other;
  other.center = ellipse.center + Eigen::Vector2d(60.0, -40.0);
  other.a = 80.0;
  other.b = 50.0;
  other.angle = random.Uniform(-1.5, 1.5);
  const double edge_angle = random.Uniform(0.0, kPi);
  const Eigen::Vector2d along(std::cos(edge_angle), std::sin(edge_angle));
  const Eigen::Vector2d cluster = in_box();
  const int num_outliers =
      static_cast<int>(std::lround(100.0 * outlier_ratio / (1.0 - outlier_ratio)));
  for (int i = 0; i < num_outliers; ++i) {
    if (clutter == Clutter::kUniform) pixels.push_back(in_box());
    if (clutter == Clutter::kEllipse) {
      pixels.push_back(EllipsePoint(other, random.Uniform(0.0, 2.0 * kPi)) + noise());
    }
    if (clutter == Clutter::kEdge) {
      pixels.push_back(ellipse.center + Eigen::Vector2d(20.0, 10.0) +
                       random.Uniform(-150.0, 150.0) * along + noise());
    }
    if (clutter == Clutter::kCluster) {
      const double r = 15.0 * std::sqrt(random.Uniform()), t = random.Uniform(0.0, 2.0 * kPi);
      pixels.push_back(cluster + r * Eigen::Vector2d(std::cos(t), std::sin(t)));
    }
  }
  Scene scene;
  PixelsToCalibrated(TestCamera(), pixels, &scene.points);
  PixelsToCalibrated(TestCamera(), truth, &scene.truth);
  return scene;
}

struct Statistics {
  int ok = 0;  // Errors of at most three times the bound.
  double median = 0.0;
};

Statistics RunTrials(int trials, double outlier_ratio, double arc_deg = 360.0,
                     Clutter clutter = Clutter::kUniform, ScoreType score = ScoreType::kMsac) {
  Statistics statistics;
  std::vector<double> errors;
  for (int trial = 0; trial < trials; ++trial) {
    const Scene scene =
        MakeScene(static_cast<std::uint64_t>(1000 + trial), outlier_ratio, arc_deg, clutter);
    RobustFitOptions options;
    options.ransac.max_iterations = 100000;
    options.ransac.score = score;
    ConicFit fit;
    const Status status = FitConicRobust(scene.points, options, &fit);
    errors.push_back(status.ok() ? scene.Error(fit.conic) : 1e9);
    if (errors.back() <= 3.0) ++statistics.ok;
  }
  std::sort(errors.begin(), errors.end());
  statistics.median = errors[errors.size() / 2];
  return statistics;
}

TEST(FitConicRobust, IsEfficientUpToSeventyPercentOutliers) {
  struct Case {
    double outlier_ratio, median;
  };
  for (const Case& c : {Case{0.0, 1.05}, Case{0.3, 1.08}, Case{0.5, 1.12}, Case{0.7, 1.2}}) {
    const Statistics s = RunTrials(60, c.outlier_ratio);
    EXPECT_EQ(s.ok, 60) << c.outlier_ratio;
    EXPECT_LE(s.median, c.median) << c.outlier_ratio;
  }
}

TEST(FitConicRobust, TheMarginalScoreServesToo) {
  const Statistics s = RunTrials(30, 0.5, 360.0, Clutter::kUniform, ScoreType::kMagsac);
  EXPECT_EQ(s.ok, 30);
  EXPECT_LE(s.median, 1.15);
}

TEST(FitConicRobust, FindsArcsAmongSeventyPercentOutliers) {
  for (const double arc_deg : {180.0, 90.0}) {
    const Statistics s = RunTrials(40, 0.7, arc_deg);
    EXPECT_GE(s.ok, 38) << arc_deg;
    EXPECT_LE(s.median, 1.45) << arc_deg;
  }
}

TEST(FitConicRobust, FindsTheContourAmongNinetyPercentOutliers) {
  EXPECT_GE(RunTrials(10, 0.9).ok, 9);
}

TEST(FitConicRobust, IsNotLedAstrayByStructure) {
  EXPECT_GE(RunTrials(40, 0.4, 360.0, Clutter::kEllipse).ok, 39);
  EXPECT_GE(RunTrials(40, 0.5, 360.0, Clutter::kEdge).ok, 39);
  EXPECT_GE(RunTrials(40, 0.6, 360.0, Clutter::kEdge).ok, 39);
  EXPECT_GE(RunTrials(40, 0.5, 360.0, Clutter::kCluster).ok, 39);
}

TEST(FitConicRobust, MaskIsThatOfTheReturnedEllipse) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Scene scene = MakeScene(seed, 0.5);
    RobustFitOptions options;
    ConicFit fit;
    std::vector<std::uint8_t> mask;
    ASSERT_TRUE(FitConicRobust(scene.points, options, &fit, &mask).ok());
    ASSERT_EQ(mask.size(), scene.points.size());
    for (std::size_t i = 0; i < mask.size(); ++i) {
      const double d = std::abs(ConicDistancePx(scene.points[i], fit.conic));
      EXPECT_EQ(mask[i], d <= options.ransac.threshold ? 1 : 0);
    }
  }
}

TEST(FitConicRobust, SameSeedSameBits) {
  const Scene scene = MakeScene(3, 0.7);
  RobustFitOptions options;
  ConicFit a, b;
  std::vector<std::uint8_t> mask_a, mask_b;
  ASSERT_TRUE(FitConicRobust(scene.points, options, &a, &mask_a).ok());
  ASSERT_TRUE(FitConicRobust(scene.points, options, &b, &mask_b).ok());
  EXPECT_EQ(a.conic, b.conic);
  EXPECT_EQ(a.covariance, b.covariance);
  EXPECT_EQ(mask_a, mask_b);
}

TEST(FitConicRobust, CovarianceIsHonest) {
  // Mean of e^T Cov^+ e over trials, chi-square with 5 degrees of freedom each.
  const Camera camera = TestCamera();
  Eigen::Matrix3d x_from_pixel;
  x_from_pixel << 1.0 / camera.fx, 0.0, -camera.cx / camera.fx, 0.0, 1.0 / camera.fy,
      -camera.cy / camera.fy, 0.0, 0.0, 1.0;
  constexpr int kTrials = 100;
  double sum = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Scene scene = MakeScene(static_cast<std::uint64_t>(trial), 0.3);
    ConicFit fit, truth;
    ASSERT_TRUE(FitConicRobust(scene.points, RobustFitOptions(), &fit).ok());
    ASSERT_TRUE(FitConic(scene.truth, 1.0, &truth).ok());
    const Vector6d e = ConicToVector(fit.conic) - ConicToVector(truth.conic);
    const Vector6d v = ConicToVector(fit.conic);
    const Matrix6d covariance = fit.Covariance();
    const double scale = covariance.trace();
    sum += e.dot((covariance + scale * v * v.transpose()).inverse() * e);
  }
  EXPECT_GT(sum / kTrials, 3.5);
  EXPECT_LT(sum / kTrials, 7.0);
}

TEST(FitConicRobust, ExactPointsGiveTheExactEllipse) {
  Scene scene = MakeScene(5, 0.5, 360.0, Clutter::kUniform, 0.0);
  ConicFit fit;
  ASSERT_TRUE(FitConicRobust(scene.points, RobustFitOptions(), &fit).ok());
  EXPECT_LT(scene.Error(fit.conic), 0.05);
}

TEST(FitConicRobust, MeasuresInPixelsOfADistortedPhoto) {
  Camera camera = TestCamera();
  camera.model = CameraModel::kOpenCV;
  camera.distortion = {-0.3, 0.1, 1e-3, -1e-3, 0.0, 0.0, 0.0, 0.0};
  Random random(9);
  std::vector<Eigen::Vector2d> pixels;
  for (int i = 0; i < 80; ++i) {
    const double t = 2.0 * kPi * i / 80.0;
    Eigen::Vector2d pixel;
    ASSERT_TRUE(
        CameraToPixel(camera, {0.2 + 0.1 * std::cos(t), 0.1 + 0.08 * std::sin(t), 1.0}, &pixel));
    const double nx = random.Normal(), ny = random.Normal();
    pixels.push_back(pixel + 0.3 * Eigen::Vector2d(nx, ny));
  }
  for (int i = 0; i < 80; ++i) {
    const double x = random.Uniform(350.0, 600.0), y = random.Uniform(200.0, 420.0);
    pixels.emplace_back(x, y);
  }
  std::vector<CalibratedPoint> points;
  PixelsToCalibrated(camera, pixels, &points);
  RobustFitOptions options;
  options.sigma_px = 0.3;
  options.ransac.threshold = 0.91;
  ConicFit fit;
  ASSERT_TRUE(FitConicRobust(points, options, &fit).ok());
  EXPECT_NEAR(fit.rms_px, 0.3, 0.08);
  Ellipse ellipse;
  ASSERT_TRUE(ConicToEllipse(fit.conic, &ellipse));
  EXPECT_NEAR(ellipse.center.x(), 0.2, 3e-4);
  EXPECT_NEAR(ellipse.center.y(), 0.1, 3e-4);
  EXPECT_NEAR(ellipse.a, 0.1, 4e-4);
  EXPECT_NEAR(ellipse.b, 0.08, 4e-4);
}

TEST(FitConicRobust, RefusesWhatHoldsNoEllipse) {
  const RobustFitOptions options;
  ConicFit fit;
  fit.rms_px = -7.0;
  std::vector<std::uint8_t> mask(3, 9);
  const auto refused = [&](const std::vector<Eigen::Vector2d>& pixels) {
    std::vector<CalibratedPoint> points;
    PixelsToCalibrated(TestCamera(), pixels, &points);
    const Status status = FitConicRobust(points, options, &fit, &mask);
    return status.code == StatusCode::kRefused && !status.message.empty();
  };
  std::vector<Eigen::Vector2d> collinear, repeated, edge, tiny;
  Random random(1);
  for (int i = 0; i < 60; ++i) {
    collinear.emplace_back(100.0 + 3.0 * i, 50.0 + 2.0 * i);
    repeated.emplace_back(100.0, 50.0);
    const double nx = random.Normal(), ny = random.Normal();
    edge.emplace_back(100.0 + 5.0 * i + nx, 200.0 + ny);
    tiny.emplace_back(300.0 + std::cos(i * 0.1), 200.0 + std::sin(i * 0.1));
  }
  EXPECT_TRUE(refused({}));
  EXPECT_TRUE(refused({{0.0, 0.0}, {1.0, 5.0}, {20.0, 3.0}, {4.0, 9.0}}));
  EXPECT_TRUE(refused(collinear));
  EXPECT_TRUE(refused(repeated));
  EXPECT_TRUE(refused(edge));
  EXPECT_TRUE(refused(tiny));  // Smaller than the threshold tells a circle from a blob.
  // What is refused leaves the outputs alone.
  EXPECT_EQ(fit.rms_px, -7.0);
  EXPECT_EQ(mask, std::vector<std::uint8_t>(3, 9));
}

TEST(FitConicRobust, NamesBadOptions) {
  const Scene scene = MakeScene(1, 0.0);
  ConicFit fit;
  RobustFitOptions options;
  options.ransac.threshold = -1.0;
  EXPECT_EQ(FitConicRobust(scene.points, options, &fit).code, StatusCode::kInvalidArgument);
  ConicLimits limits;
  limits.min_arc_deg = 400.0;
  const Status status = FitConicRobust(scene.points, RobustFitOptions(), &fit, nullptr, limits);
  EXPECT_EQ(status.code, StatusCode::kInvalidArgument);
  EXPECT_NE(status.message.find("min_arc_deg"), std::string::npos);
}

TEST(ConicModel, ResidualsAreDistancesInPixels) {
  const Scene scene = MakeScene(2, 0.5);
  const ConicModel model(scene.points, ConicLimits());
  const std::array<int, 5> sample{0, 1, 2, 3, 4};
  Random random(1);
  for (int trial = 0; trial < 100; ++trial) {
    std::array<int, 5> s = sample;
    for (int& i : s) i = random.UniformInt(model.NumData());
    ConicModel::Value value;
    if (!model.Fit(s.data(), &value)) continue;
    const Eigen::Matrix3d conic = model.ToConic(value);
    ConicModel::Value back;
    ASSERT_TRUE(model.FromConic(conic, &back));
    for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(value[k], back[k], 1e-9);
    std::vector<float> r2(kRansacBlock);
    model.SquaredResiduals(value, 32, 64, r2.data());
    for (int i = 32; i < 64; ++i) {
      const double d =
          ConicDistancePx(scene.points[static_cast<std::size_t>(model.PointIndex(i))], conic);
      EXPECT_NEAR(std::abs(model.Distance(value, i)), std::abs(d), 1e-9 * (1.0 + std::abs(d)));
      const double size = std::sqrt(static_cast<double>(r2[static_cast<std::size_t>(i - 32)]));
      EXPECT_NEAR(size, std::abs(d), 1e-3 * (1.0 + std::abs(d)));
    }
    // The five points of the sample lie on it.
    for (const int i : s) EXPECT_NEAR(model.Distance(value, i), 0.0, 1e-4);
  }
}

TEST(ConicModel, RefineFindsTheMaximumLikelihood) {
  const Scene scene = MakeScene(4, 0.0);
  const ConicModel model(scene.points, ConicLimits());
  ConicFit fit;
  ASSERT_TRUE(FitConic(scene.points, 1.0, &fit).ok());
  ConicModel::Value value, best;
  ASSERT_TRUE(model.FromConic(fit.conic, &best));
  value = best;
  value[0] *= 1.05;
  value[3] += 0.02;
  const std::vector<float> weights(scene.points.size(), 1.0f);
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(model.Refine(weights.data(), &value));
  // The engine's first-order distance and FitConic's orthogonal one differ by (sigma / radius)^2: 1
  // px on 60 px.
  for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(value[k], best[k], 3e-4);
}

TEST(ConicModel, RefineNeedsFivePoints) {
  const Scene scene = MakeScene(4, 0.0);
  const ConicModel model(scene.points, ConicLimits());
  std::vector<float> weights(scene.points.size(), 0.0f);
  for (std::size_t i = 0; i < 4; ++i) weights[i] = 1.0f;
  ConicFit fit;
  ASSERT_TRUE(FitConic(scene.points, 1.0, &fit).ok());
  ConicModel::Value value;
  ASSERT_TRUE(model.FromConic(fit.conic, &value));
  const ConicModel::Value before = value;
  EXPECT_FALSE(model.Refine(weights.data(), &value));
  EXPECT_EQ(value, before);
}

}  // namespace
}  // namespace circline
