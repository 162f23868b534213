// What DetectObservations says of photos that show too little for a pose.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/random.h"
#include "circline/ransac/detection/detect_observations.h"
#include "tests/basics.h"
#include "tests/ransac/detection/detection_test_util.h"
#include "tests/ransac/detection/observations_test_util.h"

namespace circline {
namespace {

using detection_test::Detect;
using detection_test::Develop;
using detection_test::FisheyeCamera;
using detection_test::LookAt;
using detection_test::Noise;
using detection_test::Render;
using detection_test::RenderPlane;
using detection_test::TestCamera;
using Eigen::Vector2d;
using Eigen::Vector3d;

TEST(DetectObservations, NothingIsInvented) {
  const Camera camera = TestCamera(320, 240);
  const Observations blank = Detect(cv::Mat(240, 320, CV_8UC1, cv::Scalar(77)), camera);
  EXPECT_TRUE(blank.circles.empty());
  EXPECT_TRUE(blank.pencils.empty());
  EXPECT_TRUE(blank.frame.plane.empty());
  EXPECT_FALSE(blank.message.empty());
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Observations noise = Detect(Noise(320, 240, 25.0, seed), camera);
    EXPECT_TRUE(noise.circles.empty());
    EXPECT_TRUE(noise.pencils.empty());
    EXPECT_FALSE(noise.message.empty());
  }
}

// A disc in haze, ten grey levels darker than what is around it: its edges count where there are no
// others; beside a disc of full contrast they do not.
TEST(DetectObservations, LooksForFaintEdgesWhereNothingElseTells) {
  const Camera camera = TestCamera();
  const CameraPose pose = LookAt(40.0, 10.0, 0.0, 8.0);
  for (const bool has_other : {false, true}) {
    const cv::Mat image = Develop(RenderPlane(camera, pose, 200.0, [&](double x, double y) {
      if (std::hypot(x + 1.0, y) < 0.8) return 190.0;
      return has_other && std::hypot(x - 1.4, y) < 0.5 ? 60.0 : 200.0;
    }));
    const Observations found = Detect(image, camera);
    ASSERT_EQ(found.circles.size(), 1U) << has_other;
    EXPECT_EQ(found.circles[0].points[0].x() > camera.cx, has_other);
  }
}

// Noise of every scale from 1 to 16 pixels, of full contrast.
cv::Mat Texture(int width, int height, std::uint64_t seed) {
  cv::Mat sum(height, width, CV_32F, cv::Scalar(128.0));
  for (double scale = 1.0; scale <= 16.0; scale *= 2.0) {
    cv::Mat layer;
    Noise(width, height, 30.0, seed++).convertTo(layer, CV_32F);
    cv::GaussianBlur(layer, layer, cv::Size(), scale);
    sum += 2.0 * scale * (layer - 128.0);
  }
  sum.convertTo(sum, CV_8U);
  return sum;
}

TEST(DetectObservations, TextureIsNoPose) {
  for (const Camera& camera : {TestCamera(), FisheyeCamera()}) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const Observations found = Detect(Texture(camera.width, camera.height, 100 * seed), camera);
      EXPECT_TRUE(found.pencils.empty()) << seed;
      EXPECT_LE(found.circles.size(), 1U) << seed;
      EXPECT_FALSE(found.message.empty()) << seed;
    }
  }
}

TEST(DetectObservations, ClutterOfLinesIsNoPose) {
  // Triangles thrown about: straight edges in all directions, and no two sides of one parallel.
  const Camera camera = TestCamera();
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Random random(seed);
    cv::Mat image(camera.height, camera.width, CV_8U, cv::Scalar(110));
    for (int k = 0; k < 14; ++k) {
      std::vector<cv::Point> corners;
      for (int c = 0; c < 3; ++c) {
        corners.push_back({static_cast<int>(random.Uniform() * camera.width),
                           static_cast<int>(random.Uniform() * camera.height)});
      }
      cv::fillConvexPoly(image, corners, cv::Scalar(255.0 * random.Uniform()), cv::LINE_AA);
    }
    cv::GaussianBlur(image, image, cv::Size(), 0.7);
    const Observations found = Detect(image, camera);
    EXPECT_TRUE(found.circles.empty()) << seed;
    EXPECT_LE(found.pencils.size(), 1U) << seed;
    EXPECT_FALSE(found.message.empty()) << seed;
  }
}

TEST(DetectObservations, OneCircleIsSaidToHaveTwoPoses) {
  const Camera camera = FisheyeCamera();
  const cv::Mat image =
      Develop(RenderPlane(camera, LookAt(40.0, 10.0, 0.0, 2.5), 120.0, [](double x, double y) {
        return std::hypot(x, y) < 1.0 ? 40.0 : 120.0;
      }));
  const Observations found = Detect(image, camera);
  ASSERT_EQ(found.circles.size(), 1U);
  EXPECT_TRUE(found.pencils.empty());
  EXPECT_CONTAINS(found.message, "two poses");
  // What FitObservations may want: each point with the edge's normal, which is the contour's.
  const CircleObservation& circle = found.circles[0];
  ASSERT_EQ(circle.normals.size(), circle.points.size());
  for (std::size_t k = 0; k < circle.points.size(); ++k) {
    CalibratedPoint p;
    ASSERT_TRUE(PixelToCalibrated(camera, circle.points[k], &p));
    const Vector3d polar = circle.fit->conic * p.Homogeneous();
    const Vector2d across = p.GradientPerPixel(polar.head<2>()).normalized();
    EXPECT_GT(std::abs(across.dot(circle.normals[k])), std::cos(15.0 * kDegree));
  }
}

TEST(DetectObservations, OnePencilIsSaidToBeTooLittle) {
  const Camera camera = TestCamera();
  const cv::Mat image =
      Develop(RenderPlane(camera, LookAt(30.0, 20.0, 15.0, 8.0), 60.0, [](double x, double) {
        return static_cast<int>(std::floor(x)) % 2 == 0 ? 60.0 : 190.0;
      }));
  const Observations found = Detect(image, camera);
  ASSERT_EQ(found.pencils.size(), 1U);
  EXPECT_EQ(found.pencils[0].direction, PencilDirection::kFree);
  EXPECT_CONTAINS(found.message, "one pencil");
}

TEST(DetectObservations, DirectionsOfDifferentThingsSpanNoPlane) {
  // Stripes on the left and other stripes on the right, nowhere near each other.
  const Camera camera = TestCamera();
  const cv::Mat image = Develop(Render(camera.width, camera.height, [](double u, double v) {
    const auto stripe = [](double across) {
      return static_cast<int>(std::floor(across / 12.0)) % 2 == 0 ? 60.0 : 190.0;
    };
    if (v < 60.0 || v > 300.0) return 120.0;
    if (u > 40.0 && u < 160.0) return stripe(400.0 + u + 0.2 * v);
    if (u > 300.0 && u < 440.0) return stripe(400.0 + v - 0.3 * u);
    return 120.0;
  }));
  const Observations found = Detect(image, camera);
  ASSERT_EQ(found.pencils.size(), 2U);
  EXPECT_TRUE(found.circles.empty());
  EXPECT_TRUE(found.frame.plane.empty());
  EXPECT_NE(found.pencils[0].plane, found.pencils[1].plane);
  EXPECT_CONTAINS(found.message, "span no plane");
  for (const PencilObservation& pencil : found.pencils) {
    EXPECT_EQ(pencil.direction, PencilDirection::kFree);
  }
}

}  // namespace
}  // namespace circline
