#include "circline/ransac/robust_conic.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "apps/benchmark/robust_fit_scenes.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/random.h"
#include "circline/estimators/statistics.h"
#include "tests/basics.h"
#include "tests/pinhole_camera.h"
#include "tests/trials.h"

namespace circline {
namespace {

using apps::Clutter;
using apps::ConicScene;
using apps::MakeConicScene;

struct Statistics {
  int wrong = 0;  // Refused, or an error of more than three times the bound.
  double median = 0.0;
};

// Default options throughout. A few wrong ones are never more likely than among all trials.
Statistics RunTrials(int trials, double outlier_ratio, double arc_deg = 360.0,
                     Clutter clutter = Clutter::kUniform, bool with_directions = false) {
  Statistics statistics;
  std::vector<double> errors;
  for (int trial = 0; trial < Trials(trials); ++trial) {
    const ConicScene scene = MakeConicScene({100, outlier_ratio, arc_deg, clutter},
                                            static_cast<std::uint64_t>(1000 + trial));
    RobustFitOptions options;
    ConicFit fit;
    const Status status = FitConicRobust(scene.points, options, &fit, nullptr,
                                         with_directions ? scene.directions : EdgeDirections());
    errors.push_back(status.ok() ? scene.Error(fit.conic) : 1e9);
    if (!(errors.back() <= 3.0)) ++statistics.wrong;
  }
  statistics.median = Median(errors);
  return statistics;
}

TEST(FitConicRobust, IsEfficientUpToSeventyPercentOutliers) {
  struct Case {
    double outlier_ratio, median;
  };
  for (const bool with_directions : {false, true}) {
    for (const Case& c : {Case{0.0, 1.05}, Case{0.3, 1.05}, Case{0.5, 1.05}, Case{0.7, 1.1}}) {
      const Statistics s =
          RunTrials(100, c.outlier_ratio, 360.0, Clutter::kUniform, with_directions);
      EXPECT_EQ(s.wrong, 0) << c.outlier_ratio;
      if (!kSanitized) {
        EXPECT_LE(s.median, c.median) << c.outlier_ratio;
      }
    }
  }
}

TEST(FitConicRobust, FindsArcsAmongSeventyPercentOutliers) {
  for (const bool with_directions : {false, true}) {
    for (const double arc_deg : {180.0, 90.0}) {
      const Statistics s = RunTrials(200, 0.7, arc_deg, Clutter::kUniform, with_directions);
      EXPECT_LE(s.wrong, 2) << arc_deg;
      if (!kSanitized) {
        EXPECT_LE(s.median, 1.25) << arc_deg;
      }
    }
  }
}

TEST(FitConicRobust, FindsTheContourAmongNinetyPercentOutliers) {
  EXPECT_LE(RunTrials(60, 0.9).wrong, 3);
  EXPECT_EQ(RunTrials(50, 0.9, 360.0, Clutter::kUniform, true).wrong, 0);
}

TEST(FitConicRobust, IsNotLedAstrayByStructure) {
  for (const bool with_directions : {false, true}) {
    EXPECT_LE(RunTrials(100, 0.4, 360.0, Clutter::kEllipse, with_directions).wrong, 1);
    EXPECT_LE(RunTrials(100, 0.5, 360.0, Clutter::kEdge, with_directions).wrong, 1);
    EXPECT_LE(RunTrials(100, 0.7, 360.0, Clutter::kEdge, with_directions).wrong, 1);
    EXPECT_LE(RunTrials(100, 0.5, 360.0, Clutter::kCluster, with_directions).wrong, 1);
    EXPECT_LE(RunTrials(100, 0.7, 360.0, Clutter::kCluster, with_directions).wrong, 1);
  }
}

TEST(FitConicRobust, MaskLeavesOutWrongDirections) {
  ConicScene scene = MakeConicScene({100, 0.5}, 1);
  // The contour's first point has the normal of a line that crosses it.
  Eigen::Vector2d& normal = scene.directions.normals[0];
  normal = {-normal.y(), normal.x()};
  ConicFit fit;
  std::vector<std::uint8_t> near, right;
  const RobustFitOptions options;
  ASSERT_TRUE(FitConicRobust(scene.points, options, &fit, &near).ok());
  ASSERT_TRUE(FitConicRobust(scene.points, options, &fit, &right, scene.directions).ok());
  EXPECT_EQ(near[0], 1);
  EXPECT_EQ(right[0], 0);
  const auto in_clutter = [](const std::vector<std::uint8_t>& mask) {
    return std::count(mask.begin() + 100, mask.end(), 1);
  };
  EXPECT_LT(in_clutter(right), in_clutter(near));
  EXPECT_GE(std::count(right.begin(), right.begin() + 100, 1), 95);
}

TEST(FitConicRobust, UnknownDirectionsAreLikeNone) {
  ConicScene scene = MakeConicScene({100, 0.3}, 1);
  for (std::size_t i = 0; i < scene.points.size(); i += 2) scene.directions.normals[i].setZero();
  ConicFit fit;
  ASSERT_TRUE(
      FitConicRobust(scene.points, RobustFitOptions(), &fit, nullptr, scene.directions).ok());
  EXPECT_LE(scene.Error(fit.conic), 2.0);
}

TEST(FitConicRobust, NamesBadDirections) {
  const ConicScene scene = MakeConicScene({100, 0.0}, 1);
  ConicFit fit;
  const auto message = [&](const EdgeDirections& directions) {
    const Status status =
        FitConicRobust(scene.points, RobustFitOptions(), &fit, nullptr, directions);
    EXPECT_EQ(status.code, StatusCode::kInvalidArgument);
    return status.message;
  };
  EdgeDirections directions = scene.directions;
  directions.sigma_rad = 0.0;
  EXPECT_CONTAINS(message(directions), "sigma_rad");
  directions = scene.directions;
  directions.normals.pop_back();
  EXPECT_CONTAINS(message(directions), "normals");
  directions = scene.directions;
  directions.normals[3].x() = std::nan("");
  EXPECT_CONTAINS(message(directions), "normals");
}

TEST(FitConicRobust, MaskIsThatOfTheReturnedEllipse) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const ConicScene scene = MakeConicScene({100, 0.5}, seed);
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
  const ConicScene scene = MakeConicScene({100, 0.7}, 3);
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
  constexpr int kTrials = Trials(100);
  double sum = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const ConicScene scene = MakeConicScene({100, 0.3}, static_cast<std::uint64_t>(trial));
    ConicFit fit, truth;
    ASSERT_TRUE(FitConicRobust(scene.points, RobustFitOptions(), &fit).ok());
    ASSERT_TRUE(FitConic(scene.truth, 1.0, &truth).ok());
    const Vector6d e = ConicToVector(fit.conic) - ConicToVector(truth.conic);
    const Vector6d v = ConicToVector(fit.conic);
    const Matrix6d covariance = fit.Covariance();
    const double scale = covariance.trace();
    sum += e.dot((covariance + scale * v * v.transpose()).inverse() * e);
  }
  if (kSanitized) return;
  EXPECT_NEAR(sum / kTrials, 5.0, 1.0);  // 100 trials scatter it by 0.32.
}

TEST(FitConicRobust, ExactPointsGiveTheExactEllipse) {
  constexpr double kExact = 1e-6;  // Pixels.
  const ConicScene scene = MakeConicScene({100, 0.5, 360.0, Clutter::kUniform, kExact}, 5);
  ConicFit fit;
  ASSERT_TRUE(FitConicRobust(scene.points, RobustFitOptions(), &fit).ok());
  EXPECT_LT(kExact * scene.Error(fit.conic), 0.05);
}

TEST(FitConicRobust, MeasuresInPixelsOfADistortedPhoto) {
  Camera camera = PinholeCamera();
  camera.model = CameraModel::kOpenCV;
  camera.distortion = {-0.3, 0.1, 1e-3, -1e-3, 0.0, 0.0, 0.0, 0.0};
  Random random(9);
  std::vector<Eigen::Vector2d> pixels;
  for (int i = 0; i < 80; ++i) {
    const double t = 2.0 * kPi * i / 80.0;
    Eigen::Vector2d pixel;
    ASSERT_TRUE(
        CameraToPixel(camera, {0.2 + 0.1 * std::cos(t), 0.1 + 0.08 * std::sin(t), 1.0}, &pixel));
    pixels.push_back(pixel + Noise2(0.3, &random));
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
    PixelsToCalibrated(PinholeCamera(), pixels, &points);
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

TEST(FitConicRobust, RefusesWhatChanceExplains) {
  Random random(1);
  std::vector<CalibratedPoint> points;
  for (int i = 0; i < 50; ++i) {
    const double x = random.Uniform(0.0, 300.0), y = random.Uniform(0.0, 200.0);
    CalibratedPoint p;
    ASSERT_TRUE(PixelToCalibrated(PinholeCamera(), {200.0 + x, 100.0 + y}, &p));
    points.push_back(p);
  }
  ConicFit fit;
  const Status status = FitConicRobust(points, RobustFitOptions(), &fit);
  EXPECT_EQ(status.code, StatusCode::kRefused);
  EXPECT_CONTAINS(status.message, "of 50 points");
}

TEST(FitConicRobust, NamesBadOptions) {
  const ConicScene scene = MakeConicScene({100, 0.0}, 1);
  ConicFit fit;
  RobustFitOptions options;
  options.ransac.threshold = -1.0;
  EXPECT_EQ(FitConicRobust(scene.points, options, &fit).code, StatusCode::kInvalidArgument);
}

// Share of scenes in which what the first fit leaves holds a second ellipse.
double ShareWithSecond(double outlier_ratio, Clutter clutter, bool with_directions,
                       int trials = Trials(50)) {
  int seconds = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const ConicScene scene = MakeConicScene({100, outlier_ratio, 360.0, clutter},
                                            static_cast<std::uint64_t>(2000 + trial));
    const EdgeDirections directions = with_directions ? scene.directions : EdgeDirections();
    const RobustFitOptions options;
    ConicFit first, second;
    std::vector<std::uint8_t> mask;
    EXPECT_TRUE(FitConicRobust(scene.points, options, &first, nullptr, directions).ok());
    if (!FitSecondConic(scene.points, options, first.conic, &second, &mask, directions).ok())
      continue;
    ++seconds;
    EXPECT_EQ(mask.size(), scene.points.size());
    // The contour comes first: none of its points are the second ellipse's but where they cross.
    EXPECT_LE(std::count(mask.begin(), mask.begin() + 100, 1), 5);
  }
  return static_cast<double>(seconds) / trials;
}

TEST(FitSecondConic, FindsAnotherEllipseAndNothingInClutter) {
  for (const bool with_directions : {false, true}) {
    EXPECT_GE(ShareWithSecond(0.3, Clutter::kEllipse, with_directions), 0.98);
    EXPECT_GE(ShareWithSecond(0.3, Clutter::kEllipse, with_directions), 0.98);
    EXPECT_LE(ShareWithSecond(0.5, Clutter::kUniform, with_directions), 0.0);
    EXPECT_LE(ShareWithSecond(0.7, Clutter::kUniform, with_directions), 0.0);
    const double of_cluster =
        ShareWithSecond(0.5, Clutter::kCluster, with_directions, Trials(1000));
    if (!kSanitized) {
      EXPECT_LE(of_cluster, 0.02);  // 0.012 without, 0 with directions.
    }
    EXPECT_LE(ShareWithSecond(0.5, Clutter::kEdge, with_directions), 0.0);
  }
}

}  // namespace
}  // namespace circline
