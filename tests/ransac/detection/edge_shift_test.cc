#include "circline/ransac/detection/lines/edge_shift.h"

#include <gtest/gtest.h>

#include <cmath>

#include "circline/estimators/basics.h"
#include "tests/ransac/detection/detection_test_util.h"

namespace circline {
namespace {

using Eigen::Vector2d;

constexpr double kTurn = 0.2;     // Radians, of the rows against the image's.
constexpr double kSquare = 32.0;  // Pixels.

// A field of 6 x 4 squares, the dark ones smaller by `shift` pixels on every side.
cv::Mat ShiftedBoard(double shift) {
  const auto is_dark = [shift](double x, double y) {
    for (int i = -3; i < 3; ++i) {
      for (int j = -2; j < 2; ++j) {
        if ((i + j) % 2 != 0) continue;
        const double dx = std::abs(x - (i + 0.5) * kSquare);
        const double dy = std::abs(y - (j + 0.5) * kSquare);
        if (std::max(dx, dy) < 0.5 * kSquare - shift) return true;
      }
    }
    return false;
  };
  const cv::Mat image = detection_test::Render(480, 360, [&is_dark](double u, double v) {
    const double x = (u - 240.0) * std::cos(kTurn) + (v - 180.0) * std::sin(kTurn);
    const double y = (v - 180.0) * std::cos(kTurn) - (u - 240.0) * std::sin(kTurn);
    return is_dark(x, y) ? 40.0 : 200.0;
  });
  return detection_test::Develop(image, 0.8, 1.0);
}

struct FoundLines {
  EdgeMap edges;
  std::vector<DetectedLine> lines;
};

FoundLines DetectIn(const cv::Mat& photo) {
  FoundLines result;
  result.edges = DetectEdges(photo);
  result.lines = DetectLines(result.edges, detection_test::TestCamera(), 20.0);
  return result;
}

// Largest angle of a line joined of two sides or more against the rows or columns, radians.
double WorstTurn(const std::vector<DetectedLine>& lines) {
  double worst = 0.0;
  for (const DetectedLine& line : lines) {
    if (line.length_px < 1.5 * kSquare) continue;
    const double angle = std::atan2(-line.fit.line.x(), line.fit.line.y());
    worst = std::max(worst, std::abs(std::remainder(angle - kTurn, 0.5 * kPi)));
  }
  return worst;
}

TEST(EdgeShift, IsMeasuredOnLinesOfBothKindsOfEdges) {
  const Camera camera = detection_test::TestCamera();
  for (const double shift : {-0.3, -0.15, 0.15, 0.3}) {
    FoundLines found = DetectIn(ShiftedBoard(shift));
    EXPECT_NEAR(UndoEdgeShift(found.edges, camera, &found.lines), -shift, 0.05) << shift;
  }
}

TEST(EdgeShift, UndoneItLeavesLinesStraight) {
  const Camera camera = detection_test::TestCamera();
  FoundLines found = DetectIn(ShiftedBoard(0.3));
  const double before = WorstTurn(found.lines);
  UndoEdgeShift(found.edges, camera, &found.lines);
  EXPECT_GT(before, 0.01);
  EXPECT_LT(WorstTurn(found.lines), 0.2 * before);
}

TEST(EdgeShift, NoneWhereThereIsNone) {
  const Camera camera = detection_test::TestCamera();
  FoundLines found = DetectIn(ShiftedBoard(0.0));
  ASSERT_GE(found.lines.size(), 10u);
  std::vector<DetectedLine> few(found.lines.begin(), found.lines.begin() + 2), none;
  EXPECT_NEAR(UndoEdgeShift(found.edges, camera, &found.lines), 0.0, 0.03);
  EXPECT_EQ(UndoEdgeShift(found.edges, camera, &few), 0.0);
  EXPECT_EQ(UndoEdgeShift(found.edges, camera, &none), 0.0);
}

}  // namespace
}  // namespace circline
