#include "circline/ransac/detection/edges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "circline/estimators/basics.h"
#include "tests/ransac/detection/detection_test_util.h"

namespace circline {
namespace {

using detection_test::Develop;
using detection_test::Noise;
using detection_test::Render;

// 60 | 180 across a line through (40.3, 31.7) whose normal, to the brighter side, is at `angle`.
cv::Mat StepEdge(double angle, double noise = 0.0, std::uint64_t seed = 1) {
  const double c = std::cos(angle), s = std::sin(angle);
  return Develop(Render(81, 65,
                        [=](double u, double v) {
                          return c * (u - 40.3) + s * (v - 31.7) > 0.0 ? 180.0 : 60.0;
                        }),
                 0.7, noise, seed);
}

// Signed distances to that line of all points away from the border, where the blur reflects.
std::vector<double> StepErrors(const EdgeMap& map, double angle) {
  std::vector<double> errors;
  for (const EdgePoint& p : map.points) {
    if (p.x < 6 || p.y < 6 || p.x > 74 || p.y > 58) continue;
    errors.push_back(std::cos(angle) * (static_cast<double>(p.x) - 40.3) +
                     std::sin(angle) * (static_cast<double>(p.y) - 31.7));
  }
  return errors;
}

double Rms(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

TEST(DetectEdges, LocatesAStraightStepInAnyDirection) {
  for (int k = 0; k < 24; ++k) {
    const double angle = 2.0 * kPi * k / 24 + 0.03;
    const EdgeMap map = DetectEdges(StepEdge(angle));
    ASSERT_EQ(map.chains.size(), 1U) << k;
    const std::vector<double> errors = StepErrors(map, angle);
    ASSERT_GT(errors.size(), 45U);
    EXPECT_LT(Rms(errors), 0.03) << "angle " << angle;
    for (const EdgePoint& p : map.points) {
      if (p.x < 6 || p.y < 6 || p.x > 74 || p.y > 58) continue;
      const double off = std::remainder(std::atan2(p.ny, p.nx) - angle, 2.0 * kPi);
      EXPECT_LT(std::abs(off), 0.05);  // The rendering's own stairs turn it by 0.04.
      // Pixel (0.29), blur 0.7 and smoothing 1.0, in squares.
      EXPECT_NEAR(p.blur_px, std::sqrt(0.083 + 0.49 + 1.0), 0.1);
    }
  }
}

TEST(DetectEdges, WalksWithTheBrighterSideOnTheLeft) {
  const EdgeMap map = DetectEdges(StepEdge(0.0));  // Brighter on the right:
  ASSERT_EQ(map.chains.size(), 1U);                // the walk goes down.
  const EdgeChain& chain = map.chains[0];
  for (int i = chain.begin + 1; i < chain.end; ++i) {
    const float step =
        map.points[static_cast<std::size_t>(i)].y - map.points[static_cast<std::size_t>(i - 1)].y;
    EXPECT_GT(step, 0.0f);
    EXPECT_LT(step, 1.6f);
  }
}

TEST(DetectEdges, ClosesTheContourOfADiscAndIndexesIt) {
  const cv::Mat image = Develop(Render(80, 80, [](double u, double v) {
    return std::hypot(u - 39.6, v - 40.2) < 25.0 ? 200.0 : 50.0;
  }));
  const EdgeMap map = DetectEdges(image);
  ASSERT_EQ(map.chains.size(), 1U);
  EXPECT_NEAR(map.chains[0].size(), 2.0 * kPi * 25.0, 30.0);
  double mean = 0.0;
  for (std::size_t i = 0; i < map.points.size(); ++i) {
    const EdgePoint& p = map.points[i];
    const double r = std::hypot(static_cast<double>(p.x) - 39.6, static_cast<double>(p.y) - 40.2);
    EXPECT_NEAR(r, 25.0, 0.12);
    mean += r / static_cast<double>(map.points.size());
    const int x = static_cast<int>(std::lround(p.x)), y = static_cast<int>(std::lround(p.y));
    int found = 0;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) found += map.PointAt(x + dx, y + dy) == static_cast<int>(i);
    }
    EXPECT_EQ(found, 1);
  }
  EXPECT_NEAR(mean, 25.0, 0.06);  // See CurvatureBias.
  EXPECT_EQ(map.PointAt(-1, 0), -1);
  EXPECT_EQ(map.PointAt(0, 80), -1);
}

// Mean distance of edge points to the rim of a disc, over discs at many sub-pixel positions, by the
// direction of the gradient: near the axes of the image, between, near the diagonals.
struct RimErrors {
  std::array<double, 3> found{}, corrected{}, count{};
};

RimErrors MeasureRim(double radius, double blur) {
  RimErrors errors;
  for (int k = 0; k < 25; ++k) {
    const double u0 = 34.0 + std::fmod(0.137 * k, 1.0), v0 = 33.0 + std::fmod(0.713 * k, 1.0);
    const cv::Mat image = Develop(
        Render(
            70, 70,
            [=](double u, double v) { return std::hypot(u - u0, v - v0) < radius ? 40.0 : 200.0; }),
        blur);
    const EdgeMap map = DetectEdges(image);
    for (const EdgePoint& p : map.points) {
      const double dx = static_cast<double>(p.x) - u0, dy = static_cast<double>(p.y) - v0;
      const double off = std::hypot(dx, dy) - radius;
      const double from_axis =
          std::asin(static_cast<double>(std::min(std::abs(p.nx), std::abs(p.ny))));
      const auto bin = static_cast<std::size_t>(std::min(2.0, from_axis / (kPi / 12.0)));
      errors.found[bin] += off;
      errors.corrected[bin] += off + CurvatureBias(p, static_cast<double>(p.blur_px), 1.0 / radius);
      errors.count[bin] += 1.0;
    }
  }
  return errors;
}

TEST(CurvatureBias, IsWhatTheEdgesOfDiscsAreOffBy) {
  for (const double blur : {0.6, 1.2}) {
    for (const double radius : {6.0, 10.0, 20.0}) {
      const RimErrors errors = MeasureRim(radius, blur);
      for (std::size_t bin = 0; bin < 3; ++bin) {
        const double found = errors.found[bin] / errors.count[bin];
        const double corrected = errors.corrected[bin] / errors.count[bin];
        // Smoothing 1, blur, and the pixel's own 0.29.
        EXPECT_LT(found, -0.45 * (1.08 + blur * blur) / radius) << radius << " " << blur;
        EXPECT_LT(std::abs(corrected), 0.08 * std::abs(found))
            << radius << " " << blur << " " << bin;
      }
    }
  }
}

TEST(DetectEdges, StatesTheNoiseAndWhatItDoesToLocations) {
  constexpr double kNoise = 6.0;
  double predicted = 0.0, actual = 0.0, count = 0.0;
  for (int k = 0; k < 12; ++k) {
    const double angle = 0.26 + 2.0 * kPi * k / 12;
    const cv::Mat image = StepEdge(angle, kNoise, static_cast<std::uint64_t>(k + 1));
    const EdgeMap map = DetectEdges(image);
    // White noise through the derivative of a Gaussian of 1 px.
    EXPECT_NEAR(map.gradient_noise, kNoise / std::sqrt(8.0 * kPi), 0.15 * kNoise / 5.0);
    for (const EdgePoint& p : map.points) {
      const double d = std::cos(angle) * (static_cast<double>(p.x) - 40.3) +
                       std::sin(angle) * (static_cast<double>(p.y) - 31.7);
      if (std::abs(d) > 2.0 || p.x < 6 || p.y < 6 || p.x > 74 || p.y > 58) continue;
      actual += d * d;
      predicted += static_cast<double>(p.sigma_px * p.sigma_px);
      count += 1.0;
    }
  }
  EXPECT_GT(count, 500.0);
  const double ratio = std::sqrt(actual / predicted);
  EXPECT_NEAR(ratio, 1.0, 0.15);
}

TEST(DetectEdges, FindsNothingOnABlankImageAndLittleInNoise) {
  EdgeMap map = DetectEdges(cv::Mat(50, 60, CV_8UC1, cv::Scalar(90)));
  EXPECT_TRUE(map.points.empty());
  EXPECT_TRUE(map.chains.empty());
  map = DetectEdges(Noise(200, 200, 8.0));
  EXPECT_LT(map.points.size(), 200U);
}

TEST(DetectEdges, TakesTheSmallestImages) {
  for (const cv::Size size : {cv::Size(1, 1), cv::Size(2, 5), cv::Size(3, 3), cv::Size(200, 1)}) {
    const EdgeMap map = DetectEdges(cv::Mat(size, CV_8UC1, cv::Scalar(0)));
    EXPECT_TRUE(map.points.empty());
  }
}

// Whatever the photo: every pixel of the index leads to a point near it and back, every point is in
// one chain, and the points of a chain follow each other.
void ExpectWholeMap(const EdgeMap& map) {
  std::vector<int> found(map.points.size(), 0);
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const int i = map.PointAt(x, y);
      if (i < 0) continue;
      ASSERT_LT(i, static_cast<int>(map.points.size()));
      const EdgePoint& p = map.points[static_cast<std::size_t>(i)];
      EXPECT_NEAR(p.x, x, 0.501);
      EXPECT_NEAR(p.y, y, 0.501);
      ++found[static_cast<std::size_t>(i)];
    }
  }
  EXPECT_EQ(std::count(found.begin(), found.end(), 1), static_cast<std::ptrdiff_t>(found.size()));
  int end = 0;
  for (const EdgeChain& chain : map.chains) {
    EXPECT_EQ(chain.begin, end);
    end = chain.end;
    for (int i = chain.begin + 1; i < chain.end; ++i) {
      const EdgePoint& a = map.points[static_cast<std::size_t>(i - 1)];
      const EdgePoint& b = map.points[static_cast<std::size_t>(i)];
      EXPECT_LT((a.Position() - b.Position()).norm(), 5.0);
      EXPECT_GT(a.Normal().dot(b.Normal()), 0.6);
    }
  }
  EXPECT_EQ(end, static_cast<int>(map.points.size()));
}

TEST(DetectEdges, MapsAreWholeUpToTheBorder) {
  std::size_t points = 0;
  for (int size = 3; size < 40; ++size) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const EdgeMap map = DetectEdges(Noise(size, 43 - size, 60.0, seed), 0.5);
      ExpectWholeMap(map);
      points += map.points.size();
    }
  }
  EXPECT_GT(points, 1000U);
}

// Rectangles that tile the photo give what the whole photo gives, point by point.
TEST(DetectEdges, WithinRectanglesPointsAreTheSame) {
  const cv::Mat image = StepEdge(0.4, 3.0);
  const EdgeMap whole = DetectEdges(image);
  std::vector<cv::Rect> tiles;
  for (int y = 0; y < image.rows; y += 20) {
    for (int x = 0; x < image.cols; x += 27)
      tiles.push_back(cv::Rect(x, y, 27, 20) & cv::Rect({}, image.size()));
  }
  const EdgeMap tiled = DetectEdges(image, kEdgeSmoothingPx, &tiles);
  ASSERT_GT(whole.points.size(), 60U);
  EXPECT_EQ(tiled.points.size(), whole.points.size());
  const std::vector<cv::Rect> one = {cv::Rect(30, 0, 25, 65)};
  const EdgeMap part = DetectEdges(image, kEdgeSmoothingPx, &one);
  EXPECT_GT(part.points.size(), 0U);
  for (const EdgeMap* map : {&tiled, &part}) {
    for (const EdgePoint& p : map->points) {
      const int i =
          whole.PointAt(static_cast<int>(std::lround(p.x)), static_cast<int>(std::lround(p.y)));
      ASSERT_GE(i, 0);
      const EdgePoint& same = whole.points[static_cast<std::size_t>(i)];
      EXPECT_EQ(p.x, same.x);
      EXPECT_EQ(p.y, same.y);
      EXPECT_EQ(p.sigma_px, same.sigma_px);
    }
  }
  for (const EdgePoint& p : part.points) EXPECT_TRUE(p.x > 28.5f && p.x < 55.5f);
}

TEST(ToGray, TakesOneThreeAndFourChannels) {
  cv::Mat gray;
  EXPECT_TRUE(ToGray(cv::Mat(4, 5, CV_8UC1, cv::Scalar(7)), &gray).ok());
  EXPECT_EQ(gray.at<std::uint8_t>(2, 2), 7);
  EXPECT_TRUE(ToGray(cv::Mat(4, 5, CV_8UC3, cv::Scalar(9, 9, 9)), &gray).ok());
  EXPECT_EQ(gray.at<std::uint8_t>(2, 2), 9);
  EXPECT_TRUE(ToGray(cv::Mat(4, 5, CV_8UC4, cv::Scalar(9, 9, 9, 0)), &gray).ok());
  EXPECT_EQ(gray.type(), CV_8UC1);
  EXPECT_FALSE(ToGray(cv::Mat(), &gray).ok());
  EXPECT_FALSE(ToGray(cv::Mat(4, 5, CV_8UC2), &gray).ok());
  EXPECT_FALSE(ToGray(cv::Mat(4, 5, CV_16UC1), &gray).ok());
}

}  // namespace
}  // namespace circline
