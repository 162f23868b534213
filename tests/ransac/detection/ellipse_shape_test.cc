#include "circline/ransac/detection/ellipses/ellipse_shape.h"

#include <gtest/gtest.h>

namespace circline {
namespace {

// Three quarters of a rim of 50 px radius, rough at the end of what rims are, and a third of a
// small one as rough: chance explains the one 1e-30 times, the other 1e-2 times.
TEST(EllipseShape, MuchOfARimOutweighsItsRoughness) {
  constexpr double kRough = 1.1;
  EXPECT_GT(RimLogOdds(-30.0, kRough), 0.0);
  EXPECT_LT(RimLogOdds(-2.0, kRough), 0.0);
  EXPECT_GT(RimLogOdds(-2.0, 0.3), 0.0);
}

}  // namespace
}  // namespace circline
