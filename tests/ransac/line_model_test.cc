#include "circline/ransac/line_model.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "apps/benchmark/robust_fit_scenes.h"
#include "tests/basics.h"
#include "tests/pinhole_camera.h"

namespace circline {
namespace {

using apps::LineScene;
using apps::MakeLineScene;

TEST(FitLineRobust, IsEfficientUpToSeventyPercentOutliers) {
  struct Case {
    double outlier_ratio, median;
  };
  for (const Case& c : {Case{0.0, 1.0}, Case{0.5, 1.05}, Case{0.7, 1.1}}) {
    std::vector<double> errors;
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
      const LineScene scene = MakeLineScene(c.outlier_ratio, 1.0, seed);
      LineFit fit;
      ASSERT_TRUE(FitLineRobust(scene.points, RobustFitOptions(), &fit).ok());
      errors.push_back(scene.Error(fit.line));
      EXPECT_LE(errors.back(), 3.5) << seed;
    }
    // The median of the Rayleigh distribution is 0.83 of its root mean square.
    std::sort(errors.begin(), errors.end());
    EXPECT_LE(errors[50], c.median) << c.outlier_ratio;
  }
}

TEST(FitLineRobust, MaskIsThatOfTheReturnedLine) {
  const LineScene scene = MakeLineScene(0.6, 1.0, 3);
  const RobustFitOptions options;
  LineFit fit;
  std::vector<std::uint8_t> mask;
  ASSERT_TRUE(FitLineRobust(scene.points, options, &fit, &mask).ok());
  ASSERT_EQ(mask.size(), scene.points.size());
  for (std::size_t i = 0; i < mask.size(); ++i) {
    const double d = std::abs(LineDistancePx(scene.points[i], fit.line));
    EXPECT_EQ(mask[i], d <= options.ransac.threshold ? 1 : 0);
  }
}

TEST(FitLineRobust, CleanPointsGiveTheFitOfEstimators) {
  const LineScene scene = MakeLineScene(0.0, 0.3, 3);
  LineFit robust, direct;
  ASSERT_TRUE(FitLineRobust(scene.points, RobustFitOptions(), &robust).ok());
  ASSERT_TRUE(FitLine(scene.points, 1.0, &direct).ok());
  EXPECT_LT(robust.line.cross(direct.line).norm(), 1e-5);
  EXPECT_NEAR(robust.covariance.trace() / direct.covariance.trace(), 1.0, 0.05);
}

TEST(FitLineRobust, TwoPointsAreFittedAsTheyAre) {
  std::vector<CalibratedPoint> points;
  PixelsToCalibrated(PinholeCamera(), {{100.0, 200.0}, {400.0, 250.0}}, &points);
  LineFit fit;
  std::vector<std::uint8_t> mask;
  ASSERT_TRUE(FitLineRobust(points, RobustFitOptions(), &fit, &mask).ok());
  EXPECT_NEAR(LineDistancePx(points[0], fit.line), 0.0, 1e-9);
  EXPECT_NEAR(LineDistancePx(points[1], fit.line), 0.0, 1e-9);
  EXPECT_EQ(mask, std::vector<std::uint8_t>(2, 1));
}

TEST(FitLineRobust, OneStrayPointOfFour) {
  std::vector<CalibratedPoint> points;
  PixelsToCalibrated(PinholeCamera(),
                     {{100.0, 200.0}, {200.0, 200.1}, {240.0, 260.0}, {400.0, 200.0}}, &points);
  LineFit fit;
  std::vector<std::uint8_t> mask;
  ASSERT_TRUE(FitLineRobust(points, RobustFitOptions(), &fit, &mask).ok());
  EXPECT_EQ(mask, (std::vector<std::uint8_t>{1, 1, 0, 1}));
}

TEST(FitLineRobust, RefusesWhatHoldsNoLine) {
  LineFit fit;
  const RobustFitOptions options;
  EXPECT_EQ(FitLineRobust({}, options, &fit).code, StatusCode::kRefused);
  for (const std::size_t n : {1u, 2u, 10u}) {
    std::vector<CalibratedPoint> points;
    PixelsToCalibrated(PinholeCamera(), std::vector<Eigen::Vector2d>(n, {100.0, 50.0}), &points);
    EXPECT_EQ(FitLineRobust(points, options, &fit).code, StatusCode::kRefused) << n;
  }
}

TEST(FitLineRobust, NamesBadOptions) {
  RobustFitOptions options;
  options.sigma_px = -1.0;
  LineFit fit;
  const Status status = FitLineRobust(MakeLineScene(0.0, 1.0, 1).points, options, &fit);
  EXPECT_EQ(status.code, StatusCode::kInvalidArgument);
  EXPECT_CONTAINS(status.message, "sigma_px");
}

TEST(LineModel, ResidualsAreDistancesInPixels) {
  const LineScene scene = MakeLineScene(0.5, 1.0, 2);
  const LineModel model(scene.points);
  const std::array<int, 2> sample{3, 90};
  LineModel::Value value;
  ASSERT_TRUE(model.Fit(sample.data(), &value));
  std::array<float, kRansacBlock> r2;
  model.SquaredResiduals(value, 64, 96, r2.data());
  for (int i = 64; i < 96; ++i) {
    const double d = LineDistancePx(scene.points[static_cast<std::size_t>(model.PointIndex(i))],
                                    model.ToLine(value));
    const double size = std::sqrt(static_cast<double>(r2[static_cast<std::size_t>(i - 64)]));
    EXPECT_NEAR(size, std::abs(d), 1e-3 * (1.0 + std::abs(d)));
  }
}

}  // namespace
}  // namespace circline
