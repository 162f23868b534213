#include "circline/ransac/detection/lines/segment_meetings.h"

#include <gtest/gtest.h>

#include <Eigen/Core>

#include "circline/estimators/random.h"

namespace circline {
namespace {

using Eigen::Vector2d;

Segment Make(double u0, double v0, double u1, double v1) {
  return {Vector2d(u0, v0), Vector2d(u1, v1)};
}

TEST(SegmentMeetings, DistanceIsThatOfTheNearestPoints) {
  const Segment s = Make(0, 0, 100, 0);
  EXPECT_EQ(SegmentDistance(s, Make(50, -10, 50, 10)), 0.0);
  EXPECT_NEAR(SegmentDistance(s, Make(50, 7, 50, 40)), 7.0, 1e-12);
  EXPECT_NEAR(SegmentDistance(s, Make(103, 4, 140, 30)), 5.0, 1e-12);
  EXPECT_NEAR(SegmentDistance(Make(5, 5, 5, 5), s), 5.0, 1e-12);  // A point.
  EXPECT_TRUE(AreNear(s, Make(103, 4, 140, 30)));
  EXPECT_TRUE(AreNear(s, Make(50, 24, 50, 40)));
  EXPECT_FALSE(AreNear(s, Make(50, 26, 50, 40)));
  EXPECT_FALSE(AreNear(s, Make(126, 0, 140, 0)));
}

TEST(SegmentMeetings, CornersMayBeRoundedButEndThere) {
  const Segment s = Make(0, 0, 100, 0);
  EXPECT_TRUE(FormCorner(s, Make(100, 0, 100, 60)));
  EXPECT_TRUE(FormCorner(s, Make(120, 0, 120, 60)));  // 20 of 21 px.
  EXPECT_FALSE(FormCorner(s, Make(122, 0, 122, 60)));
  EXPECT_TRUE(FormCorner(s, Make(100, 8, 100, 28)));  // 8 of 9 px, and short.
  EXPECT_FALSE(FormCorner(s, Make(100, 10, 100, 30)));
  EXPECT_FALSE(FormCorner(s, Make(50, 0, 50, 60)));    // A T junction.
  EXPECT_FALSE(FormCorner(s, Make(100, 0, 200, 10)));  // Nearly parallel.
  EXPECT_FALSE(FormCorner(s, Make(40, 0, 40, 0)));     // A point.
}

TEST(SegmentMeetings, LengthCountsByTheNumberOfMeetings) {
  const std::vector<Segment> across = {Make(40, -50, 40, 50), Make(140, -50, 140, 50),
                                       Make(240, -50, 240, 50), Make(280, -50, 280, 50)};
  EXPECT_NEAR(MeetingLength({Make(0, 0, 300, 0)}, across), 300.0, 1e-9);
  EXPECT_NEAR(MeetingLength({Make(0, 0, 60, 0)}, across), 20.0, 1e-9);
  EXPECT_NEAR(MeetingLength({Make(0, 90, 300, 90)}, across), 0.0, 1e-9);
  EXPECT_EQ(MeetingLength({}, across), 0.0);
}

// Twice the pixels, twice the distances: the same photo.
TEST(SegmentMeetings, WhatMeetsDoesSoAtAnySize) {
  Random random(1);
  const auto point = [&random] {
    return Eigen::Vector2d{random.Uniform(0.0, 120.0), random.Uniform(0.0, 120.0)};
  };
  int near = 0, corners = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Segment s = {point(), point()}, t = {point(), point()};
    const Segment s2 = {2.0 * s[0], 2.0 * s[1]}, t2 = {2.0 * t[0], 2.0 * t[1]};
    EXPECT_EQ(AreNear(s, t, 300.0), AreNear(s2, t2, 600.0));
    EXPECT_EQ(FormCorner(s, t, 300.0), FormCorner(s2, t2, 600.0));
    EXPECT_NEAR(2.0 * MeetingLength({s}, {t}, 300.0), MeetingLength({s2}, {t2}, 600.0), 1e-9);
    near += AreNear(s, t, 300.0) ? 1 : 0;
    corners += FormCorner(s, t, 300.0) ? 1 : 0;
  }
  EXPECT_GT(near, 200);
  EXPECT_LT(near, 1900);
  EXPECT_GT(corners, 20);
}

// Rows and columns, and what touches them by accident.
TEST(SegmentMeetings, TheCoreIsTheGridWithoutWhatTouchesIt) {
  const std::vector<Segment> rows = {Make(0, 0, 100, 0), Make(0, 50, 100, 50),
                                     Make(98, 25, 300, 25),    // Touches the last column.
                                     Make(0, 300, 900, 300)};  // Far off, and longest.
  const std::vector<Segment> columns = {Make(0, 0, 0, 50), Make(100, 0, 100, 50),
                                        Make(250, 25, 250, 90)};
  const std::array<std::vector<int>, 2> core = ConnectedCore(rows, columns);
  EXPECT_EQ(core[0], (std::vector<int>{0, 1}));
  EXPECT_EQ(core[1], (std::vector<int>{0, 1}));
  EXPECT_TRUE(ConnectedCore(rows, {})[0].empty());
}

TEST(ConvexRegion, HoldsWhatIsInsideTheWidenedHull) {
  const std::vector<Vector2d> square = {{0, 0}, {10, 10}, {10, 0}, {5, 5}, {0, 10}, {0, 10}};
  const ConvexRegion region(square, 1.2);
  EXPECT_TRUE(region.Contains(Vector2d(5, 5)));
  EXPECT_TRUE(region.Contains(Vector2d(10.9, -0.9)));
  EXPECT_FALSE(region.Contains(Vector2d(11.1, 5)));
  EXPECT_FALSE(region.Contains(Make(5, 5, 5, 12)));
  EXPECT_FALSE(ConvexRegion({{0, 0}, {1, 1}}, 1.0).Contains(Vector2d(0.5, 0.5)));
  EXPECT_FALSE(ConvexRegion({}, 1.0).Contains(Vector2d(0, 0)));
}

}  // namespace
}  // namespace circline
