#include "circline/ransac/false_alarms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace circline {
namespace {

TEST(LogFalseAlarms, CountsTheSamplesWhereThereIsNoMoreThanChance) {
  EXPECT_NEAR(LogFalseAlarms(10, 1, 5.0, 5), std::log(10.0), 1e-12);
  EXPECT_NEAR(LogFalseAlarms(10, 2, 5.0, 5), std::log(45.0), 1e-12);
  EXPECT_NEAR(LogFalseAlarms(10, 3, 5.0, 5), std::log(120.0), 1e-12);
  EXPECT_NEAR(LogFalseAlarms(2, 2, 5.0, 2), 0.0, 1e-12);
  EXPECT_EQ(LogFalseAlarms(1, 2, 5.0, 1), 0.0);
  EXPECT_EQ(LogFalseAlarms(0, 2, 5.0, 0), 0.0);
}

TEST(LogFalseAlarms, BoundsTheTailOfThePoissonDistribution) {
  for (const double expected : {0.1, 1.0, 4.0}) {
    for (const int k : {5, 8, 20}) {
      double tail = 0.0;
      for (int i = k; i < k + 100; ++i) {
        tail += std::exp(i * std::log(expected) - expected - std::lgamma(i + 1.0));
      }
      const double bound = LogFalseAlarms(50, 2, expected, static_cast<std::size_t>(k) + 2) -
                           std::log(50.0 * 49.0 / 2.0);
      EXPECT_GT(bound, std::log(tail));
      EXPECT_LT(bound, std::log(tail) + 3.5);
    }
  }
}

TEST(LogFalseAlarms, WhatIsNeverExpectedIsSure) {
  EXPECT_EQ(LogFalseAlarms(10, 2, 0.0, 3), -std::numeric_limits<double>::max());
}

}  // namespace
}  // namespace circline
