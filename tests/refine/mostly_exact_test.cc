#include "circline/refine/mostly_exact.h"

#include <gtest/gtest.h>

#include <cmath>

namespace circline {
namespace {

TEST(MostlyExact, ItsSlopesAreThoseOfItsValue) {
  for (const double s : {0.0, 0.01, 0.1, 0.3, 1.0, 4.0, 100.0, 1e4}) {
    const MostlyExact loss;
    const double step = 1e-5 * (1.0 + s);
    double rho[3], more[3], less[3];
    loss.Evaluate(s, rho);
    loss.Evaluate(s + step, more);
    loss.Evaluate(s - step, less);
    EXPECT_NEAR(rho[1], (more[0] - less[0]) / (2.0 * step), 1e-4 * rho[1]) << s;
    EXPECT_NEAR(rho[2], (more[1] - less[1]) / (2.0 * step), 1e-4 * (1.0 + std::abs(rho[2]))) << s;
  }
}

// Steep near zero, and never flatter than the wide one of its Gaussians: three directions that
// contradict each other share the miss.
TEST(MostlyExact, IsSteepNearZeroAndAGaussianBeyond) {
  double near[3], far[3], farther[3];
  MostlyExact().Evaluate(0.0, near);
  MostlyExact().Evaluate(10.0, far);
  MostlyExact().Evaluate(1000.0, farther);
  EXPECT_EQ(near[0], 0.0);
  EXPECT_GT(near[1], 50.0);
  EXPECT_NEAR(far[1], farther[1], 1e-9);
  EXPECT_GT(farther[1], 0.3);
  EXPECT_LT(farther[1], 1.0);
}

}  // namespace
}  // namespace circline
