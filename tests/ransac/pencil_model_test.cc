#include "circline/ransac/pencil_model.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "circline/estimators/random.h"
#include "circline/estimators/vanishing_point.h"
#include "circline/ransac/ransac.h"
#include "tests/ransac/segment_scene.h"

namespace circline {
namespace {

TEST(PencilModel, ResidualsAreThoseOfTheFit) {
  Random random(7);
  const std::vector<LineFit> lines = segment_scene::StrayLines(20, &random);
  std::vector<int> indices(lines.size());
  std::iota(indices.begin(), indices.end(), 0);
  const PencilModel model(lines, indices, 0.0);
  const std::array<int, 2> sample{3, 8};
  PencilModel::Value value;
  ASSERT_TRUE(model.Fit(sample.data(), &value));
  std::array<float, kRansacBlock> r2;
  model.SquaredResiduals(value, 0, 20, r2.data());
  for (int i = 0; i < 20; ++i) {
    const LineFit& line = lines[static_cast<std::size_t>(model.LineIndex(i))];
    const double r = VanishingPointResidual(line, Eigen::Vector3d(value.data()));
    const double size = std::sqrt(static_cast<double>(r2[static_cast<std::size_t>(i)]));
    EXPECT_NEAR(size, std::abs(r), 0.01 * (1.0 + std::abs(r)));
  }
}

}  // namespace
}  // namespace circline
