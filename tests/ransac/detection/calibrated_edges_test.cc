#include "circline/ransac/detection/calibrated_edges.h"

#include <gtest/gtest.h>

#include <array>

#include "tests/ransac/detection/detection_test_util.h"

namespace circline {
namespace {

using detection_test::DistortedCamera;
using detection_test::FisheyeCamera;
using detection_test::TestCamera;

// Chains across the photo, a point a pixel.
EdgeMap Lines(const Camera& camera) {
  EdgeMap map;
  map.width = camera.width;
  map.height = camera.height;
  for (int y = 5; y < camera.height; y += 40) {
    const int begin = static_cast<int>(map.points.size());
    for (int x = 2; x < camera.width - 2; ++x) {
      EdgePoint point;
      point.x = static_cast<float>(x);
      point.y = static_cast<float>(y) + 0.3f * static_cast<float>(x % 3);
      map.points.push_back(point);
    }
    map.chains.push_back({begin, static_cast<int>(map.points.size())});
  }
  return map;
}

TEST(CalibratedEdges, AgreesWithTheCamera) {
  for (const Camera& camera : {TestCamera(), DistortedCamera(), FisheyeCamera()}) {
    const EdgeMap map = Lines(camera);
    CalibratedEdges edges(map, camera);
    for (int i = static_cast<int>(map.points.size()) - 1; i >= 0; --i) {
      CalibratedPoint truth;
      const Eigen::Vector2d pixel = map.points[static_cast<std::size_t>(i)].Position();
      const bool usable = PixelToCalibrated(camera, pixel, &truth);
      CalibratedPoint point;
      ASSERT_EQ(edges.Get(i, &point), usable) << pixel.transpose();
      if (!usable) continue;
      // Back on the photo, by the derivative.
      const std::array<double, 4>& j = truth.x_from_pixel;
      const Eigen::Vector2d miss = point.x - truth.x;
      const double det = j[0] * j[3] - j[1] * j[2];
      const Eigen::Vector2d miss_px((j[3] * miss.x() - j[1] * miss.y()) / det,
                                    (j[0] * miss.y() - j[2] * miss.x()) / det);
      EXPECT_LT(miss_px.norm(), 0.01) << pixel.transpose() << " focal " << camera.fx;
    }
  }
}

TEST(CalibratedEdges, HasNoneWhereTheCameraSeesNothing) {
  Camera camera = TestCamera();
  camera.model = CameraModel::kOpenCV;
  camera.distortion[0] = -2.0;  // One-to-one near the middle only.
  const EdgeMap map = Lines(camera);
  CalibratedEdges edges(map, camera);
  CalibratedPoint point;
  ASSERT_FALSE(PixelToCalibrated(camera, map.points[0].Position(), &point));
  EXPECT_FALSE(edges.Get(0, &point));
  EXPECT_FALSE(edges.Get(0, &point));
}

}  // namespace
}  // namespace circline
