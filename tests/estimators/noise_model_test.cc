#include "circline/estimators/noise_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/basics.h"

namespace circline {
namespace {

TEST(NoiseModel, WeighsBySharedErrors) {
  const NoiseModel model;  // The correlation length is 50 px.
  EXPECT_EQ(model.Weight(0.0, 0.3, 100.0, 500.0), 1.0);
  // 100 points on ten correlation lengths: the shared error counts ten times.
  EXPECT_NEAR(model.Weight(0.1, 0.3, 100.0, 500.0), 0.09 / (0.09 + 10.0 * 0.01), 1e-12);
  // Points farther apart than that share nothing, and a short line is at least one piece.
  EXPECT_NEAR(model.Weight(0.1, 0.3, 4.0, 500.0), 0.09 / (0.09 + 0.01), 1e-12);
  EXPECT_NEAR(model.Weight(0.1, 0.3, 4.0, 5.0), 0.09 / (0.09 + 4.0 * 0.01), 1e-12);
}

TEST(NoiseModel, MeasuresTheInliers) {
  NoiseModel model;
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i <= 200; ++i) {
    const double t = 0.031415926535897934 * i;
    points.emplace_back(50.0 * std::cos(t), 30.0 * std::sin(t));
  }
  // The perimeter is 255 px; that of the box is taken, 251.
  EXPECT_NEAR(model.ContourWeight(0.3, points, {}),
              model.Weight(model.contour_px, 0.3, 201.0, 255.0), 5e-3);
  points = {{0.0, 0.0}, {30.0, 40.0}, {300.0, 0.0}};
  EXPECT_EQ(model.LineWeight(0.3, points, {1, 1, 0}), model.Weight(model.line_px, 0.3, 2.0, 50.0));
  EXPECT_EQ(model.LineWeight(0.3, points, {0, 0, 0}), 1.0);
  EXPECT_EQ(NoiseModel::Exact().ContourWeight(0.3, points, {}), 1.0);
}

TEST(NoiseModel, NamesBadFields) {
  EXPECT_TRUE(NoiseModel().Validate().ok());
  EXPECT_TRUE(NoiseModel::Exact().Validate().ok());
  NoiseModel model;
  model.circle_tilt_rad = -1.0;
  EXPECT_CONTAINS(model.Validate().message, "circle_tilt_rad");
  model = NoiseModel();
  model.correlation_px = 0.0;
  EXPECT_CONTAINS(model.Validate().message, "correlation_px");
  model = NoiseModel();
  model.camera.log_focal = std::numeric_limits<double>::quiet_NaN();
  EXPECT_CONTAINS(model.Validate().message, "camera.log_focal");
}

TEST(NoiseModel, TrustsTheAspectOfSquarePixelsOnly) {
  const auto sigma = [](double log_aspect, double fy) {
    Camera camera;
    camera.fx = 500.0;
    camera.fy = fy;
    NoiseModel model;
    model.camera.log_aspect = log_aspect;
    return model.SigmaOf(camera).log_aspect;
  };
  EXPECT_EQ(sigma(0.001, 500.0), 0.001);
  EXPECT_NEAR(sigma(0.001, 500.0 * std::exp(-0.014)), 0.014, 1e-12);
  EXPECT_EQ(sigma(0.03, 510.0), 0.03);
  EXPECT_EQ(sigma(0.001, 375.0), 0.02);  // Squeezed on purpose.
  EXPECT_EQ(sigma(0.0, 510.0), 0.0);     // Exact.
}

}  // namespace
}  // namespace circline
