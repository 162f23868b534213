#include "circline/ransac/ransac_loss.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>

#include "circline/estimators/noise_model.h"
#include "circline/estimators/random.h"

namespace circline {
namespace {

// The loss of MAGSAC++ by its definition: the likelihoods of the residual under Gaussians of every
// standard deviation up to T / k that holds it, integrated numerically.
double MarginalWeight(double r) {
  constexpr double k = kInlierSigmas;
  const double from = r / k, to = 1.0 / k;
  constexpr int steps = 4000;
  double sum = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double s = from + (to - from) * (i + 0.5) / steps;
    sum += std::exp(-0.5 * r * r / (s * s)) / s * (to - from) / steps;
  }
  return sum;
}

TEST(RansacLoss, MarginalLossFollowsItsDefinition) {
  const RansacLoss loss(ScoreType::kMagsac);
  EXPECT_EQ(loss.Value(0.0f), 0.0f);
  EXPECT_EQ(loss.Value(1.0f), 1.0f);
  EXPECT_EQ(loss.Value(7.0f), 1.0f);
  EXPECT_EQ(loss.Weight(1.0f), 0.0f);
  const double scale = static_cast<double>(loss.Weight(0.25f)) / MarginalWeight(0.5);
  for (const double r : {0.2, 0.4, 0.6, 0.8, 0.95}) {
    const float u = static_cast<float>(r * r);
    EXPECT_NEAR(static_cast<double>(loss.Weight(u)), scale * MarginalWeight(r), 2e-3) << r;
  }
  // The weight is the derivative of the loss.
  for (const double u : {0.1, 0.3, 0.6, 0.9}) {
    const double slope = static_cast<double>(loss.Value(static_cast<float>(u + 0.02)) -
                                             loss.Value(static_cast<float>(u - 0.02))) /
                         0.04;
    const double reference = static_cast<double>(loss.Value(0.27f) - loss.Value(0.23f)) / 0.04;
    EXPECT_NEAR(slope / reference,
                static_cast<double>(loss.Weight(static_cast<float>(u)) / loss.Weight(0.25f)), 0.03);
  }
}

TEST(RansacLoss, OutliersAndNanCostOneAndWeighNothing) {
  for (const ScoreType type : {ScoreType::kMsac, ScoreType::kMagsac}) {
    const RansacLoss loss(type);
    for (const float u :
         {1.5f, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
      EXPECT_EQ(loss.Value(u), 1.0f);
      EXPECT_EQ(loss.Weight(u), 0.0f);
    }
  }
}

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
