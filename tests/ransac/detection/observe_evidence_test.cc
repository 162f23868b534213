#include "circline/ransac/detection/structure/observe_evidence.h"

#include <gtest/gtest.h>

#include "circline/estimators/pose.h"
#include "tests/ransac/detection/detected_line_scene.h"
#include "tests/ransac/detection/detection_test_util.h"

namespace circline {
namespace {

using detection_test::AddEdge;
using detection_test::AxisDeg;
using detection_test::TestCamera;
using Eigen::Vector2d;

TEST(LineFromSegment, IsTheLineThroughItsEnds) {
  const Segment segment = {Vector2d(100.0, 80.0), Vector2d(160.0, 160.0)};
  DetectedLine line;
  ASSERT_TRUE(LineFromSegment(TestCamera(), segment, 0.3, &line).ok());
  EXPECT_DOUBLE_EQ(line.length_px, 100.0);
  for (const Vector2d& end : segment) {
    CalibratedPoint point;
    ASSERT_TRUE(PixelToCalibrated(TestCamera(), end, &point));
    EXPECT_NEAR(LineDistancePx(point, line.fit.line), 0.0, 1e-9);
  }
  EXPECT_FALSE(LineFromSegment(TestCamera(), {segment[0], segment[0]}, 0.3, &line).ok());
}

// Rows and columns of one front, as segments: no photo, no circles.
TEST(ObserveEvidence, SegmentsAloneHaveAPlaneAndItsAxes) {
  const Eigen::Matrix3d axes = ExpRotation(Eigen::Vector3d(0.2, 0.5, 0.1));
  Random random(1);
  PhotoEvidence evidence;
  for (int k = 0; k < 40; ++k) {
    AddEdge(axes.col(k % 2), 60.0, TestCamera(), &random, &evidence);
  }
  Observations observations;
  observations.camera = TestCamera();
  ObserveEvidence(DetectionOptions(), 600.0, &evidence, &observations);
  EXPECT_EQ(observations.message, "");
  ASSERT_GE(observations.pencils.size(), 2U);
  for (std::size_t k = 0; k < 2; ++k) {
    const PencilObservation& pencil = observations.pencils[k];
    EXPECT_NE(pencil.direction, PencilDirection::kFree);
    EXPECT_EQ(pencil.plane, "p0");
    EXPECT_LT(std::min(AxisDeg(pencil.fit->direction, axes.col(0)),
                       AxisDeg(pencil.fit->direction, axes.col(1))),
              1.0);
  }
}

// Where the focal length was looked for, three edges along the third direction are its pencil.
TEST(ObserveEvidence, AFewEdgesAlongTheNormalAreZ) {
  const Eigen::Matrix3d axes = ExpRotation(Eigen::Vector3d(0.2, 0.6, 0.1));
  DetectionOptions options;
  options.noise_model.camera.log_focal = 0.5;
  options.noise_model.camera.principal_point_px = 5.0;
  int found = 0;
  constexpr int kTrials = 20;
  for (std::uint64_t seed = 1; seed <= kTrials; ++seed) {
    Random random(seed);
    PhotoEvidence evidence;
    for (int k = 0; k < 44; ++k) {
      AddEdge(axes.col(k < 40 ? k % 2 : 2), 60.0, TestCamera(), &random, &evidence);
    }
    Observations observations;
    observations.camera = TestCamera();
    ObserveEvidence(options, 600.0, &evidence, &observations);
    for (const PencilObservation& pencil : observations.pencils) {
      if (pencil.direction != PencilDirection::kZ) continue;
      EXPECT_LT(AxisDeg(pencil.fit->direction, axes.col(2)), 2.0);
      ++found;
    }
  }
  EXPECT_GE(found, 0.8 * kTrials);
}

TEST(ObserveEvidence, SaysWhatIsMissing) {
  PhotoEvidence evidence;
  Observations observations;
  observations.camera = TestCamera();
  ObserveEvidence(DetectionOptions(), 800.0, &evidence, &observations);
  EXPECT_EQ(observations.message.substr(0, 13), "nothing found");
}

}  // namespace
}  // namespace circline
