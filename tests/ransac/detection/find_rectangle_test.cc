#include "circline/ransac/detection/structure/find_rectangle.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <opencv2/core.hpp>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/pose.h"
#include "tests/ransac/detection/detected_line_scene.h"
#include "tests/ransac/detection/detection_test_util.h"
#include "tests/ransac/detection/observations_test_util.h"

namespace circline {
namespace {

using detection_test::AxisDeg;
using detection_test::LineThrough;
using detection_test::LookAt;
using detection_test::TestCamera;
using Eigen::Vector2d;
using Eigen::Vector3d;

using Corners = std::array<Vector3d, 4>;  // Of a quadrilateral of the plane Z = 0, in order.

Corners Rectangle(double half_width, double half_height) {
  return {Vector3d(-half_width, -half_height, 0.0), Vector3d(half_width, -half_height, 0.0),
          Vector3d(half_width, half_height, 0.0), Vector3d(-half_width, half_height, 0.0)};
}

// Its sides as detection finds them: they stop a few pixels short of the corners.
void AddSides(const Camera& camera, const CameraPose& pose, const Corners& corners, Random* random,
              std::vector<DetectedLine>* lines) {
  std::array<Vector2d, 4> at;
  for (std::size_t k = 0; k < 4; ++k)
    ASSERT_TRUE(CameraToPixel(camera, pose.rotation * corners[k] + pose.translation, &at[k]));
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector2d along = (at[(k + 1) % 4] - at[k]).normalized();
    const double from = random->Uniform(0.0, 4.0), to = random->Uniform(0.0, 4.0);
    lines->push_back(
        LineThrough(camera, at[k] + from * along, at[(k + 1) % 4] - to * along, 0.15, random));
  }
}

void AddClutter(const Camera& camera, int count, Random* random, std::vector<DetectedLine>* lines) {
  for (int i = 0; i < count; ++i) {
    const double angle = random->Uniform(0.0, kPi);
    const Vector2d middle{random->Uniform(60.0, 420.0), random->Uniform(60.0, 300.0)};
    const Vector2d half = random->Uniform(12.0, 60.0) * Vector2d(std::cos(angle), std::sin(angle));
    lines->push_back(LineThrough(camera, middle - half, middle + half, 0.15, random));
  }
}

CameraPose DrawPose(Random* random) {
  const double about_x = random->Uniform(-55.0, 55.0), about_y = random->Uniform(-40.0, 40.0);
  return LookAt(about_x, about_y, random->Uniform(0.0, 180.0), 10.0);
}

double ErrorDeg(const DetectedPencil& pencil, const Vector3d& axis) {
  return AxisDeg(pencil.observation.fit->direction, axis);
}

double SigmaDeg(const DetectedPencil& pencil) {
  return std::sqrt(pencil.observation.fit->covariance.trace()) / kDegree;
}

TEST(FindRectangle, ASheetAmongOtherLines) {
  constexpr int kTrials = 100;
  const Camera camera = TestCamera();
  int found = 0, right = 0;
  for (std::uint64_t seed = 1; seed <= kTrials; ++seed) {
    Random random(seed);
    const CameraPose pose = DrawPose(&random);
    std::vector<DetectedLine> lines;
    AddSides(camera, pose, Rectangle(1.8, 1.2), &random, &lines);
    AddClutter(camera, 30, &random, &lines);
    const auto pencils = FindRectangle(AssemblyOptions(), lines);
    if (!pencils) continue;
    ++found;
    const bool is_swapped = ErrorDeg((*pencils)[0], pose.rotation.col(0)) >
                            ErrorDeg((*pencils)[0], pose.rotation.col(1));
    bool is_right = true;
    for (int k = 0; k < 2; ++k) {
      const DetectedPencil& pencil = (*pencils)[static_cast<std::size_t>(k)];
      EXPECT_EQ(pencil.members.size(), 2U);
      const Vector3d axis = pose.rotation.col(is_swapped ? 1 - k : k);
      is_right = is_right && ErrorDeg(pencil, axis) < 3.0 * SigmaDeg(pencil);
    }
    right += is_right ? 1 : 0;
  }
  std::printf("sheets found: %d of %d, of these right: %d\n", found, kTrials, right);
  EXPECT_GE(found, 90);
  EXPECT_GE(right, 0.97 * found);
}

TEST(FindRectangle, LinesOfNothingHardlyEverClose) {
  constexpr int kTrials = 300;
  const Camera camera = TestCamera();
  int accidents = 0;
  for (std::uint64_t seed = 1; seed <= kTrials; ++seed) {
    Random random(seed);
    std::vector<DetectedLine> lines;
    AddClutter(camera, 20 + static_cast<int>(seed % 100), &random, &lines);
    accidents += FindRectangle(AssemblyOptions(), lines) ? 1 : 0;
  }
  std::printf("rectangles of lines that lie any way: %d of %d\n", accidents, kTrials);
  EXPECT_LE(accidents, 3);
  EXPECT_FALSE(FindRectangle(AssemblyOptions(), {}));
}

TEST(FindRectangle, ARhombusIsNone) {
  Random random(1);
  std::vector<DetectedLine> lines;
  const Corners rhombus = {Vector3d(-2.0, 0.0, 0.0), Vector3d(0.0, -1.0, 0.0),
                           Vector3d(2.0, 0.0, 0.0), Vector3d(0.0, 1.0, 0.0)};
  AddSides(TestCamera(), LookAt(20.0, 10.0, 30.0, 10.0), rhombus, &random, &lines);
  EXPECT_FALSE(FindRectangle(AssemblyOptions(), lines));
}

// The frame of a picture, and the picture.
TEST(FindRectangle, TheLargestOfSeveral) {
  Random random(1);
  const CameraPose pose = LookAt(30.0, 10.0, 20.0, 10.0);
  std::vector<DetectedLine> lines;
  AddSides(TestCamera(), pose, Rectangle(1.2, 0.8), &random, &lines);
  AddSides(TestCamera(), pose, Rectangle(1.8, 1.2), &random, &lines);
  const auto pencils = FindRectangle(AssemblyOptions(), lines);
  ASSERT_TRUE(pencils);
  for (const DetectedPencil& pencil : *pencils) {
    for (const int i : pencil.members) EXPECT_GE(i, 4);
  }
}

// At a wrong focal length right angles look oblique; some of those that are possible makes them
// right.
TEST(FindRectangle, ThroughAGuessedCamera) {
  const Camera camera = TestCamera(), guess = TestCamera(480, 360, 350.0);
  Random random(1);
  std::vector<DetectedLine> lines;
  AddSides(camera, LookAt(50.0, 10.0, 25.0, 10.0), Rectangle(1.8, 1.2), &random, &lines);
  for (DetectedLine& line : lines)
    line = LineThrough(guess, line.ends[0], line.ends[1], 0.0, &random);
  for (DetectedLine& line : lines) line.sigma_px = 0.15;
  EXPECT_FALSE(FindRectangle(AssemblyOptions(), lines));
  AssemblyOptions guessed;
  guessed.camera.log_focal = 0.1;
  guessed.focal_sigma = 0.5;
  EXPECT_TRUE(FindRectangle(guessed, lines));
}

// A sheet of paper on a table, and nothing else.
TEST(FindRectangle, ABlankSheetGivesAPose) {
  const Camera camera = TestCamera();
  const CameraPose pose = LookAt(45.0, -10.0, 25.0, 10.0);
  const auto sheet = [](double x, double y) {
    return std::abs(x) < 2.0 && std::abs(y) < 1.4 ? 220.0 : 70.0;
  };
  const Observations found = detection_test::Detect(
      detection_test::Develop(detection_test::RenderPlane(camera, pose, 70.0, sheet), 0.7, 2.0),
      camera);
  Vector3d x, y;
  ASSERT_TRUE(detection_test::Axes(found, &x, &y)) << found.message;
  EXPECT_LT(detection_test::AxesErrorDeg(x, y, pose.rotation), 0.5);
  EXPECT_EQ(found.frame.plane, "p0");
  EXPECT_EQ(found.pencils.size(), 2U);
  EXPECT_TRUE(found.message.empty()) << found.message;
}

}  // namespace
}  // namespace circline
