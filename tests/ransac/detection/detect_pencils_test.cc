#include "circline/ransac/detection/structure/detect_pencils.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "circline/estimators/basics.h"
#include "circline/ransac/detection/structure/pencil_fitter.h"
#include "tests/ransac/detection/detected_line_scene.h"
#include "tests/ransac/detection/detection_test_util.h"

namespace circline {
namespace {

using detection_test::AxisDeg;
using detection_test::MakeLine;
using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<DetectedLine> MakePencil(const Vector3d& direction, int count, double scatter,
                                     std::uint64_t seed) {
  const Camera camera = detection_test::TestCamera();
  Random random(seed);
  std::vector<DetectedLine> lines;
  for (int k = 0; k < count; ++k) {
    const double u = random.Uniform(40.0, 440.0), v = random.Uniform(40.0, 320.0);
    const double length = random.Uniform(25.0, 120.0);
    lines.push_back(
        MakeLine(camera, u, v, direction, length, scatter * random.Normal(), 0.15, &random));
  }
  return lines;
}

const Vector3d kFirst = Vector3d(0.9, 0.1, 0.4).normalized();
const Vector3d kSecond = Vector3d(0.1, 1.0, -0.2).normalized();

TEST(DetectPencils, FindsTheDirectionsLongestFirst) {
  std::vector<DetectedLine> lines = MakePencil(kFirst, 30, 0.0, 1);
  const std::vector<DetectedLine> more = MakePencil(kSecond, 12, 0.0, 2);
  lines.insert(lines.end(), more.begin(), more.end());
  const auto pencils = DetectPencils(lines, 3, 1);
  ASSERT_EQ(pencils.size(), 2U);
  EXPECT_LT(AxisDeg(pencils[0].observation.fit->direction, kFirst), 0.1);
  EXPECT_LT(AxisDeg(pencils[1].observation.fit->direction, kSecond), 0.1);
  EXPECT_GT(pencils[0].support_px, pencils[1].support_px);
  EXPECT_EQ(pencils[0].ends.size(), pencils[0].observation.lines.size());
  EXPECT_NEAR(pencils[0].observation.sigma_px, 0.15, 0.06);
}

TEST(DetectPencils, KnowsTheScatterOfLinesThatAreNotQuiteParallel) {
  // A quarter of a degree each: the covariance must cover it, though every line is known far
  // better.
  double chi2 = 0.0;
  constexpr int kTrials = 30;
  for (std::uint64_t seed = 1; seed <= kTrials; ++seed) {
    const auto pencils = DetectPencils(MakePencil(kFirst, 40, 0.0044, seed), 1, 1);
    ASSERT_EQ(pencils.size(), 1U);
    const VanishingPointFit& fit = *pencils[0].observation.fit;
    const Vector3d e1 = fit.direction.unitOrthogonal(), e2 = fit.direction.cross(e1);
    Eigen::Matrix2d c;
    c << e1.dot(fit.covariance * e1), e1.dot(fit.covariance * e2), e2.dot(fit.covariance * e1),
        e2.dot(fit.covariance * e2);
    const Vector3d truth = kFirst * (kFirst.dot(fit.direction) < 0.0 ? -1.0 : 1.0);
    const Vector2d error(e1.dot(truth), e2.dot(truth));
    chi2 += error.dot(c.inverse() * error) / (2.0 * kTrials);
    // So must the noise that the lines state, the longer the line the more.
    const std::vector<LineObservation>& lines = pencils[0].observation.lines;
    for (const LineObservation& line : lines) EXPECT_GT(line.sigma_px, 0.16);
  }
  // 30 trials scatter it by 0.18. The spread is that of the lines it chose, so it is a little sure.
  EXPECT_GT(chi2, 0.5);
  EXPECT_LT(chi2, 2.2);
}

// The two sides of a thin line are parallel by themselves: drawn lines that have nothing to do with
// each other have no pencil.
TEST(DetectPencils, BothSidesOfALineCountOnce) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    std::vector<DetectedLine> lines;
    for (int i = 0; i < 12; ++i) {
      const double u = random.Uniform(60.0, 420.0), v = random.Uniform(60.0, 300.0);
      const double angle = random.Uniform(0.0, 3.1416);
      const Vector3d direction(std::cos(angle), std::sin(angle), 0.0);
      const Vector2d across = 2.5 * Vector2d(-direction.y(), direction.x());
      for (const double side : {0.0, 1.0}) {
        lines.push_back(MakeLine(detection_test::TestCamera(), u + side * across.x(),
                                 v + side * across.y(), direction, 60.0, 0.0, 0.15, &random));
      }
    }
    EXPECT_TRUE(DetectPencils(lines, 3, seed).empty()) << "seed " << seed;
  }
}

// A sheet that bends: its rows, in one part of the photo, point half a degree to either side.
TEST(DetectPencils, ARefitTakesAllLinesOfWhatBends) {
  constexpr int kLines = 40;
  std::vector<DetectedLine> lines = MakePencil(kFirst, kLines, 0.009, 5);
  const std::vector<DetectedLine> strangers = MakePencil(kSecond, 12, 0.0, 2);
  lines.insert(lines.end(), strangers.begin(), strangers.end());
  std::vector<int> all(lines.size());
  std::iota(all.begin(), all.end(), 0);
  auto pencils = DetectPencils(lines, 1, 1);
  ASSERT_FALSE(pencils.empty());
  DetectedPencil& pencil = pencils[0];
  const LineSet set(lines, kUsualDiagonalPx);
  ASSERT_TRUE(RefitPencil(set, all, &pencil));
  EXPECT_GE(pencil.members.size(), 0.9 * kLines);
  EXPECT_LT(pencil.members.back(), kLines);
  const double error = AxisDeg(pencil.observation.fit->direction, kFirst);
  const double sigma = std::sqrt(pencil.observation.fit->covariance.trace()) / kDegree;
  EXPECT_LT(error, 3.0 * sigma);
  EXPECT_LT(sigma, 0.6);
  const DetectedPencil before = pencil;
  EXPECT_FALSE(RefitPencil(set, {}, &pencil));
  EXPECT_EQ(pencil.members, before.members);
}

// A few short lines that meet those of a long pencil are found though many others are about.
TEST(DetectPencils, LooksAroundTheLongest) {
  const Camera camera = detection_test::TestCamera();
  Random random(3);
  std::vector<DetectedLine> lines;
  for (int k = 0; k < 12; ++k) {
    lines.push_back(MakeLine(camera, 240.0, 100.0 + 11.0 * k, kFirst, 160.0, 0.0, 0.1, &random));
  }
  for (int k = 0; k < 7; ++k) {
    lines.push_back(MakeLine(camera, 190.0 + 16.0 * k, 170.0, kSecond, 40.0, 0.0, 0.1, &random));
  }
  for (int k = 0; k < 30; ++k) {
    const double u = random.Uniform(20.0, 460.0), v = random.Uniform(240.0, 350.0);
    lines.push_back(MakeLine(camera, u, v, kFirst, 40.0, random.Uniform(-1.5, 1.5), 0.1, &random));
  }
  auto pencils = DetectPencils(lines, 1, 1);
  ASSERT_GE(pencils.size(), 2U);
  EXPECT_LT(AxisDeg(pencils[0].observation.fit->direction, kFirst), 1.0);
  EXPECT_TRUE(std::any_of(pencils.begin() + 1, pencils.end(), [](const DetectedPencil& p) {
    return AxisDeg(p.observation.fit->direction, kSecond) < 1.5;
  }));
}

TEST(DetectPencils, NothingFromNothing) {
  EXPECT_TRUE(DetectPencils({}, 3, 1).empty());
  EXPECT_TRUE(DetectPencils(MakePencil(kFirst, 20, 0.0, 1), 0, 1).empty());
}

}  // namespace
}  // namespace circline
