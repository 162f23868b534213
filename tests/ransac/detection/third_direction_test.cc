#include "circline/ransac/detection/structure/third_direction.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/ransac/segment_scene.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

UncertainDirection Known(const Vector3d& vector, double sigma_rad) {
  return {vector, sigma_rad * sigma_rad * (Matrix3d::Identity() - vector * vector.transpose())};
}

std::vector<LineOdds> OddsOf(const std::vector<LineFit>& fits) {
  constexpr double kSpreadRad = 3e-3;
  std::vector<LineOdds> odds;
  for (const LineFit& fit : fits) odds.emplace_back(WithDirectionError(fit, kSpreadRad));
  return odds;
}

TEST(ThirdDirection, IsAtRightAnglesToBoth) {
  Random random(1);
  const Matrix3d R = segment_scene::RandomRotation(&random);
  const auto third = ThirdDirection(Known(R.col(0), 0.01), Known(R.col(1), 0.0), CameraError());
  ASSERT_TRUE(third);
  EXPECT_NEAR(std::abs(third->direction.dot(R.col(2))), 1.0, 1e-12);
  // It turns with the one that is not exact about the other, and leans as houses do.
  const double lean = kRightAngleSigmaDeg * kDegree;
  EXPECT_NEAR(std::sqrt(R.col(0).dot(third->covariance * R.col(0))), std::hypot(0.01, lean), 1e-9);
  EXPECT_NEAR(std::sqrt(R.col(1).dot(third->covariance * R.col(1))), lean, 1e-9);
  EXPECT_FALSE(ThirdDirection(Known(R.col(0), 0.0), Known(R.col(0), 0.0), CameraError()));
}

// Five of thirty lines are enough where the direction is known to 1.5 degrees; those that have
// nothing in common are hardly ever taken to.
TEST(LinesAlong, AFewLinesAreEnoughWhereTheyAreExpected) {
  int found = 0, right = 0, accidents = 0;
  constexpr int kTrials = 200;
  constexpr double kSigma = 1.5 * kDegree, kOdds = 20.0;
  for (std::uint64_t seed = 1; seed <= kTrials; ++seed) {
    Random random(seed);
    const Matrix3d R = segment_scene::RandomRotation(&random);
    const double about_x = kSigma * random.Normal(), about_y = kSigma * random.Normal();
    const Vector3d expected = (R.col(2) + about_x * R.col(0) + about_y * R.col(1)).normalized();
    const SharedDirection shared =
        LinesAlong(OddsOf(segment_scene::Lines(R.col(2), 5, 25, &random)), Known(expected, kSigma));
    found += shared.ratio > kOdds ? 1 : 0;
    right += shared.ratio > kOdds &&
                     segment_scene::AngleBetween(shared.direction, R.col(2)) < 3.0 * kSigma
                 ? 1
                 : 0;
    const SharedDirection none =
        LinesAlong(OddsOf(segment_scene::Lines(R.col(2), 0, 30, &random)), Known(expected, kSigma));
    accidents += none.ratio > kOdds ? 1 : 0;
  }
  EXPECT_GE(found, 0.7 * kTrials);
  EXPECT_GE(right, 0.95 * found);
  // Odds of 20 come by accident once in 20 at most.
  EXPECT_LE(accidents, 0.05 * kTrials);
}

TEST(LinesAlong, StaysFiniteForManyExactLines) {
  Random random(3);
  const Matrix3d R = segment_scene::RandomRotation(&random);
  std::vector<LineOdds> lines;
  for (int k = 0; k < 40; ++k) {
    const Vector3d line = R.col(2).cross(segment_scene::RandomRotation(&random).col(0));
    lines.emplace_back(LineFit{line.normalized(), 1e-16 * Matrix3d::Identity(), 0.0});
  }
  const SharedDirection shared = LinesAlong(lines, Known(R.col(2), 1e-9));
  EXPECT_TRUE(std::isfinite(shared.ratio));
  EXPECT_GT(shared.ratio, 1e10);
  EXPECT_EQ(LinesAlong({}, Known(R.col(2), 0.01)).ratio, 1.0);
}

}  // namespace
}  // namespace circline
