#include "circline/ransac/robust_pencils.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "apps/benchmark/robust_fit_scenes.h"
#include "circline/estimators/random.h"
#include "tests/basics.h"
#include "tests/ransac/segment_scene.h"

namespace circline {
namespace {

using segment_scene::AddSegment;
using segment_scene::AngleBetween;
using segment_scene::DriftedLines;
using segment_scene::Lines;
using segment_scene::RandomRotation;
using segment_scene::StrayLines;

TEST(FindPencils, ThreeDirectionsAmongFiftyPercentClutter) {
  constexpr int kTrials = 40;
  double squared_error = 0.0, bound = 0.0;
  for (std::uint64_t trial = 0; trial < kTrials; ++trial) {
    const apps::PencilScene scene = apps::MakePencilScene(30, 0.5, trial);
    const Eigen::Matrix3d& R = scene.rotation;
    const std::vector<LineFit>& lines = scene.lines;
    ASSERT_EQ(lines.size(), 180u);
    PencilOptions options;
    options.model_sigma_rad = 0.0;
    std::vector<FoundPencil> pencils;
    ASSERT_TRUE(FindPencils(lines, options, &pencils).ok());
    ASSERT_EQ(pencils.size(), 3u) << trial;
    std::set<int> found, used;
    for (const FoundPencil& pencil : pencils) {
      int k = 0;
      for (int j = 1; j < 3; ++j) {
        if (AngleBetween(R.col(j), pencil.fit.direction) <
            AngleBetween(R.col(k), pencil.fit.direction)) {
          k = j;
        }
      }
      found.insert(k);
      const double error = AngleBetween(R.col(k), pencil.fit.direction);
      EXPECT_LT(error, 0.05) << trial;
      squared_error += error * error;
      VanishingPointFit oracle;
      const std::vector<LineFit> own(lines.begin() + 30 * k, lines.begin() + 30 * (k + 1));
      ASSERT_TRUE(FitVanishingPoint(own, &oracle).ok());
      bound += oracle.covariance.trace();
      EXPECT_GE(pencil.lines.size(), 20u);
      EXPECT_TRUE(std::is_sorted(pencil.lines.begin(), pencil.lines.end()));
      for (const int i : pencil.lines) EXPECT_TRUE(used.insert(i).second);  // No line twice.
    }
    EXPECT_EQ(found.size(), 3u) << trial;
  }
  EXPECT_LT(std::sqrt(squared_error / bound), 1.25);
}

TEST(FindPencils, ClutterAloneHoldsNone) {
  int found = 0;
  for (std::uint64_t trial = 0; trial < 20; ++trial) {
    Random random(500 + trial);
    std::vector<FoundPencil> pencils;
    ASSERT_TRUE(FindPencils(StrayLines(60, &random), PencilOptions(), &pencils).ok());
    found += static_cast<int>(pencils.size());
  }
  EXPECT_LE(found, 1);
}

// Lines that drift off three hundred are expected, however alike they are; another direction is
// found beside them.
TEST(FindPencils, LinesThatDriftAreNoPencil) {
  int drifted = 0, both = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const Eigen::Matrix3d R = RandomRotation(&random);
    std::vector<LineFit> lines = Lines(R.col(0), 300, 3, &random);
    for (const LineFit& line : DriftedLines(R.col(0), 7, &random)) lines.push_back(line);
    std::vector<FoundPencil> pencils;
    ASSERT_TRUE(FindPencils(lines, PencilOptions(), &pencils).ok());
    ASSERT_GE(pencils.size(), 1U);
    EXPECT_LT(AngleBetween(pencils[0].fit.direction, R.col(0)), 0.02);
    drifted += pencils.size() > 1 ? 1 : 0;
    const Eigen::Vector3d across = R.col(1);
    for (int i = 0; i < 60; ++i) AddSegment(&across, &random, &lines);
    ASSERT_TRUE(FindPencils(lines, PencilOptions(), &pencils).ok());
    both += pencils.size() == 2 && AngleBetween(pencils[1].fit.direction, across) < 0.05 ? 1 : 0;
  }
  EXPECT_EQ(drifted, 0);
  EXPECT_GE(both, 19);
}

TEST(FindPencils, KeepsToItsStoppingRule) {
  Random random(7);
  const Eigen::Matrix3d R = RandomRotation(&random);
  std::vector<LineFit> lines;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d direction = R.col(k);
    for (int i = 0; i < (k == 0 ? 8 : 20); ++i) AddSegment(&direction, &random, &lines);
  }
  PencilOptions options;
  std::vector<FoundPencil> pencils;
  options.max_pencils = 2;
  ASSERT_TRUE(FindPencils(lines, options, &pencils).ok());
  EXPECT_EQ(pencils.size(), 2u);
  options.max_pencils = 0;
  ASSERT_TRUE(FindPencils(lines, options, &pencils).ok());
  EXPECT_TRUE(pencils.empty());
  options.max_pencils = 10;
  options.min_lines = 15;
  ASSERT_TRUE(FindPencils(lines, options, &pencils).ok());
  EXPECT_EQ(pencils.size(), 2u);
  for (const FoundPencil& pencil : pencils) EXPECT_GE(pencil.lines.size(), 15u);
}

TEST(FindPencils, SameSeedSameBits) {
  Random random(7);
  const std::vector<LineFit> lines = Lines(RandomRotation(&random).col(0), 20, 20, &random);
  std::vector<FoundPencil> a, b;
  ASSERT_TRUE(FindPencils(lines, PencilOptions(), &a).ok());
  ASSERT_TRUE(FindPencils(lines, PencilOptions(), &b).ok());
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].fit.direction, b[i].fit.direction);
    EXPECT_EQ(a[i].lines, b[i].lines);
  }
}

TEST(FindPencils, FewOrBadLinesAreNoPencil) {
  std::vector<FoundPencil> pencils(2);
  ASSERT_TRUE(FindPencils({}, PencilOptions(), &pencils).ok());
  EXPECT_TRUE(pencils.empty());
  std::vector<LineFit> bad(5);  // Zero normals.
  bad[0].line.setConstant(std::nan(""));
  ASSERT_TRUE(FindPencils(bad, PencilOptions(), &pencils).ok());
  EXPECT_TRUE(pencils.empty());
  // One line again and again.
  Random random(7);
  const std::vector<LineFit> same(10, StrayLines(1, &random)[0]);
  ASSERT_TRUE(FindPencils(same, PencilOptions(), &pencils).ok());
  EXPECT_TRUE(pencils.empty());
}

TEST(FindPencils, NamesBadOptions) {
  struct Case {
    const char* field;
    void (*spoil)(PencilOptions*);
  };
  const Case cases[] = {
      {"model_sigma_rad", [](PencilOptions* o) { o->model_sigma_rad = -1.0; }},
      {"max_pencils", [](PencilOptions* o) { o->max_pencils = -1; }},
      {"min_lines", [](PencilOptions* o) { o->min_lines = 2; }},
      {"max_false_alarms", [](PencilOptions* o) { o->max_false_alarms = 0.0; }},
      {"confidence", [](PencilOptions* o) { o->ransac.confidence = 2.0; }},
  };
  for (const Case& c : cases) {
    PencilOptions options;
    c.spoil(&options);
    std::vector<FoundPencil> pencils;
    const Status status = FindPencils({}, options, &pencils);
    EXPECT_EQ(status.code, StatusCode::kInvalidArgument);
    EXPECT_CONTAINS(status.message, c.field);
  }
}

TEST(FitVanishingPointRobust, LeavesStrayLinesOut) {
  Random random(11);
  const Eigen::Vector3d direction = RandomRotation(&random).col(0);
  std::vector<LineFit> lines = Lines(direction, 12, 8, &random);
  lines.emplace_back();  // Never fitted.
  VanishingPointFit fit;
  std::vector<std::uint8_t> mask;
  ASSERT_TRUE(FitVanishingPointRobust(lines, PencilOptions(), &fit, &mask).ok());
  ASSERT_EQ(mask.size(), lines.size());
  EXPECT_LT(AngleBetween(direction, fit.direction), 0.03);
  EXPECT_GE(std::count(mask.begin(), mask.begin() + 12, 1), 11);
  EXPECT_LE(std::count(mask.begin() + 12, mask.end(), 1), 2);
  EXPECT_EQ(mask.back(), 0);
  EXPECT_GT(fit.covariance.trace(), 0.0);
}

TEST(FitVanishingPointRobust, InfinityIsNothingSpecial) {
  const Eigen::Vector3d direction(1.0, 0.0, 0.0);
  Random random(12);
  const std::vector<LineFit> lines = Lines(direction, 12, 0, &random);
  VanishingPointFit fit;
  ASSERT_TRUE(FitVanishingPointRobust(lines, PencilOptions(), &fit).ok());
  EXPECT_LT(AngleBetween(direction, fit.direction), 0.02);
}

TEST(FitVanishingPointRobust, TwoLinesMeet) {
  Random random(13);
  const std::vector<LineFit> lines = Lines(RandomRotation(&random).col(0), 2, 0, &random);
  VanishingPointFit fit;
  std::vector<std::uint8_t> mask;
  ASSERT_TRUE(FitVanishingPointRobust(lines, PencilOptions(), &fit, &mask).ok());
  EXPECT_NEAR(fit.direction.dot(lines[0].line), 0.0, 1e-9);
  EXPECT_NEAR(fit.direction.dot(lines[1].line), 0.0, 1e-9);
  EXPECT_EQ(mask, std::vector<std::uint8_t>(2, 1));
}

TEST(FitVanishingPointRobust, RefusesWhatHasNoDirection) {
  Random random(7);
  std::vector<LineFit> same;
  VanishingPointFit fit;
  EXPECT_EQ(FitVanishingPointRobust(same, PencilOptions(), &fit).code, StatusCode::kRefused);
  same = StrayLines(1, &random);
  EXPECT_EQ(FitVanishingPointRobust(same, PencilOptions(), &fit).code, StatusCode::kRefused);
  same.resize(2, same[0]);
  EXPECT_EQ(FitVanishingPointRobust(same, PencilOptions(), &fit).code, StatusCode::kRefused);
  same.resize(5, same[0]);
  EXPECT_EQ(FitVanishingPointRobust(same, PencilOptions(), &fit).code, StatusCode::kRefused);
}

}  // namespace
}  // namespace circline
