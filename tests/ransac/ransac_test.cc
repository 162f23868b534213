#include "circline/ransac/ransac.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <climits>
#include <cmath>
#include <vector>

#include "tests/basics.h"
#include "tests/ransac/location_model.h"

namespace circline {
namespace {

TEST(RequiredIterations, IsHypergeometric) {
  // p = (5 4) / (10 9) = 2 / 9; log 0.01 / log(7 / 9) = 18.3.
  EXPECT_EQ(RequiredIterations(10, 5, 2, 0.99), 19);
  EXPECT_EQ(RequiredIterations(10, 10, 2, 0.99), 1);
  EXPECT_EQ(RequiredIterations(10, 1, 2, 0.99), INT_MAX);
  // The usual (5 / 10)^5 would say 146; without replacement one sample of 252 is good.
  EXPECT_EQ(RequiredIterations(10, 5, 5, 0.99), 1159);
  EXPECT_EQ(RequiredIterations(1000000, 5, 5, 0.99), INT_MAX);
}

TEST(Ransac, FindsTheInliers) {
  const Location model = MakeData(200, 40, 0.1);
  Ransac<Location>::Report report;
  Ransac<Location>(RansacOptions()).Run(model, &report);
  ASSERT_TRUE(report.success);
  EXPECT_EQ(report.num_inliers, 40);
  EXPECT_NEAR(report.model[0], 0.0, 0.06);
  EXPECT_EQ(report.stop_reason, StopReason::kConfident);
  EXPECT_GT(report.num_local_optimizations, 0);
}

TEST(Ransac, StopsExactlyWhenConfident) {
  // Without noise every all-inlier sample gives the final model, so the search ends at the draw
  // that the formula says, or with the first such sample if that comes later.
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Location model = MakeData(50, 20, 0.0);
    RansacOptions options;
    options.seed = seed;
    Ransac<Location>::Report report;
    Ransac<Location>(options).Run(model, &report);
    ASSERT_TRUE(report.success);
    const int needed = RequiredIterations(50, 20, 2, options.confidence);
    EXPECT_EQ(report.num_iterations, std::max(needed, model.first_good_)) << seed;
    EXPECT_EQ(report.num_iterations, model.fits_);
  }
}

TEST(Ransac, OneDrawIsEnoughWithoutOutliers) {
  const Location model = MakeData(50, 50, 0.0);
  Ransac<Location>::Report report;
  Ransac<Location>(RansacOptions()).Run(model, &report);
  EXPECT_EQ(report.num_iterations, 1);
  EXPECT_EQ(report.num_inliers, 50);
}

TEST(Ransac, KeepsToItsBounds) {
  const Location model = MakeData(1000, 20, 0.0);
  RansacOptions options;
  options.max_iterations = 17;
  Ransac<Location>::Report report;
  Ransac<Location>(options).Run(model, &report);
  EXPECT_EQ(report.num_iterations, 17);
  EXPECT_EQ(report.stop_reason, StopReason::kMaxIterations);

  const Location clean = MakeData(50, 50, 0.0);
  options.max_iterations = 1000;
  options.min_iterations = 30;
  Ransac<Location>(options).Run(clean, &report);
  EXPECT_EQ(report.num_iterations, 30);
}

TEST(Ransac, DegenerateSamplesAreNoModel) {
  Location model = MakeData(50, 50, 0.0);
  model.always_degenerate_ = true;
  RansacOptions options;
  options.max_iterations = 100;
  Ransac<Location>::Report report;
  Ransac<Location>(options).Run(model, &report);
  EXPECT_FALSE(report.success);
  EXPECT_EQ(report.num_iterations, 100);
  EXPECT_EQ(report.num_degenerate, 100);
  EXPECT_EQ(report.num_inliers, 0);
  EXPECT_EQ(report.inlier_mask, std::vector<std::uint8_t>(50, 0));
}

TEST(Ransac, CountsDegenerateSamplesAndGoesOn) {
  // Half of the pairs of inliers are 10 or more apart: no sample.
  std::vector<double> data;
  for (int i = 0; i < 40; ++i) data.push_back(i % 2 == 0 ? -6.0 : 6.0);
  const Location model(data);
  RansacOptions options;
  options.min_iterations = options.max_iterations = 400;
  options.local_steps = 0;
  Ransac<Location>::Report report;
  Ransac<Location>(options).Run(model, &report);
  ASSERT_TRUE(report.success);
  EXPECT_EQ(report.num_inliers, 20);
  EXPECT_EQ(report.num_iterations, 400);
  EXPECT_EQ(model.fits_, 400);
  EXPECT_NEAR(report.num_degenerate, 400.0 * 20 / 39, 40.0);
}

TEST(Ransac, TooFewDataAreRefused) {
  for (int n : {0, 1}) {
    const Location model = MakeData(n, n, 0.0);
    Ransac<Location>::Report report;
    Ransac<Location>(RansacOptions()).Run(model, &report);
    EXPECT_FALSE(report.success);
    EXPECT_EQ(report.stop_reason, StopReason::kTooFewData);
    EXPECT_EQ(model.fits_, 0);
  }
}

TEST(Ransac, TheModelHasTheLastWord) {
  Location model = MakeData(200, 100, 0.1);
  model.accept_below_ = -1e9;
  RansacOptions options;
  options.max_iterations = 200;
  Ransac<Location>::Report report;
  Ransac<Location>(options).Run(model, &report);
  EXPECT_FALSE(report.success);
}

TEST(Ransac, MaskAndScoreAreThoseOfTheReturnedModel) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    // Noise well beyond the threshold: refinement moves data in and out.
    const Location model = MakeData(300, 200, 2.0);
    RansacOptions options;
    options.seed = seed;
    Ransac<Location>::Report report;
    Ransac<Location>(options).Run(model, &report);
    ASSERT_TRUE(report.success);
    double expected = 0.0;
    int inliers = 0;
    for (int i = 0; i < model.NumData(); ++i) {
      const double r = model.Datum(i) - report.model[0];
      expected += std::min(r * r, 1.0);
      EXPECT_EQ(report.inlier_mask[static_cast<std::size_t>(i)], std::abs(r) < 1.0 ? 1 : 0);
      inliers += std::abs(r) < 1.0 ? 1 : 0;
    }
    EXPECT_EQ(report.num_inliers, inliers);
    EXPECT_NEAR(report.score, expected, 1e-3);
  }
}

TEST(Ransac, LocalOptimizationImprovesTheScore) {
  const Location model = MakeData(300, 200, 0.4);
  RansacOptions options;
  Ransac<Location>::Report with, without;
  Ransac<Location>(options).Run(model, &with);
  options.local_steps = 0;
  Ransac<Location>(options).Run(model, &without);
  EXPECT_LT(with.score, without.score);
  EXPECT_EQ(without.num_local_optimizations, 0);
  EXPECT_NEAR(with.model[0], 0.0, 0.1);
}

TEST(Ransac, SameSeedSameBits) {
  const Location model = MakeData(300, 100, 0.4);
  RansacOptions options;
  options.seed = 42;
  Ransac<Location>::Report a, b;
  Ransac<Location> engine(options);
  engine.Run(model, &a);
  engine.Run(model, &b);  // The engine keeps no memory of the first run.
  EXPECT_EQ(a.model, b.model);
  EXPECT_EQ(a.score, b.score);
  EXPECT_EQ(a.num_iterations, b.num_iterations);
  EXPECT_EQ(a.inlier_mask, b.inlier_mask);
}

TEST(RansacOptions, NamesTheBadField) {
  struct Case {
    const char* field;
    void (*spoil)(RansacOptions*);
  };
  const Case cases[] = {
      {"threshold", [](RansacOptions* o) { o->threshold = 0.0; }},
      {"threshold", [](RansacOptions* o) { o->threshold = std::nan(""); }},
      {"confidence", [](RansacOptions* o) { o->confidence = 1.0; }},
      {"confidence", [](RansacOptions* o) { o->confidence = 0.0; }},
      {"min_iterations", [](RansacOptions* o) { o->min_iterations = -1; }},
      {"max_iterations", [](RansacOptions* o) { o->max_iterations = 0; }},
      {"local_start", [](RansacOptions* o) { o->local_start = -1; }},
      {"local_samples", [](RansacOptions* o) { o->local_samples = -1; }},
      {"local_steps", [](RansacOptions* o) { o->local_steps = -1; }},
  };
  EXPECT_TRUE(RansacOptions().Validate().ok());
  for (const Case& c : cases) {
    RobustFitOptions options;
    c.spoil(&options.ransac);
    const Status status = options.Validate();
    EXPECT_EQ(status.code, StatusCode::kInvalidArgument) << c.field;
    EXPECT_CONTAINS(status.message, c.field);
  }
  RobustFitOptions options;
  options.sigma_px = 0.0;
  EXPECT_CONTAINS(options.Validate().message, "sigma_px");
}

}  // namespace
}  // namespace circline
