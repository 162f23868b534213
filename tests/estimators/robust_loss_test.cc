#include "circline/estimators/robust_loss.h"

#include <gtest/gtest.h>

#include <cmath>

#include "circline/estimators/basics.h"

namespace circline {
namespace {

class RobustLossTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(LossFromName(GetParam(), &type_)); }
  LossType type_ = LossType::kTrivial;
};

TEST_P(RobustLossTest, DerivativeMatchesDifferences) {
  EXPECT_EQ(LossName(type_), GetParam());
  EXPECT_NEAR(EvaluateLoss(type_, 0.0).rho, 0.0, 1e-15);
  EXPECT_NEAR(EvaluateLoss(type_, 0.0).rho_prime, 1.0, 1e-15);
  for (double s = 0.05; s < 200.0; s *= 1.3) {
    const double h = 1e-6 * s;
    const double numeric =
        (EvaluateLoss(type_, s + h).rho - EvaluateLoss(type_, s - h).rho) / (2.0 * h);
    EXPECT_NEAR(EvaluateLoss(type_, s).rho_prime, numeric, 1e-6) << "s " << s;
    EXPECT_LE(EvaluateLoss(type_, s).rho_prime, 1.0);
    EXPECT_GE(EvaluateLoss(type_, s).rho_prime, 0.0);
  }
}

TEST_P(RobustLossTest, SecondDerivativeMatchesDifferences) {
  const double c2 = std::pow(LossTuningConstant(type_), 2);
  for (double s = 0.05; s < 200.0; s *= 1.3) {
    const double h = 1e-5 * s;
    if (std::abs(s - c2) < 2.0 * h) continue;  // Huber's slope and Tukey's bend there.
    const double numeric =
        (LossSlopesAt(type_, s + h).first - LossSlopesAt(type_, s - h).first) / (2.0 * h);
    EXPECT_NEAR(LossSlopesAt(type_, s).second, numeric, 1e-7) << "s " << s;
  }
}

// Asymptotic efficiency on unit Gaussian noise, E[psi']^2 / E[psi^2] with psi = rho'(r^2) r.
TEST_P(RobustLossTest, KeepsNinetyFivePercentOfTheEfficiency) {
  const auto psi = [this](double r) { return EvaluateLoss(type_, r * r).rho_prime * r; };
  double slope = 0.0, square = 0.0;
  constexpr double kStep = 1e-3;
  for (double r = -9.0; r < 9.0; r += kStep) {
    const double density = std::exp(-0.5 * r * r) / std::sqrt(2.0 * kPi) * kStep;
    slope += (psi(r + 1e-4) - psi(r - 1e-4)) / 2e-4 * density;
    square += psi(r) * psi(r) * density;
  }
  EXPECT_NEAR(slope * slope / square, type_ == LossType::kTrivial ? 1.0 : 0.95, 5e-4);
}

INSTANTIATE_TEST_SUITE_P(All, RobustLossTest, ::testing::ValuesIn(LossNames()),
                         [](const auto& test) { return test.param; });

TEST(RobustLossNameTest, UnknownNamesAreRefused) {
  LossType type;
  EXPECT_FALSE(LossFromName("hubert", &type));
}

}  // namespace
}  // namespace circline
