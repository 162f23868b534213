#include "circline/ransac/inlier_weights.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>

#include "circline/estimators/random.h"

namespace circline {
namespace {

TEST(InlierWeights, CleanDataKeepTheirWeight) {
  Random random(1);
  std::vector<double> residuals(1000), weights;
  for (double& r : residuals) r = 0.5 * random.Normal();
  double sigma = 0.0;
  for (int i = 0; i < 5; ++i) InlierWeights(residuals, 2.0, 2, &sigma, &weights);
  EXPECT_NEAR(sigma, 0.5, 0.03);
  double sum = 0.0;
  for (const double w : weights) sum += w;
  EXPECT_GT(sum, 985.0);
}

TEST(InlierWeights, BackgroundLosesItsWeight) {
  Random random(1);
  std::vector<double> residuals(2000), weights;
  for (std::size_t i = 0; i < 1000; ++i) residuals[i] = 0.5 * random.Normal();
  for (std::size_t i = 1000; i < 2000; ++i) residuals[i] = random.Uniform(-20.0, 20.0);
  double sigma = 0.0;
  for (int i = 0; i < 10; ++i) InlierWeights(residuals, 2.0, 2, &sigma, &weights);
  EXPECT_NEAR(sigma, 0.5, 0.05);
  for (std::size_t i = 0; i < 2000; ++i) {
    const double size = std::abs(residuals[i]);
    if (size < 0.3) {
      EXPECT_GT(weights[i], 0.9);
    } else if (size > 2.0) {
      EXPECT_EQ(weights[i], 0.0);
    } else if (size > 1.7) {
      EXPECT_LT(weights[i], 0.3);
    }
  }
}

}  // namespace
}  // namespace circline
