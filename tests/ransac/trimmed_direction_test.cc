#include "circline/ransac/trimmed_direction.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <ctime>
#include <vector>

#include "circline/estimators/random.h"
#include "tests/ransac/segment_scene.h"
#include "tests/trials.h"

namespace circline {
namespace {

using segment_scene::AngleBetween;
using segment_scene::Lines;
using segment_scene::RandomRotation;

TEST(FitTrimmedDirection, IsThatOfTheLinesThatAgreeWhateverTheirScale) {
  int right = 0;
  for (std::uint64_t trial = 0; trial < 50; ++trial) {
    Random random(trial);
    const Eigen::Vector3d direction = RandomRotation(&random).col(0);
    std::vector<LineFit> lines = Lines(direction, 14, 6, &random);
    ASSERT_EQ(lines.size(), 20u);
    for (LineFit& line : lines) line.covariance *= 1e4;
    VanishingPointFit fit;
    ASSERT_TRUE(FitTrimmedDirection(lines, 14, &fit).ok());
    right += AngleBetween(direction, fit.direction) < 0.1 ? 1 : 0;
  }
  EXPECT_GE(right, 47);
}

// In time that grows with the lines, not with the pairs of them, of which there are 45 milliards.
TEST(FitTrimmedDirection, TakesThreeHundredThousandLines) {
  Random random(1);
  const Eigen::Vector3d direction = RandomRotation(&random).col(0);
  const std::vector<LineFit> lines = Lines(direction, 300000, 0, &random);
  VanishingPointFit fit;
  const std::clock_t begin = std::clock();
  ASSERT_TRUE(FitTrimmedDirection(lines, 200000, &fit).ok());
  EXPECT_LT(AngleBetween(direction, fit.direction), 0.01);
  if (kSanitized) return;
  EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 10.0);
}

TEST(FitTrimmedDirection, RefusesTooFewLines) {
  Random random(1);
  const std::vector<LineFit> lines = segment_scene::StrayLines(3, &random);
  VanishingPointFit fit;
  EXPECT_EQ(FitTrimmedDirection(lines, 4, &fit).code, StatusCode::kRefused);
  EXPECT_EQ(FitTrimmedDirection(lines, 1, &fit).code, StatusCode::kRefused);
  EXPECT_EQ(FitTrimmedDirection({lines[0], lines[0]}, 2, &fit).code, StatusCode::kRefused);
}

}  // namespace
}  // namespace circline
