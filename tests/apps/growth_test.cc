// How time grows with what is in a photo. CIRCLINE_GROWTH=10000: up to so many features, a table.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "apps/common/scene.h"
#include "circline/ransac/fit_observations.h"
#include "circline/refine/estimate_pose.h"
#include "tests/plane_scene.h"
#include "tests/trials.h"

namespace circline::apps {
namespace {

using Work = std::function<void(int)>;

void FitAndEstimate(Observations observations) {
  ASSERT_TRUE(FitObservations({}, &observations).ok());
  const PoseEstimate estimate = EstimatePose(observations);
  ASSERT_TRUE(estimate.status.ok()) << estimate.status.message;
}

void ManyCircles(int count) {
  PlaneScene scene(0.7, 0.2);
  Observations photo = scene.Empty();
  for (int i = 0; i < count; ++i) {
    const double x = scene.random.Uniform(-2.0, 2.0), y = scene.random.Uniform(-2.0, 2.0);
    photo.circles.push_back(scene.Circle("c" + std::to_string(i), x, y, 0.2, 24));
  }
  FitAndEstimate(photo);
}

// Of one contour, three tenths of them beside it.
void ManyPoints(int count) {
  PlaneScene scene(0.7, 0.2);
  Observations photo = scene.Empty();
  photo.circles = {scene.Circle("c", 0.0, 0.0, 1.0, count)};
  for (int i = 0; i < count; i += 10) {
    for (int k = i; k < std::min(count, i + 3); ++k)
      photo.circles[0].points[static_cast<std::size_t>(k)].x() += scene.random.Uniform(5.0, 60.0);
  }
  FitAndEstimate(photo);
}

void ManyEntries(int count) {
  std::string text =
      "cameras: [{id: \"k\", model: \"pinhole\", width: 640, height: 480, "
      "camera_matrix: [600, 0, 320, 0, 600, 240, 0, 0, 1]}]\nimages:\n";
  for (int i = 0; i < count; ++i) text += "  - {file: \"a.jpg\", camera: \"k\"}\n";
  std::vector<SceneImage> images;
  ASSERT_TRUE(ParseScene("scene", text, "", {}, &images).ok());
  ASSERT_EQ(images.size(), static_cast<std::size_t>(count));
}

// The least of three, seconds of the processor.
double Seconds(const Work& work, int count) {
  double least = HUGE_VAL;
  for (int i = 0; i < 3; ++i) {
    const std::clock_t begin = std::clock();
    work(count);
    least = std::min(least, static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  }
  return least;
}

class Growth : public testing::TestWithParam<std::pair<const char*, void (*)(int)>> {};

TEST_P(Growth, TenTimesTheFeaturesTakeTenTimesTheTime) {
  if (kSanitized) GTEST_SKIP() << "sanitizers have times of their own";
  const auto& [name, work] = GetParam();
  const char* const asked = std::getenv("CIRCLINE_GROWTH");
  const int most = asked != nullptr ? std::atoi(asked) : 1000;
  std::string row = std::string("| ") + name + " |";
  double before = Seconds(work, 100);
  for (int count = 1000; count <= most; count *= 10) {
    row += " " + std::to_string(static_cast<int>(1e3 * before)) + " |";
    const double now = Seconds(work, count);
    // 10 log 1000 / log 100 is 15; twice that for what else the machine does.
    EXPECT_LT(now, 30.0 * std::max(before, 1e-3)) << count;
    before = now;
  }
  std::printf("%s %d |\n", row.c_str(), static_cast<int>(1e3 * before));
}

// Of which each was once compared with each: 20 milliards.
TEST(ContourGrowth, TwoHundredThousandPointsTakeSeconds) {
  if (kSanitized) GTEST_SKIP() << "sanitizers have times of their own";
  const std::clock_t begin = std::clock();
  ManyPoints(200000);
  EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 15.0);
}

INSTANTIATE_TEST_SUITE_P(Features, Growth,
                         testing::Values(std::pair("circles", ManyCircles),
                                         std::pair("points of a contour", ManyPoints),
                                         std::pair("entries of a scene", ManyEntries)));

}  // namespace
}  // namespace circline::apps
