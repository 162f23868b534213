#include "circline/ransac/detection/structure/assemble_observations.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include "circline/estimators/basics.h"
#include "tests/ransac/detection/detected_line_scene.h"
#include "tests/ransac/detection/detection_test_util.h"

namespace circline {
namespace {

using detection_test::AxisDeg;
using Eigen::Matrix3d;
using Eigen::Vector3d;

// A pencil whose direction is known to 0.1 degrees, of two long lines that cross all of any other.
DetectedPencil Pencil(const Vector3d& direction, double support) {
  DetectedPencil pencil;
  VanishingPointFit fit;
  fit.direction = direction.normalized();
  const double sigma = 0.1 * kDegree;
  fit.covariance =
      sigma * sigma * (Matrix3d::Identity() - fit.direction * fit.direction.transpose());
  pencil.observation.fit = fit;
  pencil.ends = {{Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(support, 0.0)}};
  pencil.support_px = support;
  return pencil;
}

// A circle of the plane with this normal, its conic known as a rim of 100 px radius would be.
CircleEvidence Circle(const Vector3d& normal, double support,
                      const Vector3d& center = Vector3d(0.5, 0.2, 6.0), double variance = 1e-10) {
  const ConicFit fit = detection_test::FitOfCircle(normal, center, variance);
  CircleEvidence circle;
  circle.observation.fit = fit;
  circle.num_normals = CircleNormals(fit, &circle.normals);
  circle.support_px = support;
  return circle;
}

Observations Assemble(std::vector<CircleEvidence> circles, std::vector<DetectedPencil> pencils,
                      int max_pencils = 3, const std::vector<DetectedLine>& bent = {},
                      bool is_guess = false) {
  Observations observations;
  AssemblyOptions options;
  options.max_pencils = max_pencils;
  if (is_guess) options.camera.log_focal = 0.1;
  AssembleObservations(options, {}, bent, &circles, &pencils, &observations);
  return observations;
}

const Matrix3d kFrame = ExpRotation(Vector3d(0.5, -0.3, 0.4));

TEST(AssembleObservations, OrthogonalPencilsBecomeAxes) {
  const Observations found = Assemble(
      {},
      {Pencil(kFrame.col(0), 900.0), Pencil(kFrame.col(1), 700.0), Pencil(kFrame.col(2), 500.0)});
  ASSERT_EQ(found.pencils.size(), 3U);
  EXPECT_EQ(found.pencils[0].direction, PencilDirection::kX);
  EXPECT_EQ(found.pencils[1].direction, PencilDirection::kY);
  EXPECT_EQ(found.pencils[2].direction, PencilDirection::kZ);
  EXPECT_EQ(found.pencils[0].plane, "p0");
  EXPECT_EQ(found.pencils[1].plane, "p0");
  EXPECT_TRUE(found.pencils[2].plane.empty());
  EXPECT_EQ(found.pencils[2].id, "L2");
  EXPECT_EQ(found.frame.plane, "p0");
}

// Most lines of a thin pencil may be those of a strong one as well: what is its own is counted
// without them, and how it may run is a probability.
TEST(AssembleObservations, ReadsAPencilAgainWithoutTheLinesOfAnother) {
  Random random(1);
  const Camera camera = detection_test::TestCamera();
  std::vector<DetectedLine> lines;
  for (int i = 0; i < 5; ++i) {
    lines.push_back(detection_test::MakeLine(camera, 100.0 + 90.0 * i, 80.0 + 70.0 * i,
                                             kFrame.col(1), 90.0, 0.0, 0.2, &random));
  }
  std::vector<DetectedPencil> pencils = {Pencil(kFrame.col(0), 900.0),
                                         Pencil(kFrame.col(1), 700.0)};
  pencils[1].observation.fit->covariance *= 2.0;
  pencils[0].members = {0, 1, 2, 3};
  pencils[1].members = {0, 1, 2, 3, 4};
  std::vector<CircleEvidence> circles;
  Observations found;
  AssembleObservations({}, lines, {}, &circles, &pencils, &found);
  ASSERT_EQ(found.pencils.size(), 2U);
  double sum = 0.0;
  for (const DirectionReading& reading : found.pencils[1].readings) sum += reading.probability;
  EXPECT_NEAR(sum, 1.0, 1e-9);
}

// Walls lean by a degree; what is farther off is no wall.
TEST(AssembleObservations, ARightAngleIsATestNotAWish) {
  for (const double off_deg : {0.3, 1.6, 5.0}) {
    const double a = off_deg * kDegree;
    const Vector3d skew = std::cos(a) * kFrame.col(1) + std::sin(a) * kFrame.col(0);
    const Observations found = Assemble({}, {Pencil(kFrame.col(0), 900.0), Pencil(skew, 700.0)});
    const bool orthogonal = off_deg < 2.0;
    EXPECT_EQ(found.pencils[0].direction,
              orthogonal ? PencilDirection::kX : PencilDirection::kFree);
    EXPECT_EQ(found.pencils[1].direction,
              orthogonal ? PencilDirection::kY : PencilDirection::kFree);
    EXPECT_EQ(found.pencils[1].plane, "p0");
  }
}

TEST(AssembleObservations, ACircleChoosesThePairOfPencilsThatItAgreesWith) {
  const std::vector<DetectedPencil> pencils = {
      Pencil(kFrame.col(0), 500.0), Pencil(kFrame.col(1), 480.0), Pencil(kFrame.col(2), 460.0)};
  const Observations found = Assemble({Circle(kFrame.col(1), 400.0)}, pencils);
  ASSERT_EQ(found.circles.size(), 1U);
  EXPECT_EQ(found.circles[0].plane, "p0");
  ASSERT_EQ(found.pencils.size(), 3U);
  // In the plane: the first and the third, which span it; the second is its normal.
  EXPECT_LT(AxisDeg(found.pencils[0].fit->direction, kFrame.col(0)), 1e-6);
  EXPECT_LT(AxisDeg(found.pencils[1].fit->direction, kFrame.col(2)), 1e-6);
  EXPECT_EQ(found.pencils[2].direction, PencilDirection::kZ);
}

TEST(AssembleObservations, CirclesAloneAgreeOnAPlane) {
  const Vector3d normal = Vector3d(0.3, 0.5, -1.0), other = Vector3d(-0.6, 0.1, -0.7);
  const Observations found = Assemble({Circle(other, 300.0), Circle(normal, 200.0),
                                       Circle(normal, 180.0, Vector3d(-1.5, 0.2, 6.0))},
                                      {});
  ASSERT_EQ(found.circles.size(), 3U);
  EXPECT_EQ(found.circles[0].id, "c0");
  EXPECT_EQ(found.circles[0].plane, "p0");
  EXPECT_EQ(found.circles[1].plane, "p0");
  EXPECT_TRUE(found.circles[2].plane.empty());
}

// How many of so many small rims share the plane that is found, where the first `on_plane` of them
// lie in one and the others any way. `variance`: of conics; normals are good to about 2 degrees.
std::size_t SharingAPlane(int circles, int on_plane, Random* random, bool is_guess = false,
                          double variance = 1e-9) {
  std::vector<CircleEvidence> evidence;
  for (int i = 0; i < circles; ++i) {
    Vector3d normal = -kFrame.col(2);
    if (i >= on_plane) {
      const double x = random->Normal(), y = random->Normal(), z = random->Normal();
      normal = Vector3d(x, y, -std::abs(z));
    }
    const double u = random->Uniform(-6.0, 6.0), v = random->Uniform(-4.5, 4.5);
    CircleEvidence circle = Circle(normal, 100.0, {u, v, 6.0}, variance);
    if (circle.num_normals > 0) evidence.push_back(std::move(circle));
  }
  const Observations found = Assemble(std::move(evidence), {}, 3, {}, is_guess);
  return static_cast<std::size_t>(
      std::count_if(found.circles.begin(), found.circles.end(),
                    [](const CircleObservation& c) { return c.plane == "p0"; }));
}

// The rims of a cup are at different heights and rounded: together they would choose a pose by how
// they err. Rings of a marker are concentric, and say so.
TEST(AssembleObservations, OneRimOfASolidSpeaksForAll) {
  const Vector3d normal = Vector3d(0.2, -0.6, -1.0).normalized(), center(0.5, 0.2, 6.0);
  for (const bool is_marker : {false, true}) {
    CircleEvidence outer = Circle(normal, 600.0, center),
                   inner = Circle(normal, 400.0, (center - 0.1 * normal) / 0.8);
    if (is_marker) outer.observation.concentric = inner.observation.concentric = "g0";
    const Observations found =
        Assemble({outer, inner, Circle(normal, 300.0, Vector3d(-2.0, 1.0, 7.0))}, {});
    const auto in_plane =
        std::count_if(found.circles.begin(), found.circles.end(),
                      [](const CircleObservation& circle) { return circle.plane == "p0"; });
    EXPECT_EQ(in_plane, is_marker ? 3 : 2);
    EXPECT_EQ(found.circles[0].plane, "p0");
  }
}

// Of many, some agree by accident: that is no plane.
TEST(AssembleObservations, CirclesThatLieAnyWayShareNoPlane) {
  constexpr int kTrials = 100;
  Random random(1);
  int accidents = 0, planes = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    accidents += SharingAPlane(30, 0, &random) > 1 ? 1 : 0;
    planes += SharingAPlane(12, 4, &random) >= 4 ? 1 : 0;
  }
  EXPECT_LE(accidents, 5);
  EXPECT_GE(planes, 90);
  std::printf("planes of 30 circles that lie any way: %d of 100; of 4 of 12: %d\n", accidents,
              planes);
}

// A guess of the focal length was chosen among many, at one of which two circles agree by accident:
// they are to be known better.
TEST(AssembleObservations, ThroughAGuessedCameraVagueCirclesMakeNoPlane) {
  constexpr int kTrials = 100;
  const auto count = [](bool is_guess, double variance) {
    Random random(1);
    int planes = 0;
    for (int trial = 0; trial < kTrials; ++trial)
      planes += SharingAPlane(2, 2, &random, is_guess, variance) > 1 ? 1 : 0;
    return planes;
  };
  for (const bool is_guess : {false, true}) EXPECT_EQ(count(is_guess, 1e-9), kTrials);
  constexpr double kVague = 5e-4;
  EXPECT_GE(count(false, kVague), 0.9 * kTrials);
  EXPECT_LE(count(true, kVague), 0.8 * kTrials);
}

const Matrix3d kBox = ExpRotation(Vector3d(2.3, 0.1, 0.2));  // Its axes.

std::vector<DetectedLine> EdgesOfBox() {
  Random random(1);
  return detection_test::BoxEdges(detection_test::TestCamera(), kBox, 0.2, &random);
}

// A lone circle leaves two normals, and nothing says where x is; a box on its plane says both.
TEST(AssembleObservations, ABoxOnACirclesPlaneGivesTheAxes) {
  const Vector3d unrelated(1.0, 1.0, 1.0);
  const Observations found =
      Assemble({Circle(kBox.col(2), 500.0)}, {Pencil(unrelated, 900.0)}, 3, EdgesOfBox());
  ASSERT_EQ(found.circles.size(), 1U);
  EXPECT_EQ(found.circles[0].plane, "p0");
  EXPECT_EQ(found.frame.plane, "p0");
  ASSERT_EQ(found.pencils.size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    const PencilObservation& pencil = found.pencils[k];
    EXPECT_EQ(pencil.direction, static_cast<PencilDirection>(k));
    EXPECT_EQ(pencil.plane, k < 2 ? "p0" : "");
    EXPECT_EQ(pencil.lines.size(), 3U);
    for (const LineObservation& line : pencil.lines) {
      EXPECT_LT(std::abs(line.fit->line.dot(kBox.col(static_cast<Eigen::Index>(k)))), 0.02);
      // Points of edges that may be worn count for less than they scatter.
      EXPECT_GT(line.sigma_px, 0.3);
    }
  }
}

TEST(AssembleObservations, TwoPencilsOfAPlaneNeedNoBox) {
  const Observations found =
      Assemble({}, {Pencil(kFrame.col(0), 500.0), Pencil(kFrame.col(1), 400.0)}, 3, EdgesOfBox());
  ASSERT_EQ(found.pencils.size(), 2U);
  EXPECT_LT(AxisDeg(found.pencils[0].fit->direction, kFrame.col(0)), 0.1);
}

// One pencil is no plane; a box with an axis along it has three.
TEST(AssembleObservations, ABoxAlongAPencilGivesTheAxes) {
  const Observations found = Assemble({}, {Pencil(kBox.col(1), 500.0)}, 3, EdgesOfBox());
  EXPECT_EQ(found.frame.plane, "p0");
  ASSERT_EQ(found.pencils.size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(found.pencils[k].direction, static_cast<PencilDirection>(k));
    EXPECT_EQ(found.pencils[k].plane, k < 2 ? "p0" : "");
    EXPECT_EQ(found.pencils[k].lines.size(), 3U);
  }
}

// Two that claim to span a plane at right angles, one of them along the box and the other along
// none of its edges: the box has better evidence than a direction of no lines.
TEST(AssembleObservations, ABoxThatContradictsAWeakPencilIsTaken) {
  const Vector3d between = (kBox.col(1) + kBox.col(2)).normalized();
  const Observations found =
      Assemble({}, {Pencil(kBox.col(0), 500.0), Pencil(between, 400.0)}, 3, EdgesOfBox());
  ASSERT_EQ(found.pencils.size(), 3U);
  for (const PencilObservation& pencil : found.pencils) EXPECT_EQ(pencil.lines.size(), 3U);
}

// A sheet of paper gives a disc on it its axes; a disc that is turned otherwise stands for itself.
TEST(AssembleObservations, ARectangleGivesACircleOnItItsAxes) {
  const Camera camera = detection_test::TestCamera();
  const Matrix3d axes = ExpRotation(Vector3d(2.4, 0.2, 0.3));
  const Vector3d origin(0.0, 0.0, 10.0);
  Random random(1);
  std::vector<Eigen::Vector2d> corners(4);
  for (std::size_t k = 0; k < 4; ++k) {
    const double x = k == 1 || k == 2 ? 2.4 : -2.4, y = k >= 2 ? 1.6 : -1.6;
    ASSERT_TRUE(CameraToPixel(camera, origin + x * axes.col(0) + y * axes.col(1), &corners[k]));
  }
  std::vector<DetectedLine> lines;
  for (std::size_t k = 0; k < 4; ++k)
    lines.push_back(
        detection_test::LineThrough(camera, corners[k], corners[(k + 1) % 4], 0.15, &random));
  for (const bool is_on_sheet : {true, false}) {
    const Vector3d normal = is_on_sheet ? axes.col(2) : Vector3d(0.8, -0.1, -1.0);
    std::vector<CircleEvidence> circles = {Circle(normal, 300.0, origin)};
    std::vector<DetectedPencil> pencils;
    Observations found;
    AssembleObservations(AssemblyOptions(), lines, {}, &circles, &pencils, &found);
    ASSERT_EQ(found.circles.size(), 1U);
    EXPECT_EQ(found.circles[0].plane, "p0");
    ASSERT_EQ(found.pencils.size(), is_on_sheet ? 2U : 0U);
    for (const PencilObservation& pencil : found.pencils) {
      EXPECT_EQ(pencil.plane, "p0");
      EXPECT_EQ(pencil.lines.size(), 2U);
    }
  }
}

// Of directions in their plane only those of lines among them: others are so by accident.
TEST(AssembleObservations, LinesFarFromAPlanesCirclesAreNotInIt) {
  for (const bool is_far : {false, true}) {
    std::vector<CircleEvidence> circles;
    for (int k = 0; k < 3; ++k) {
      circles.push_back(Circle(kFrame.col(2), 300.0, Vector3d(2.0 * k - 2.0, 1.0 * k, 6.0)));
      circles.back().observation.points = {{100.0 * k, 0.0}, {100.0 * k, 50.0}};
    }
    DetectedPencil pencil = Pencil(kFrame.col(0), 200.0);
    for (Eigen::Vector2d& end : pencil.ends[0]) end.y() += is_far ? 200.0 : 25.0;
    const Observations found = Assemble(circles, {pencil});
    ASSERT_EQ(found.pencils.size(), 1U);
    EXPECT_EQ(found.pencils[0].plane, is_far ? "" : "p0");
  }
}

TEST(AssembleObservations, KeepsNoMorePencilsThanAsked) {
  const Observations found =
      Assemble({}, {Pencil(kFrame.col(0), 900.0), Pencil(kFrame.col(1), 700.0)}, 1);
  EXPECT_EQ(found.pencils.size(), 1U);
  EXPECT_TRUE(Assemble({}, {}).frame.plane.empty());
}

}  // namespace
}  // namespace circline
