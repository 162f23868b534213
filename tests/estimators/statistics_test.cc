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
  EXPECT_NEAR(ChiSquareLimit(10, 0.001), 29.588, 0.2);
  EXPECT_NEAR(ChiSquareLimit(100, 0.001), 149.449, 0.1);
}

}  // namespace
}  // namespace circline
