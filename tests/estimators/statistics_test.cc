#include "circline/estimators/statistics.h"

#include <gtest/gtest.h>

namespace circline {
namespace {

TEST(Median, OfOddEvenAndNone) {
  EXPECT_EQ(Median({3.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(Median({4.0, 1.0, 3.0, 2.0}), 3.0);
  EXPECT_EQ(Median({}), 0.0);
}

TEST(ChiSquareLimit, IsThatOfTables) {
  EXPECT_NEAR(ChiSquareLimit(1, 0.05), 3.8415, 1e-3);
  EXPECT_NEAR(ChiSquareLimit(1, 0.001), 10.828, 1e-3);
  EXPECT_NEAR(ChiSquareLimit(2, 1e-9), 41.447, 1e-3);
  EXPECT_NEAR(ChiSquareLimit(3, 0.001), 16.266, 1e-3);
  EXPECT_NEAR(ChiSquareLimit(10, 0.001), 29.588, 1e-3);
  EXPECT_NEAR(ChiSquareLimit(100, 0.001), 149.449, 1e-3);
  EXPECT_NEAR(ChiSquareLimit(200, 0.001), 267.541, 0.1);
}

}  // namespace
}  // namespace circline
