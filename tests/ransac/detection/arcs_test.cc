#include "circline/ransac/detection/ellipses/arcs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "circline/estimators/basics.h"
#include "tests/ransac/detection/detection_test_util.h"

namespace circline {
namespace {

using detection_test::Develop;
using detection_test::PixelPattern;
using detection_test::Render;

EdgeMap Edges(const PixelPattern& pattern) {
  const EdgeMap map = DetectEdges(Develop(Render(200, 200, pattern)));
  return map;
}

double Disc(double u, double v, double x, double y, double r, double inside) {
  return std::hypot(u - x, v - y) < r ? inside : 110.0;
}

TEST(FindArcs, ADiscIsOneArcThatTurnsOnceAround) {
  for (const double inside : {30.0, 200.0}) {
    const EdgeMap map =
        Edges([=](double u, double v) { return Disc(u, v, 100.2, 99.6, 60.0, inside); });
    const std::vector<Arc> arcs = FindArcs(map);
    ASSERT_EQ(arcs.size(), 1U);
    EXPECT_EQ(arcs[0].bright_inside, inside > 110.0);
    EXPECT_NEAR(arcs[0].turn, 2.0 * kPi, 0.6);  // Less the chord across its ends.
  }
}

TEST(FindArcs, TheSidesOfASquareAreNone) {
  const EdgeMap map = Edges([](double u, double v) {
    const double x = 0.94 * (u - 100.0) + 0.34 * (v - 100.0);
    const double y = -0.34 * (u - 100.0) + 0.94 * (v - 100.0);
    return std::max(std::abs(x), std::abs(y)) < 50.0 ? 30.0 : 180.0;
  });
  int long_ones = 0;
  for (const Arc& arc : FindArcs(map)) long_ones += arc.size() > 30 ? 1 : 0;
  EXPECT_LE(long_ones, 1);  // The chain itself may start within a corner, which is then no cut.
}

TEST(FindArcs, AnInflexionEndsAnArc) {
  // The edge follows a sine: arcs bend to either side in turn.
  const EdgeMap map = Edges([](double u, double v) {
    return v > 100.0 + 25.0 * std::sin(2.0 * kPi * u / 100.0) ? 180.0 : 60.0;
  });
  const std::vector<Arc> arcs = FindArcs(map);
  ASSERT_GE(arcs.size(), 3U);
  int bright = 0, dark = 0;
  for (const Arc& arc : arcs) (arc.bright_inside ? bright : dark) += 1;
  EXPECT_GE(bright, 1);
  EXPECT_GE(dark, 1);
}

TEST(SplitArc, CutsAtTheCorner) {
  // A half disc: its arc and chord meet in two corners.
  const EdgeMap map = Edges(
      [](double u, double v) { return v < 100.0 ? Disc(u, v, 100.0, 100.0, 60.0, 30.0) : 110.0; });
  ASSERT_EQ(map.chains.size(), 1U);
  Arc all;
  all.begin = map.chains[0].begin;
  all.end = map.chains[0].end;
  all.turn = 2.0 * kPi;
  all.bright_inside = false;
  const std::vector<Arc> parts = SplitArc(map, all);
  ASSERT_FALSE(parts.empty());
  // No part spans the corner of the cut: each corner lies at (40 or 160, 100).
  int corners_inside = 0;
  for (const Arc& part : parts) {
    for (int i = part.begin + 5; i + 5 < part.end; ++i) {
      const EdgePoint& p = map.points[static_cast<std::size_t>(i)];
      const double d =
          std::min(std::hypot(p.x - 40.0, p.y - 100.0), std::hypot(p.x - 160.0, p.y - 100.0));
      if (d < 2.0) {
        ++corners_inside;
        i += 10;
      }
    }
  }
  EXPECT_LE(corners_inside, 1);  // One of the two was cut.
}

// The part of an arc from one share of its points to another.
Arc Part(const EdgeMap& map, const Arc& arc, double from, double to) {
  const auto at = [&map](int i) { return map.points[static_cast<std::size_t>(i)].Position(); };
  Arc part = arc;
  part.begin = arc.begin + static_cast<int>(from * arc.size());
  part.end = arc.begin + static_cast<int>(to * arc.size());
  part.turn = (to - from) * arc.turn;
  const int middle = (part.begin + part.end) / 2;
  part.first = at(part.begin);
  part.middle = at(middle);
  part.last = at(part.end - 1);
  part.first_tangent = (at(part.begin + 4) - part.first).normalized();
  part.last_tangent = (part.last - at(part.end - 5)).normalized();
  return part;
}

TEST(CanShareEllipse, AcceptsPartsOfOneAndRejectsStrangers) {
  const EdgeMap map = Edges([](double u, double v) {
    return std::min(Disc(u, v, 70.0, 100.0, 55.0, 30.0), Disc(u, v, 165.0, 60.0, 25.0, 30.0));
  });
  std::vector<Arc> arcs = FindArcs(map);
  ASSERT_EQ(arcs.size(), 2U);
  if (arcs[0].size() < arcs[1].size()) std::swap(arcs[0], arcs[1]);
  const Arc a = Part(map, arcs[0], 0.05, 0.3), b = Part(map, arcs[0], 0.5, 0.8);
  EXPECT_TRUE(CanShareEllipse(a, b));
  EXPECT_TRUE(CanShareEllipse(b, a));
  for (const double from : {0.05, 0.3, 0.55}) {
    EXPECT_FALSE(CanShareEllipse(a, Part(map, arcs[1], from, from + 0.3))) << from;
  }
  Arc flipped = b;
  flipped.bright_inside = !flipped.bright_inside;
  EXPECT_FALSE(CanShareEllipse(a, flipped));
}

}  // namespace
}  // namespace circline
