#include "circline/ransac/conic_model.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "apps/benchmark/robust_fit_scenes.h"
#include "circline/estimators/conic_fit.h"
#include "circline/estimators/random.h"

namespace circline {
namespace {

using apps::ConicScene;
using apps::MakeConicScene;

TEST(ConicModel, ResidualsAreDistancesInPixels) {
  const ConicScene scene = MakeConicScene({100, 0.5}, 2);
  const ConicModel model(scene.points);
  const std::array<int, 5> sample{0, 1, 2, 3, 4};
  Random random(1);
  int fitted = 0;
  for (int trial = 0; trial < 100; ++trial) {
    std::array<int, 5> s = sample;
    for (int& i : s) i = random.UniformInt(model.NumData());
    ConicModel::Value value;
    if (!model.Fit(s.data(), &value)) continue;
    ++fitted;
    const Eigen::Matrix3d conic = model.ToConic(value);
    ConicModel::Value back;
    ASSERT_TRUE(model.FromConic(conic, &back));
    for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(value[k], back[k], 1e-9);
    std::vector<float> r2(kRansacBlock);
    model.SquaredResiduals(value, 32, 64, r2.data());
    for (int i = 32; i < 64; ++i) {
      const double d =
          ConicDistancePx(scene.points[static_cast<std::size_t>(model.PointIndex(i))], conic);
      const double size = std::sqrt(static_cast<double>(r2[static_cast<std::size_t>(i - 32)]));
      EXPECT_NEAR(size, std::abs(d), 1e-3 * (1.0 + std::abs(d)));
    }
    // The five points of the sample lie on it.
    for (const int i : s) {
      float square;
      model.SquaredDistances(value, i, i + 1, &square);
      EXPECT_NEAR(static_cast<double>(square), 0.0, 1e-6);
    }
  }
  EXPECT_GE(fitted, 20);
}

TEST(ConicModel, RefineFindsTheMaximumLikelihood) {
  const ConicScene scene = MakeConicScene({100, 0.0}, 4);
  const ConicModel model(scene.points);
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
  const ConicScene scene = MakeConicScene({100, 0.0}, 4);
  const ConicModel model(scene.points);
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
