#include "circline/ransac/detection/structure/box_rivals.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <utility>
#include <vector>

#include "circline/estimators/pose.h"
#include "circline/ransac/detection/structure/pencil_fitter.h"
#include "tests/ransac/detection/detected_line_scene.h"
#include "tests/ransac/detection/detection_test_util.h"

namespace circline {
namespace {

using detection_test::AxisDeg;
using Eigen::Matrix3d;
using Eigen::Vector3d;

const Matrix3d kFronts = ExpRotation(Vector3d(0.5, -0.3, 0.4));  // Of houses, and of a box: axes.
const Matrix3d kCarton = ExpRotation(Vector3d(2.3, 0.1, 0.2));

// So many lines along each of the two directions of the houses, below the horizon, and a circle.
struct HousesPhoto {
  std::vector<DetectedLine> lines;
  std::vector<DetectedPencil> pencils;
  std::vector<CircleEvidence> circles{1};
};

HousesPhoto HousesAndCircle(int num_lines, const Vector3d& normal_of_circle) {
  HousesPhoto photo;
  Random random(3);
  for (int k = 0; k < 2 * num_lines; ++k) {
    const double u = random.Uniform(60.0, 420.0), v = random.Uniform(190.0, 320.0);
    photo.lines.push_back(detection_test::MakeLine(detection_test::TestCamera(), u, v,
                                                   kFronts.col(k % 2), 60.0, 0.0, 0.1, &random));
  }
  const LineSet set(photo.lines, kUsualDiagonalPx);
  for (int k = 0; k < 2; ++k) {
    std::vector<int> along;
    for (int i = k; i < 2 * num_lines; i += 2) along.push_back(i);
    DetectedPencil pencil;
    pencil.observation.fit = VanishingPointFit();
    pencil.observation.fit->direction = kFronts.col(k);
    EXPECT_TRUE(RefitPencil(set, along, &pencil));
    photo.pencils.push_back(std::move(pencil));
  }
  CircleEvidence& circle = photo.circles[0];
  circle.observation.fit =
      detection_test::FitOfCircle(normal_of_circle, Vector3d(0.5, 0.2, 6.0), 1e-10);
  circle.num_normals = CircleNormals(*circle.observation.fit, &circle.normals);
  circle.support_px = 2000.0;
  return photo;
}

std::vector<DetectedLine> EdgesOfCarton() {
  Random random(1);
  return detection_test::BoxEdges(detection_test::TestCamera(), kCarton, 0.2, &random);
}

// A box along these axes, with so much evidence along each.
FoundBox MakeBox(const Matrix3d& axes, double log_odds) {
  FoundBox box;
  box.axes = axes;
  box.log_odds_along = {log_odds, log_odds, log_odds};
  return box;
}

bool Yields(const FoundBox& box, const HousesPhoto& photo, Plane* plane) {
  std::vector<PlacedPencil> pencils(photo.pencils.begin(), photo.pencils.end());
  return YieldsToPencils(box, {}, photo.lines, photo.circles, plane, &pencils);
}

TEST(YieldsToPencils, ToThoseOfThePlaneButForWhatTheyShare) {
  const HousesPhoto photo = HousesAndCircle(25, kCarton.col(2));
  Plane plane;
  plane.pencils = {0, 1};
  EXPECT_TRUE(Yields(MakeBox(kCarton, 5.0), photo, &plane));
  EXPECT_FALSE(Yields(MakeBox(kCarton, 500.0), photo, &plane));
  // Nothing new.
  EXPECT_TRUE(Yields(MakeBox(kFronts, 500.0), photo, &plane));
  // Two thirds of the evidence of this one are of another direction than theirs.
  Matrix3d one_shared = kCarton;
  one_shared.col(0) = kFronts.col(0);
  double most = 1.0;
  while (Yields(MakeBox(kCarton, most), photo, &plane)) most *= 1.1;
  EXPECT_FALSE(Yields(MakeBox(one_shared, most), photo, &plane));
  EXPECT_TRUE(Yields(MakeBox(one_shared, 0.5 * most), photo, &plane));
  EXPECT_EQ(plane.pencils[1], 1);
}

TEST(YieldsToPencils, ToThoseThatALoneCircleOutweighs) {
  const HousesPhoto photo = HousesAndCircle(25, kCarton.col(2));
  Plane of_circle, of_circles, none;
  of_circle.circles = {0};
  of_circles.circles = {0, 1};
  EXPECT_FALSE(Yields(MakeBox(kCarton, 500.0), photo, &of_circle));
  EXPECT_EQ(of_circle.pencils[0], -1);
  EXPECT_FALSE(Yields(MakeBox(kCarton, 5.0), photo, &of_circles));
  EXPECT_FALSE(Yields(MakeBox(kCarton, 5.0), photo, &none));
  EXPECT_TRUE(Yields(MakeBox(kCarton, 5.0), photo, &of_circle));
  EXPECT_EQ(of_circle.pencils, (std::array<int, 2>{0, 1}));
  EXPECT_TRUE(of_circle.circles.empty());
  EXPECT_LT(AxisDeg(of_circle.normal.direction, kFronts.col(2)), 2.0);
}

// A box on a circle's plane has that plane's evidence, too: a few lines of the room say less.
TEST(YieldsToPencils, NotToWeakOnesBesideACircle) {
  const HousesPhoto photo = HousesAndCircle(6, kCarton.col(2));
  Plane of_circle, of_pencils;
  of_circle.circles = {0};
  of_pencils.pencils = {0, 1};
  EXPECT_FALSE(Yields(MakeBox(kCarton, 1.0), photo, &of_circle));
  EXPECT_TRUE(Yields(MakeBox(kCarton, 1.0), photo, &of_pencils));
}

// A lamp's shadow passes for a circle, and a few lines for a box on its plane, or for one that has
// nothing to do with it, where house fronts have dozens along their directions.
TEST(YieldsToPencils, DecidesBetweenABoxAndTwoPencilsBesideACircle) {
  for (const Vector3d& normal : {Vector3d(kCarton.col(2)), Vector3d(0.3, 0.5, -1.0)}) {
    for (const int num_lines : {3, 25}) {
      HousesPhoto photo = HousesAndCircle(num_lines, normal);
      Observations found;
      AssembleObservations({}, photo.lines, EdgesOfCarton(), &photo.circles, &photo.pencils,
                           &found);
      const bool is_box = num_lines == 3;
      ASSERT_EQ(found.pencils.size(), is_box ? 3U : 2U);
      EXPECT_EQ(found.circles[0].plane, is_box && normal == kCarton.col(2) ? "p0" : "");
      for (Eigen::Index k = 0; k < 2; ++k) {
        const PencilObservation& pencil = found.pencils[static_cast<std::size_t>(k)];
        EXPECT_EQ(pencil.plane, "p0");
        EXPECT_EQ(pencil.lines.size(), is_box ? 3U : 25U);
      }
    }
  }
}

}  // namespace
}  // namespace circline
