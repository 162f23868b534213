#include "circline/ransac/detection/structure/line_odds.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "circline/estimators/basics.h"
#include "tests/ransac/segment_scene.h"

namespace circline {
namespace {

using Eigen::Vector3d;

// Lines of any orientation at one place: the ratio's mean over them is one, near the direction as
// far from it. A likelihood ratio that took misses to be uniform up to one would have a mean of 10
// at a distance of 0.1.
TEST(LineOdds, AreFairWhereverTheLineLies) {
  for (const double distance : {0.1, 0.3, 1.2}) {
    const Vector3d middle = Vector3d::UnitZ(),
                   direction(std::sin(distance), 0.0, std::cos(distance));
    constexpr int kLines = 20000;
    double sum = 0.0;
    for (int i = 0; i < kLines; ++i) {
      const double angle = kPi * (i + 0.5) / kLines;
      const Vector3d along(std::cos(angle), std::sin(angle), 0.0);
      LineFit fit;
      fit.line = along.cross(middle);
      fit.covariance = 1e-6 * middle * middle.transpose() + 4e-6 * along * along.transpose();
      const LineOdds odds(fit);
      EXPECT_NEAR(odds.Sine(direction), std::sin(distance), 1e-6);
      sum += std::exp(odds.LogRatio(direction, odds.Variance(direction)));
    }
    EXPECT_NEAR(sum / kLines, 1.0, 0.1) << distance;
  }
}

}  // namespace
}  // namespace circline
