#include "circline/ransac/trimmed_direction.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "circline/estimators/random.h"
#include "tests/ransac/segment_scene.h"

namespace circline {
namespace {

using segment_scene::AddSegment;
using segment_scene::AngleBetween;
using segment_scene::RandomRotation;

TEST(FitTrimmedDirection, IsThatOfTheLinesThatAgreeWhateverTheirScale) {
  int right = 0;
  for (std::uint64_t trial = 0; trial < 50; ++trial) {
    Random random(trial);
    const Eigen::Vector3d direction = RandomRotation(&random).col(0);
    std::vector<LineFit> lines;
    for (int i = 0; i < 14; ++i) AddSegment(&direction, &random, &lines);
    for (int i = 0; i < 6; ++i) AddSegment(nullptr, &random, &lines);
    ASSERT_EQ(lines.size(), 20u);
    for (LineFit& line : lines) line.covariance *= 1e4;
    VanishingPointFit fit;
    ASSERT_TRUE(FitTrimmedDirection(lines, 14, &fit).ok());
    right += AngleBetween(direction, fit.direction) < 0.1 ? 1 : 0;
  }
  EXPECT_GE(right, 47);
}

TEST(FitTrimmedDirection, RefusesTooFewLines) {
  Random random(1);
  std::vector<LineFit> lines;
  for (int i = 0; i < 3; ++i) AddSegment(nullptr, &random, &lines);
  VanishingPointFit fit;
  EXPECT_EQ(FitTrimmedDirection(lines, 4, &fit).code, StatusCode::kRefused);
  EXPECT_EQ(FitTrimmedDirection(lines, 1, &fit).code, StatusCode::kRefused);
  EXPECT_EQ(FitTrimmedDirection({lines[0], lines[0]}, 2, &fit).code, StatusCode::kRefused);
}

}  // namespace
}  // namespace circline
