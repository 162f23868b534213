#include "circline/estimators/camera.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <vector>

#include "circline/estimators/random.h"
#include "tests/basics.h"

namespace circline {
namespace {

Camera MakeCamera(CameraModel model, const std::array<double, 8>& distortion) {
  Camera camera;
  camera.model = model;
  camera.width = 640;
  camera.height = 480;
  camera.fx = 500.0;
  camera.fy = 510.0;
  camera.cx = 321.5;
  camera.cy = 238.5;
  camera.distortion = distortion;
  return camera;
}

std::vector<Camera> Cameras() {
  return {MakeCamera(CameraModel::kPinhole, {}),
          MakeCamera(CameraModel::kOpenCV, {-0.28, 0.08, 1e-3, -5e-4, -0.01}),
          MakeCamera(CameraModel::kOpenCV, {0.1, -0.05, 0.0, 0.0, 0.02, 0.05, -0.01, 0.001}),
          MakeCamera(CameraModel::kFisheye, {0.02, -0.005, 0.001, -0.0002})};
}

TEST(CameraTest, PixelsSurviveTheRoundTrip) {
  Random random(1);
  for (const Camera& camera : Cameras()) {
    for (int i = 0; i < 1000; ++i) {
      const double u = random.Uniform(0.0, 640.0), v = random.Uniform(0.0, 480.0);
      CalibratedPoint point;
      ASSERT_TRUE(PixelToCalibrated(camera, {u, v}, &point)) << u << " " << v;
      Eigen::Vector2d pixel;
      ASSERT_TRUE(CameraToPixel(camera, 3.0 * point.Homogeneous(), &pixel));
      EXPECT_NEAR(pixel.x(), u, 1e-7);
      EXPECT_NEAR(pixel.y(), v, 1e-7);
    }
  }
}

TEST(CameraTest, JacobianMatchesDifferences) {
  Random random(2);
  for (const Camera& camera : Cameras()) {
    for (int i = 0; i < 100; ++i) {
      const Eigen::Vector2d pixel{random.Uniform(0.0, 640.0), random.Uniform(0.0, 480.0)};
      CalibratedPoint point, plus, minus;
      ASSERT_TRUE(PixelToCalibrated(camera, pixel, &point));
      for (int k = 0; k < 2; ++k) {
        constexpr double kStep = 1e-4;
        const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(k);
        ASSERT_TRUE(PixelToCalibrated(camera, pixel + step, &plus));
        ASSERT_TRUE(PixelToCalibrated(camera, pixel - step, &minus));
        const Eigen::Vector2d numeric = (plus.x - minus.x) / (2.0 * kStep);
        EXPECT_NEAR(point.x_from_pixel[static_cast<std::size_t>(k)], numeric.x(), 1e-8);
        EXPECT_NEAR(point.x_from_pixel[static_cast<std::size_t>(2 + k)], numeric.y(), 1e-8);
      }
    }
  }
}

TEST(CameraTest, AgreesWithOpenCVsModels) {
  // cv::projectPoints and cv::fisheye::projectPoints at (0.3, -0.2, 1) for these cameras.
  Eigen::Vector2d pixel;
  ASSERT_TRUE(CameraToPixel(MakeCamera(CameraModel::kOpenCV, {-0.28, 0.08, 1e-3, -5e-4, -0.01}),
                            {0.3, -0.2, 1.0}, &pixel));
  const double r2 = 0.13, radial = 1.0 - 0.28 * r2 + 0.08 * r2 * r2 - 0.01 * r2 * r2 * r2;
  EXPECT_NEAR(pixel.x(),
              321.5 + 500.0 * (0.3 * radial + 2e-3 * 0.3 * -0.2 - 5e-4 * (r2 + 2.0 * 0.09)), 1e-10);
  EXPECT_NEAR(pixel.y(),
              238.5 + 510.0 * (-0.2 * radial + 1e-3 * (r2 + 2.0 * 0.04) - 2.0 * 5e-4 * 0.3 * -0.2),
              1e-10);
  ASSERT_TRUE(CameraToPixel(MakeCamera(CameraModel::kFisheye, {0.02, -0.005, 0.001, -0.0002}),
                            {0.3, -0.2, 1.0}, &pixel));
  const double r = std::sqrt(r2), t = std::atan(r), t2 = t * t;
  const double scale = t * (1.0 + t2 * (0.02 + t2 * (-0.005 + t2 * (0.001 - t2 * 0.0002)))) / r;
  EXPECT_NEAR(pixel.x(), 321.5 + 500.0 * 0.3 * scale, 1e-10);
  EXPECT_NEAR(pixel.y(), 238.5 - 510.0 * 0.2 * scale, 1e-10);
}

TEST(CameraTest, DropsWhatItCannotUndistort) {
  const Camera barrel = MakeCamera(CameraModel::kOpenCV, {-0.3, 0.0, 0.0, 0.0, 0.0});
  // The barrel r (1 - 0.3 r^2) turns back at r = 1.054, 0.703 after distortion: no ray looks like
  // more.
  CalibratedPoint point;
  EXPECT_FALSE(PixelToCalibrated(barrel, {321.5 + 500.0 * 0.71, 238.5}, &point));
  EXPECT_TRUE(PixelToCalibrated(barrel, {321.5 + 500.0 * 0.69, 238.5}, &point));
  EXPECT_NEAR(point.x.x() * (1.0 - 0.3 * point.x.squaredNorm()), 0.69, 1e-9);
  EXPECT_LT(point.x.x(), 1.055);
  Eigen::Vector2d pixel;
  EXPECT_FALSE(CameraToPixel(barrel, {1.2, 0.0, 1.0}, &pixel));
  // Rays 89 degrees off the axis and beyond.
  const Camera pinhole = MakeCamera(CameraModel::kPinhole, {});
  EXPECT_FALSE(CameraToPixel(pinhole, {58.0, 0.0, 1.0}, &pixel));
  EXPECT_FALSE(CameraToPixel(pinhole, {0.0, 0.0, -1.0}, &pixel));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(PixelToCalibrated(pinhole, {nan, 0.0}, &point));
  std::vector<CalibratedPoint> points;
  std::vector<int> indices;
  EXPECT_EQ(PixelsToCalibrated(pinhole, {{1.0, 2.0}, {nan, 0.0}, {3.0, 4.0}}, &points, &indices),
            1);
  EXPECT_EQ(indices, (std::vector<int>{0, 2}));
}

// Wherever the model is one-to-one, the way back is found from the axis.
TEST(CameraTest, UndistortsRationalLensesToTheirEdge) {
  // A rational lens as calibrations of wide-angle cameras report it, and a mild one.
  for (const std::array<double, 8>& k :
       {std::array<double, 8>{8.2, 4.1, 1e-4, -2e-4, 0.12, 8.6, 6.5, 0.9},
        std::array<double, 8>{-0.4, 0.2, 0.0, 0.0, -0.03, -0.1, 0.05, 0.0}}) {
    Camera camera = MakeCamera(CameraModel::kOpenCV, {});
    camera.distortion = k;
    int tried = 0;
    for (double r = 0.0; r < 3.0; r += 0.05) {
      Eigen::Vector2d pixel;
      if (!CameraToPixel(camera, {0.8 * r, -0.6 * r, 1.0}, &pixel)) break;
      CalibratedPoint point;
      ASSERT_TRUE(PixelToCalibrated(camera, pixel, &point)) << r;
      EXPECT_LT((point.x - Eigen::Vector2d(0.8 * r, -0.6 * r)).norm(), 1e-7 * (1.0 + r)) << r;
      ++tried;
    }
    EXPECT_GE(tried, 15);
  }
}

TEST(CameraTest, ValidateNamesTheField) {
  Camera camera = MakeCamera(CameraModel::kPinhole, {});
  EXPECT_TRUE(camera.Validate().ok());
  camera.id = "cam7";
  camera.fx = 0.0;
  EXPECT_CONTAINS(camera.Validate().message, "fx");
  EXPECT_CONTAINS(camera.Validate().message, "cam7");
  for (const double f : {-1.0, 1e-310, 1e300, std::numeric_limits<double>::quiet_NaN()}) {
    camera.fx = f;
    EXPECT_FALSE(camera.Validate().ok()) << f;
  }
  camera.fx = 500.0;
  camera.distortion[3] = std::numeric_limits<double>::infinity();
  EXPECT_CONTAINS(camera.Validate().message, "distortion must be finite");
  camera.distortion[3] = 1e-3;
  EXPECT_CONTAINS(camera.Validate().message, "pinhole camera has no distortion");
  camera.model = CameraModel::kOpenCV;
  EXPECT_TRUE(camera.Validate().ok());
}

}  // namespace
}  // namespace circline
