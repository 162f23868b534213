#include "circline/ransac/detection/structure/orthogonal_evidence.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "circline/estimators/basics.h"
#include "tests/ransac/segment_scene.h"

namespace circline {
namespace {

using Eigen::Vector3d;
using segment_scene::Lines;

TEST(OrthogonalEvidence, FindsWhatAFewLinesShareAmongOthers) {
  int found = 0, right = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Random random(seed);
    const Eigen::Matrix3d R = segment_scene::RandomRotation(&random);
    const OrthogonalEvidence evidence(Lines(R.col(1), 10, 20, &random), R.col(0), 0);
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
    found += OrthogonalEvidence(Lines(R.col(1), 0, 30, &random), R.col(0), 0).Best() ? 1 : 0;
  }
  EXPECT_LE(found, 10);
}

// Those that drift off the axis are alike.
TEST(OrthogonalEvidence, LinesThatDriftShareNothing) {
  int found = 0, unexpected = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Random random(seed);
    const Eigen::Matrix3d R = segment_scene::RandomRotation(&random);
    const std::vector<LineFit> lines = segment_scene::DriftedLines(R.col(0), 7, &random);
    found += OrthogonalEvidence(lines, R.col(0), 300).Best() ? 1 : 0;
    unexpected += OrthogonalEvidence(lines, R.col(0), 0).Best() ? 1 : 0;
  }
  EXPECT_LE(found, 10);
  EXPECT_GE(unexpected, 50);
}

// A line through the image of the axis itself does not move as a direction turns about that: no
// evidence, however little is known of the line.
TEST(OrthogonalEvidence, ALineAlongTheAxisSaysNothing) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const Eigen::Matrix3d R = segment_scene::RandomRotation(&random);
    const Vector3d axis = R.col(0);
    const OrthogonalEvidence evidence({{R.col(1), 0.16 * Eigen::Matrix3d::Identity(), 0.0}}, axis,
                                      0);
    EXPECT_LT(evidence.LogOdds(R.col(1)), 1.0) << seed;
    EXPECT_LT(evidence.HighestLogOdds(), 1.0) << seed;
  }
}

TEST(OrthogonalEvidence, NothingFromNothing) {
  EXPECT_FALSE(OrthogonalEvidence({}, Vector3d::UnitX(), 0).Best());
}

// Some lines run along a direction, others any way; the fit is off by up to eight degrees.
TEST(DirectionReadings, AreProbableWhereLinesAgree) {
  int near = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Random random(seed);
    const Eigen::Matrix3d R = segment_scene::RandomRotation(&random);
    const Vector3d along = R.col(1);
    const std::vector<LineFit> lines = Lines(along, 15, 15, &random);
    const double off = random.Uniform(-8.0, 8.0) * kDegree;
    const auto readings =
        ReadDirection(lines, R.col(0), Eigen::AngleAxisd(off, R.col(0)) * along, 15);
    double sum = 0.0, about = 0.0;
    for (const DirectionReading& reading : readings) {
      EXPECT_NEAR(reading.direction.norm(), 1.0, 1e-12);
      EXPECT_NEAR(reading.direction.dot(R.col(0)), 0.0, 1e-12);
      sum += reading.probability;
      if (segment_scene::AngleBetween(reading.direction, along) < 2.0 * kDegree)
        about += reading.probability;
    }
    EXPECT_NEAR(sum, 1.0, 1e-12);
    near += about > 0.9 ? 1 : 0;
  }
  EXPECT_GE(near, 85);
}

TEST(DirectionReadings, WithoutLinesAllAreAlike) {
  const auto readings = ReadDirection({}, Vector3d::UnitX(), Vector3d::UnitY(), 0);
  ASSERT_FALSE(readings.empty());
  for (const DirectionReading& reading : readings)
    EXPECT_NEAR(reading.probability, 1.0 / static_cast<double>(readings.size()), 1e-12);
}

}  // namespace
}  // namespace circline
