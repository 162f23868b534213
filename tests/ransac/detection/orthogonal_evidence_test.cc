#include "circline/ransac/detection/orthogonal_evidence.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/ransac/segment_scene.h"

namespace circline {
namespace {

using Eigen::Vector3d;
using segment_scene::Lines;

constexpr double kSpread = 3e-3;

TEST(OrthogonalEvidence, FindsWhatAFewLinesShareAmongOthers) {
  int found = 0, right = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Random random(seed);
    const Eigen::Matrix3d R = segment_scene::RandomRotation(&random);
    const OrthogonalEvidence evidence(Lines(R.col(1), 10, 20, &random), R.col(0), kSpread);
    const auto best = evidence.Best();
    if (!best) continue;
    ++found;
    right += segment_scene::AngleBetween(*best, R.col(1)) < 0.05 ? 1 : 0;
    EXPECT_NEAR(best->dot(R.col(0)), 0.0, 1e-9);
    EXPECT_GT(evidence.LogOdds(*best), 0.0);
  }
  EXPECT_GE(found, 85);
  EXPECT_GE(right, 0.9 * found);
}

// The integral over the angle pays for the search.
TEST(OrthogonalEvidence, UnrelatedLinesShareNothing) {
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Random random(seed);
    const Eigen::Matrix3d R = segment_scene::RandomRotation(&random);
    found += OrthogonalEvidence(Lines(R.col(1), 0, 30, &random), R.col(0), kSpread).Best() ? 1 : 0;
  }
  EXPECT_LE(found, 10);
}

TEST(OrthogonalEvidence, NothingFromNothing) {
  EXPECT_FALSE(OrthogonalEvidence({}, Vector3d::UnitX(), kSpread).Best());
}

}  // namespace
}  // namespace circline
