#include "circline/ransac/detection/structure/choose_plane.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/ransac/detection/structure/pencil_fitter.h"
#include "tests/ransac/detection/detected_line_scene.h"
#include "tests/ransac/detection/detection_test_util.h"

namespace circline {
namespace {

using detection_test::AxisDeg;
using detection_test::MakeLine;
using Eigen::Vector2d;
using Eigen::Vector3d;

const Vector3d kRow = Vector3d(0.95, 0.1, 0.3).normalized();
const Vector3d kColumn = Vector3d(-0.1, 0.97, 0.2).normalized();

// A board of 5 x 5 sides each way in the middle of the photo, each turned by noise of `bend`
// radians; then rows and columns of something else, far from it, half a degree off.
struct Scene {
  std::vector<DetectedLine> lines;
  std::array<DetectedPencil, 2> pair;
  int num_board = 0;
};

void Add(double u, double v, const Vector3d& direction, double length, double turn, Random* random,
         std::vector<DetectedLine>* lines) {
  lines->push_back(
      MakeLine(detection_test::TestCamera(), u, v, direction, length, turn, 0.1, random));
}

// What a search would find: all lines, none of them better known than another.
DetectedPencil Found(const std::vector<DetectedLine>& lines, const Vector3d& direction) {
  DetectedPencil pencil;
  pencil.observation.fit = VanishingPointFit();
  pencil.observation.fit->direction = direction;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (std::abs(lines[i].fit.line.dot(direction)) > 0.03) continue;
    pencil.members.push_back(static_cast<int>(i));
    pencil.ends.push_back(lines[i].ends);
    pencil.support_px += lines[i].length_px;
  }
  return pencil;
}

Scene MakeScene(double bend, int num_board_rows, int num_others) {
  Scene scene;
  Random random(7);
  for (int i = 0; i < num_board_rows; ++i) {
    for (int j = 0; j < 5; ++j) {
      const double u = 160.0 + 30.0 * j, v = 120.0 + 30.0 * i;
      Add(u, v, kRow, 28.0, bend * random.Normal(), &random, &scene.lines);
      Add(u - 14.0, v + 14.0, kColumn, 28.0, bend * random.Normal(), &random, &scene.lines);
    }
  }
  scene.num_board = static_cast<int>(scene.lines.size());
  for (int k = 0; k < num_others; ++k) {
    Add(420.0, 20.0 + 30.0 * k, kRow, 60.0, 0.01, &random, &scene.lines);
    Add(40.0, 20.0 + 70.0 * k, kColumn, 60.0, 0.01, &random, &scene.lines);
  }
  scene.pair = {Found(scene.lines, kRow), Found(scene.lines, kColumn)};
  return scene;
}

TEST(LocalPencils, TakeTheLinesOfTheBoardAndNoOthers) {
  for (const double bend : {0.001, 0.012}) {
    Scene scene = MakeScene(bend, 5, 4);
    ASSERT_TRUE(RefitWhereTheyMeet(scene.lines, &scene.pair)) << bend;
    std::set<int> members;
    for (const DetectedPencil& pencil : scene.pair) {
      members.insert(pencil.members.begin(), pencil.members.end());
    }
    EXPECT_LT(*members.rbegin(), scene.num_board) << bend;
    EXPECT_GE(members.size(), 0.8 * scene.num_board) << bend;
    const double sigma = std::sqrt(scene.pair[0].observation.fit->covariance.trace()) / kDegree;
    EXPECT_LT(AxisDeg(scene.pair[0].observation.fit->direction, kRow), 3.0 * sigma) << bend;
    EXPECT_LT(sigma, 3.0) << bend;
  }
}

TEST(LocalPencils, LeaveDirectionsOfTheWholePhotoAlone) {
  // Little of either pencil is where they meet; or most of it, as of a street one side's fronts.
  for (const auto& [num_rows, num_others] : {std::pair{1, 5}, std::pair{5, 7}}) {
    Scene scene = MakeScene(0.001, num_rows, num_others);
    const std::vector<int> before = scene.pair[0].members;
    EXPECT_FALSE(RefitWhereTheyMeet(scene.lines, &scene.pair)) << num_rows;
    EXPECT_EQ(scene.pair[0].members, before) << num_rows;
  }
  Scene scene = MakeScene(0.001, 5, 4);
  EXPECT_FALSE(RefitWhereTheyMeet({}, &scene.pair));
}

// A dozen lines along each of two directions, which meet. They span a plane whose horizon is the
// photo's middle row; `rows`: how far the lines are below it, pixels, or above where `is_both`.
std::vector<PlacedPencil> AlongALevelPlane(const std::array<double, 2>& rows, bool is_both,
                                           std::vector<DetectedLine>* lines) {
  const Camera camera = detection_test::TestCamera();
  const std::array<Vector3d, 2> directions = {Vector3d(1.0, 0.0, 0.4).normalized(),
                                              Vector3d(-1.0, 0.0, 0.8).normalized()};
  Random random(5);
  for (const Vector3d& direction : directions) {
    for (int k = 0; k < 12; ++k) {
      const double u = random.Uniform(60.0, 420.0), below = random.Uniform(rows[0], rows[1]);
      const double side = is_both && k % 2 == 0 ? -1.0 : 1.0;
      lines->push_back(
          MakeLine(camera, u, camera.cy + side * below, direction, 60.0, 0.0, 0.1, &random));
    }
  }
  std::vector<PlacedPencil> pencils;
  std::vector<int> all(lines->size());
  std::iota(all.begin(), all.end(), 0);
  for (const Vector3d& direction : directions) {
    DetectedPencil pencil = Found(*lines, direction);
    EXPECT_TRUE(RefitPencil(LineSet(*lines, kUsualDiagonalPx), all, &pencil));
    pencils.emplace_back(std::move(pencil));
  }
  return pencils;
}

// What runs on both sides of the horizon of a plane is of two that face each other, floor and
// ceiling, or of none where all of it is next to the horizon.
TEST(ChoosePlane, NoPlaneIsSeenFromBothSides) {
  const auto is_plane = [](const std::array<double, 2>& rows, bool is_both) {
    std::vector<DetectedLine> lines;
    auto pencils = AlongALevelPlane(rows, is_both, &lines);
    return ChoosePlane(AssemblyOptions(), lines, {}, Plane(), &pencils).pencils[0] >= 0;
  };
  EXPECT_TRUE(is_plane({10.0, 70.0}, false));
  EXPECT_TRUE(is_plane({90.0, 150.0}, true));
  EXPECT_FALSE(is_plane({10.0, 70.0}, true));
}

}  // namespace
}  // namespace circline
