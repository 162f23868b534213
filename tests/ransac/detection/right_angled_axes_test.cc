#include "circline/ransac/detection/structure/right_angled_axes.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "circline/estimators/pose.h"
#include "circline/estimators/random.h"
#include "tests/basics.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d RandomUnit(Random* random) { return Noise3(1.0, random).normalized(); }

TEST(RightAngledAxes, AreRotationsTheTruthAmongThem) {
  Random random(1);
  for (int trial = 0; trial < 10000; ++trial) {
    const double angle = random.Uniform(0.0, 3.0);
    const Matrix3d truth = ExpRotation(angle * RandomUnit(&random));
    std::array<Vector3d, 3> lines;
    for (int k = 0; k < 3; ++k)
      lines[static_cast<std::size_t>(k)] = truth.col(k).cross(RandomUnit(&random)).normalized();
    double nearest = 10.0;
    for (const Matrix3d& axes : RightAngledAxes(lines[0], lines[1], lines[2])) {
      EXPECT_TRUE((axes.transpose() * axes).isIdentity(1e-9));
      EXPECT_NEAR(axes.determinant(), 1.0, 1e-9);
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(axes.col(k).dot(lines[static_cast<std::size_t>(k)]), 0.0, 1e-9);
      const Vector3d cosines = (axes.transpose() * truth).diagonal().cwiseAbs();
      nearest = std::min(nearest, std::sqrt(2.0 * std::max(0.0, 1.0 - cosines.minCoeff())));
    }
    // Two solutions that are nearly one are known to the root of the rounding.
    EXPECT_LT(nearest, 1e-5) << trial;
  }
}

TEST(RightAngledAxes, OfLinesThatRepeatEachOtherAreNone) {
  const Vector3d line = Vector3d(0.6, 0.8, 0.1).normalized();
  for (const Matrix3d& axes : RightAngledAxes(line, line, line)) EXPECT_TRUE(axes.allFinite());
  EXPECT_TRUE(RightAngledAxes(Vector3d::UnitX(), Vector3d::UnitX(), Vector3d::UnitX()).empty());
}

}  // namespace
}  // namespace circline
