#include "circline/ransac/detection/structure/circle_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "circline/estimators/circle_pose.h"
#include "circline/estimators/random.h"
#include "tests/basics.h"
#include "tests/ransac/detection/detection_test_util.h"

namespace circline {
namespace {

using detection_test::AxisDeg;
using detection_test::DistortedCamera;
using detection_test::LookAt;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// A lattice of 7 x 5 places, turned, of which `missing` are left out, with scatter.
std::vector<Vector2d> Lattice(int missing, double scatter) {
  Random random(7);
  std::vector<Vector2d> points;
  const Vector2d a(0.9, 0.35), b(-0.4, 1.1);
  for (int i = 0; i < 7; ++i) {
    for (int j = 0; j < 5; ++j) {
      if ((3 * i + 5 * j) % 7 < missing) continue;
      points.push_back(Vector2d(3.0, -2.0) + i * a + j * b + Noise2(scatter, &random));
    }
  }
  return points;
}

TEST(FindLattice, FindsRowsAndColumnsInOrder) {
  const std::vector<Vector2d> points = Lattice(0, 0.02);
  PointLattice lattice = FindLattice(points);
  std::sort(lattice.lines.begin(), lattice.lines.end(),
            [](const auto& a, const auto& b) { return a.size() < b.size(); });
  ASSERT_EQ(lattice.lines[0].size(), 5U);
  ASSERT_EQ(lattice.lines[1].size(), 7U);
  for (const std::vector<int>& row : lattice.lines[0]) {
    ASSERT_EQ(row.size(), 7U);
    for (std::size_t k = 1; k < row.size(); ++k) {
      const Vector2d step =
          points[static_cast<std::size_t>(row[k])] - points[static_cast<std::size_t>(row[k - 1])];
      EXPECT_NEAR(step.norm(), std::hypot(0.9, 0.35), 0.15);
    }
  }
}

TEST(FindLattice, BridgesGapsAndLeavesStrangersOut) {
  std::vector<Vector2d> points = Lattice(2, 0.02);  // Two in seven are missing.
  const std::size_t members = points.size();
  points.emplace_back(2.0, -3.1);
  points.emplace_back(9.5, 6.0);
  points.emplace_back(5.03, 0.41);
  const PointLattice lattice = FindLattice(points);
  std::size_t in_rows = 0;
  for (const std::vector<int>& row : lattice.lines[0]) in_rows += row.size();
  EXPECT_GE(in_rows, members - 6);
  for (const auto& direction : lattice.lines) {
    for (const std::vector<int>& line : direction) {
      for (const int i : line) EXPECT_LT(static_cast<std::size_t>(i), members);
    }
  }
}

TEST(FindLattice, FindsNoneInDisorder) {
  const auto finds = [](const std::vector<Vector2d>& points) {
    const PointLattice lattice = FindLattice(points);
    return !lattice.lines[0].empty() || !lattice.lines[1].empty();
  };
  EXPECT_FALSE(finds({}));
  EXPECT_FALSE(finds({{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}}));
  EXPECT_FALSE(finds(std::vector<Vector2d>(9, Vector2d(1.0, 1.0))));
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    std::vector<Vector2d> points;
    for (int k = 0; k < 20; ++k) points.push_back({random.Uniform(), random.Uniform()});
    found += finds(points) ? 1 : 0;
  }
  EXPECT_LE(found, 1);
}

TEST(FindGridPencils, KnowsTheAxesThoughTheNormalIsOff) {
  const Camera camera = DistortedCamera();
  const CameraPose pose = LookAt(35.0, 12.0, 20.0, 12.0);
  std::vector<Matrix3d> circles;
  for (int i = -2; i <= 2; ++i) {
    for (int j = -2; j <= 2; ++j) {
      CirclePose circle;
      circle.normal = pose.rotation.col(2);
      circle.center = (pose.rotation * Vector3d(i, j, 0.0) + pose.translation) / 0.3;
      if (circle.normal.dot(circle.center) > 0.0) circle.normal = -circle.normal;
      circles.push_back(ProjectCircle(circle));
    }
  }
  const Vector3d off = ExpRotation(Vector3d(0.05, -0.03, 0.0)) * pose.rotation.col(2);
  const std::vector<DetectedPencil> pencils = FindGridPencils(camera, circles, off);
  ASSERT_EQ(pencils.size(), 2U);
  for (const DetectedPencil& pencil : pencils) {
    EXPECT_EQ(pencil.observation.lines.size(), 5U);
    EXPECT_EQ(pencil.ends.size(), 5U);
    EXPECT_LT(std::min(AxisDeg(pencil.observation.fit->direction, pose.rotation.col(0)),
                       AxisDeg(pencil.observation.fit->direction, pose.rotation.col(1))),
              0.02);
  }
  // Circles of another size stay out; without enough of one size there is none.
  circles.resize(5);
  EXPECT_TRUE(FindGridPencils(camera, circles, off).empty());
}

}  // namespace
}  // namespace circline
