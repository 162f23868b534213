#include "circline/ransac/detection/structure/find_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/pose.h"
#include "tests/basics.h"
#include "tests/ransac/detection/detected_line_scene.h"
#include "tests/ransac/detection/detection_test_util.h"

namespace circline {
namespace {

using detection_test::AxisDeg;
using detection_test::LineThrough;
using detection_test::TestCamera;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kNoisePx = 0.2;

// Of a box seen from above.
const Matrix3d kAxes = ExpRotation(Vector3d(2.3, 0.1, 0.2));

std::vector<DetectedLine> BoxEdges(const Camera& camera, Random* random) {
  return detection_test::BoxEdges(camera, kAxes, kNoisePx, random);
}

std::vector<DetectedLine> Clutter(const Camera& camera, int count, Random* random) {
  std::vector<DetectedLine> lines;
  for (int i = 0; i < count; ++i) {
    const Vector2d from{random->Uniform(20.0, 460.0), random->Uniform(20.0, 340.0)};
    const double angle = random->Uniform(0.0, 2.0 * kPi), length = random->Uniform(20.0, 90.0);
    const Vector2d to = from + length * Vector2d(std::cos(angle), std::sin(angle));
    lines.push_back(LineThrough(camera, from, to, kNoisePx, random));
  }
  return lines;
}

// The box's edges first.
std::vector<DetectedLine> BoxAmong(int others, const Camera& camera, Random* random) {
  std::vector<DetectedLine> lines = BoxEdges(camera, random);
  const std::vector<DetectedLine> clutter = Clutter(camera, others, random);
  lines.insert(lines.end(), clutter.begin(), clutter.end());
  return lines;
}

double NearestAxisDeg(const Vector3d& axis) {
  return std::min(
      {AxisDeg(axis, kAxes.col(0)), AxisDeg(axis, kAxes.col(1)), AxisDeg(axis, kAxes.col(2))});
}

// Of the first of a box's axes, whichever of its edges that is.
double AxisErrorDeg(const Vector3d& axis) {
  return std::min(AxisDeg(axis, kAxes.col(0)), AxisDeg(axis, kAxes.col(1)));
}

TEST(FindBox, FindsItsAxesOnTheRightOfTwoPlanes) {
  const Camera camera = TestCamera();
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const std::vector<DetectedLine> lines = BoxAmong(100, camera, &random);
    ASSERT_EQ(lines.size(), 109u);
    const Vector3d wrong = ExpRotation(Vector3d(0.9, 0.3, 0.0)) * kAxes.col(2);
    const auto box = FindBox(lines, {wrong, kAxes.col(2)});
    ASSERT_TRUE(box.has_value()) << seed;
    EXPECT_EQ(box->given, 1u) << seed;
    // Edges of 100 pixels that may be worn by a third of a pixel: 0.7 degrees each.
    EXPECT_LT(AxisErrorDeg(box->axes.col(0)), 1.0) << seed;
    EXPECT_NEAR(box->axes.determinant(), 1.0, 1e-9);
    // All three edges along each direction, and hardly anything else.
    for (int k = 0; k < 3; ++k) {
      const DetectedPencil& pencil = box->pencils[static_cast<std::size_t>(k)];
      ASSERT_TRUE(pencil.observation.fit.has_value()) << seed;
      EXPECT_LT(AxisDeg(pencil.observation.fit->direction, box->axes.col(k)), 3.0) << seed;
      EXPECT_GT(pencil.observation.fit->covariance.trace(), 0.0) << seed;
      EXPECT_GE(
          std::count_if(pencil.members.begin(), pencil.members.end(), [](int i) { return i < 9; }),
          3)
          << seed;
      EXPECT_LE(pencil.members.size(), 6u) << seed;
    }
    EXPECT_GE(box->pencils[0].support_px, box->pencils[1].support_px);
  }
}

// A rim's normal is a degree or two off.
TEST(FindBox, BearsANormalThatIsOff) {
  const Camera camera = TestCamera();
  Random random(1);
  const std::vector<DetectedLine> lines = BoxEdges(camera, &random);
  const Vector3d normal = ExpRotation(Vector3d(0.025, 0.01, 0.0)) * kAxes.col(2);
  const auto box = FindBox(lines, {normal});
  ASSERT_TRUE(box.has_value());
  EXPECT_LT(AxisErrorDeg(box->axes.col(0)), 2.0);
}

// The same directions, but no corners: an accident.
TEST(FindBox, NeedsCorners) {
  const Camera camera = TestCamera();
  Random random(1);
  std::vector<DetectedLine> lines = BoxEdges(camera, &random);
  for (DetectedLine& line : lines) {
    const Vector2d middle = 0.5 * (line.ends[0] + line.ends[1]);
    for (Vector2d& end : line.ends) end = middle + 0.3 * (end - middle);
  }
  EXPECT_FALSE(FindBox(lines, {kAxes.col(2)}).has_value());
}

TEST(FindBox, DoesNotChooseBetweenPlanesThatItCannotTellApart) {
  const Camera camera = TestCamera();
  Random random(1);
  const std::vector<DetectedLine> lines = BoxEdges(camera, &random);
  const Vector3d nearly = ExpRotation(Vector3d(1e-4, 0.0, 0.0)) * kAxes.col(2);
  EXPECT_FALSE(FindBox(lines, {kAxes.col(2), nearly}).has_value());
}

TEST(FindBox, IsRareByAccident) {
  const Camera camera = TestCamera();
  Random random(7);
  int found = 0;
  constexpr int kTrials = 300;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Vector3d normal = Noise3(1.0, &random);
    found += FindBox(Clutter(camera, 150, &random), {normal.normalized()}).has_value() ? 1 : 0;
  }
  // Fewer than on photographs, whose lines are less independent than these.
  EXPECT_LE(found, kTrials / 50);
}

// A pencil with lines of other things points half a degree beside the box's axis.
TEST(FindFreeBox, NeedsNoMoreThanADirectionNearOneOfItsAxes) {
  const Camera camera = TestCamera();
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const std::vector<DetectedLine> lines = BoxAmong(60, camera, &random);
    const Matrix3d turn = ExpRotation(Noise3(0.005, &random));
    const Vector3d other = Noise3(1.0, &random);
    const auto box = FindFreeBox(lines, {other.normalized(), turn * kAxes.col(seed % 3)});
    if (!box) continue;
    ++found;
    EXPECT_NEAR(box->axes.determinant(), 1.0, 1e-9);
    for (int k = 0; k < 3; ++k) {
      EXPECT_LT(NearestAxisDeg(box->axes.col(k)), 1.5) << seed;
    }
    EXPECT_GE(box->pencils[0].support_px, box->pencils[1].support_px);
    EXPECT_GE(box->pencils[1].support_px, box->pencils[2].support_px);
  }
  EXPECT_GE(found, 18);
}

// Its corners say where its axes are.
TEST(FindAnyBox, NeedsNoDirection) {
  const Camera camera = TestCamera();
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const std::vector<DetectedLine> lines = BoxAmong(60, camera, &random);
    const auto box = FindAnyBox(lines);
    if (!box) continue;
    ++found;
    for (int k = 0; k < 3; ++k) {
      // Of three worn edges along each axis, at times with one of something else.
      EXPECT_LT(NearestAxisDeg(box->axes.col(k)), 2.5) << seed;
    }
  }
  EXPECT_GE(found, 18);
}

// A square picture frame, each of its bars with two edges. One bar's passed for y, the opposite
// one's for z, and two sides that form a corner for x: the vanishing point was that corner.
TEST(FindAnyBox, SidesThatFormACornerAreNotParallel) {
  const Camera camera = TestCamera(640, 480, 775.0);
  Random random(1);
  std::vector<DetectedLine> lines;
  const std::vector<Segment> edges = {
      {Vector2d(471.5, 10.0), Vector2d(485.0, 315.0)},   // Right, outer.
      {Vector2d(459.7, 23.0), Vector2d(473.0, 303.0)},   // Right, inner.
      {Vector2d(196.0, 45.3), Vector2d(470.0, 8.8)},     // Top.
      {Vector2d(206.0, 54.7), Vector2d(456.0, 22.5)},    //
      {Vector2d(210.0, 317.7), Vector2d(484.0, 315.7)},  // Bottom.
      {Vector2d(219.0, 307.5), Vector2d(472.0, 304.0)},  //
      {Vector2d(195.2, 46.0), Vector2d(209.3, 317.0)},   // Left.
      {Vector2d(204.9, 56.0), Vector2d(218.4, 307.0)},   //
  };
  for (const Segment& edge : edges)
    lines.push_back(LineThrough(camera, edge[0], edge[1], 0.1, &random));
  EXPECT_FALSE(FindAnyBox(lines).has_value());
}

TEST(FindAnyBox, IsRareByAccident) {
  const Camera camera = TestCamera();
  Random random(7);
  int found = 0;
  constexpr int kTrials = 300;
  for (int trial = 0; trial < kTrials; ++trial)
    found += FindAnyBox(Clutter(camera, 100, &random)).has_value() ? 1 : 0;
  EXPECT_LE(found, 3);
}

TEST(FindFreeBox, IsRareByAccident) {
  const Camera camera = TestCamera();
  Random random(7);
  int found = 0;
  constexpr int kTrials = 100;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<Vector3d> axes;
    for (int k = 0; k < 3; ++k) {
      axes.push_back(Noise3(1.0, &random).normalized());
    }
    found += FindFreeBox(Clutter(camera, 100, &random), axes).has_value() ? 1 : 0;
  }
  EXPECT_LE(found, 1);
}

TEST(FindBox, NothingInNothingOut) {
  EXPECT_FALSE(FindAnyBox({}).has_value());
  EXPECT_FALSE(FindFreeBox({}, {Vector3d::UnitZ()}).has_value());
  EXPECT_FALSE(FindBox({}, {Vector3d::UnitZ()}).has_value());
  Random random(1);
  EXPECT_FALSE(FindBox(BoxEdges(TestCamera(), &random), {}).has_value());
}

}  // namespace
}  // namespace circline
