#include "circline/ransac/detection/structure/solid_rims.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/conic_fit.h"
#include "circline/ransac/detection/edges.h"
#include "circline/ransac/detection/ellipses/detect_ellipses.h"
#include "tests/ransac/detection/detection_test_util.h"

namespace circline {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const Vector3d kUp = Vector3d(0.1, -0.8, -1.0).normalized();  // Of a table before the camera.
constexpr double kThickness = 0.15;                           // Of the radius.

Eigen::Matrix3d Image(const Vector3d& center) {
  CirclePose pose;
  pose.normal = kUp;
  pose.center = center;
  return ProjectCircle(pose);
}

// The contour that is seen of two circles one above the other: around both, as of a coin, or within
// both, as the floor of a hollow through its mouth.
CircleEvidence Contour(const Vector3d& center, const Vector3d& below, bool is_around) {
  const Camera camera = detection_test::TestCamera();
  const Eigen::Matrix3d upper = Image(center), lower = Image(below);
  std::vector<CalibratedPoint> points;
  constexpr int kPoints = 200;
  for (const auto& [conic, other] : {std::pair(upper, lower), std::pair(lower, upper)}) {
    Ellipse ellipse;
    EXPECT_TRUE(ConicToEllipse(conic, &ellipse));
    for (int k = 0; k < kPoints; ++k) {
      const Vector3d p = EllipsePoint(ellipse, 2.0 * kPi * k / kPoints).homogeneous();
      if ((p.dot(other * p) > -1e-12) != is_around) continue;
      const Vector2d pixel(camera.fx * p.x() + camera.cx, camera.fy * p.y() + camera.cy);
      EXPECT_TRUE(PixelToCalibrated(camera, pixel, &points.emplace_back()));
    }
  }
  CircleEvidence circle;
  circle.observation.fit = ConicFit();
  EXPECT_TRUE(FitConic(points, 0.2, &*circle.observation.fit).ok());
  circle.num_normals = CircleNormals(*circle.observation.fit, &circle.normals);
  circle.support_px = static_cast<double>(points.size());
  return circle;
}

// How far the better of a circle's two normals is from the table's.
double OffDeg(const ConicFit& fit) {
  std::array<UncertainDirection, 2> normals;
  double off_deg = 90.0;
  for (int k = CircleNormals(fit, &normals) - 1; k >= 0; --k) {
    const Vector3d& normal = normals[static_cast<std::size_t>(k)].direction;
    off_deg = std::min(off_deg, detection_test::AxisDeg(normal, kUp));
  }
  return off_deg;
}

CircleEvidence Outline(const Vector3d& top) { return Contour(top, top - kThickness * kUp, true); }
CircleEvidence Rim(const Vector3d& center) { return Contour(center, center, true); }
CircleEvidence Floor(const Vector3d& mouth) {
  return Contour(mouth, mouth - kThickness * kUp, false);
}

TEST(SolidRims, TakeTheTopOfWhatStandsOutAndTheMouthOfAHollow) {
  const Vector3d center(0.3, 0.2, 8.0);
  const SolidRims coin({Outline(center), Rim(center)}), bowl({Rim(center), Floor(center)});
  EXPECT_TRUE(coin.IsSilent(0, {}, kUp));
  EXPECT_FALSE(coin.IsSilent(1, {}, kUp));
  EXPECT_FALSE(bowl.IsSilent(0, {}, kUp));
  EXPECT_TRUE(bowl.IsSilent(1, {}, kUp));
  EXPECT_EQ(coin.RimOf(0, kUp), 1);
  EXPECT_EQ(coin.RimOf(1, kUp), 1);
  EXPECT_EQ(bowl.RimOf(1, kUp), 0);
  // Seen from below, as a lamp on a ceiling is, it is the other way round.
  const Vector3d down(0.1, 0.8, -1.0);
  EXPECT_FALSE(coin.IsSilent(0, {}, down.normalized()));
  EXPECT_TRUE(coin.IsSilent(1, {}, down.normalized()));
}

// The outline, which goes all the way round, has the far edge of the top for its own.
TEST(SolidRims, TheTopOfACoinIsFoundWhole) {
  const Camera camera = detection_test::TestCamera();
  const Vector3d top(0.3, 0.2, 5.0);
  constexpr int kSlices = 24;
  std::vector<Eigen::Matrix3d> slices;
  for (int k = 0; k <= kSlices; ++k) slices.push_back(Image(top - k * kThickness / kSlices * kUp));
  const cv::Mat image = detection_test::Develop(
      detection_test::Render(camera.width, camera.height, [&](double u, double v) {
        const Vector3d p((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
        const auto covers = [&](const Eigen::Matrix3d& slice) { return p.dot(slice * p) < 0.0; };
        if (covers(slices[0])) return 170.0;
        return std::any_of(slices.begin(), slices.end(), covers) ? 40.0 : 230.0;
      }));
  int tops = 0;
  for (const DetectedEllipse& e : DetectEllipses(DetectEdges(image), camera, EllipseOptions())) {
    tops += OffDeg(e.fit) < 0.5 && e.coverage_deg > 300.0 ? 1 : 0;
  }
  EXPECT_EQ(tops, 1);
}

// A wheel's hub may pass for concentric with its rim, in one of two poses; its tyre does not.
TEST(SolidRims, DoNotTrustConcentricRimsOfAThingWithOthers) {
  const Vector3d center(0.3, 0.2, 8.0);
  CircleEvidence rim = Rim(center), hub = Rim(4.0 * center);
  rim.observation.concentric = hub.observation.concentric = "g0";
  EXPECT_FALSE(SolidRims({rim, hub}).IsSilent(1, {0}, kUp));
  const CircleEvidence tyre = Rim(0.8 * (center - 0.2 * kUp));
  EXPECT_TRUE(SolidRims({rim, hub, tyre}).IsSilent(1, {0}, kUp));
}

// The outlines of two coins have a plane of their own, some degrees off.
TEST(SolidRims, CoinsLieWhereTheirTopsDo) {
  const Vector3d left(-1.5, 0.5, 8.0), right = left + 3.0 * Vector3d(1.0, 0.3, 0.0).cross(kUp);
  std::vector<CircleEvidence> circles = {Outline(left), Outline(right), Rim(left), Rim(right)};
  std::vector<DetectedPencil> pencils;
  Observations found;
  AssembleObservations({}, {}, {}, &circles, &pencils, &found);
  ASSERT_EQ(found.circles.size(), 4u);
  for (const CircleObservation& circle : found.circles) {
    const double off_deg = OffDeg(*circle.fit);
    EXPECT_EQ(circle.plane == "p0", off_deg < 0.5) << off_deg;
    EXPECT_TRUE(circle.plane == "p0" || off_deg > 2.0) << off_deg;
  }
}

}  // namespace
}  // namespace circline
