#include "apps/common/camera_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <string>
#include <vector>

#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

std::vector<Camera> Read(const std::string& content) {
  const TestFolder folder;
  std::vector<Camera> cameras;
  const Status status = ReadCameraFile(folder.Write("camera", content), &cameras);
  EXPECT_TRUE(status.ok()) << status.message;
  return cameras;
}

std::string ErrorOf(const std::string& content) {
  const TestFolder folder;
  std::vector<Camera> cameras;
  const Status status = ReadCameraFile(folder.Write("camera", content), &cameras);
  EXPECT_FALSE(status.ok());
  EXPECT_TRUE(cameras.empty());
  EXPECT_CONTAINS(status.message, folder / "camera");
  return status.message;
}

const char kCalibration[] = R"(%YAML:1.0
---
calibration_time: "Mon"
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 500.5, 0., 320., 0., 501., 240., 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -0.2, 0.1, 1e-3, -2e-3, 0.05 ]
)";

TEST(CameraFile, ReadsAnOpenCvCalibration) {
  const std::vector<Camera> cameras = Read(kCalibration);
  ASSERT_EQ(cameras.size(), 1U);
  EXPECT_EQ(cameras[0].model, CameraModel::kOpenCV);
  EXPECT_EQ(cameras[0].width, 640);
  EXPECT_EQ(cameras[0].height, 480);
  EXPECT_EQ(cameras[0].fx, 500.5);
  EXPECT_EQ(cameras[0].cy, 240.0);
  EXPECT_EQ(cameras[0].distortion, (std::array<double, 8>{-0.2, 0.1, 1e-3, -2e-3, 0.05, 0, 0, 0}));
}

// What can be read once only, as of --camera=<(...).
TEST(CameraFile, ReadsAPipe) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  const std::string text = kCalibration;
  ASSERT_EQ(write(ends[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
  close(ends[1]);
  std::vector<Camera> cameras;
  const Status status = ReadCameraFile("/dev/fd/" + std::to_string(ends[0]), &cameras);
  close(ends[0]);
  ASSERT_TRUE(status.ok()) << status.message;
  EXPECT_EQ(cameras[0].fx, 500.5);
}

TEST(CameraFile, ReadsAFisheyeCalibration) {
  const std::vector<Camera> cameras = Read(
      "fisheye_model: 1\ncamera_matrix: [300, 0, 320, 0, 300, 240, 0, 0, 1]\n"
      "distortion_coefficients: [0.1, 0.2, 0.3, 0.4]\n");
  ASSERT_EQ(cameras.size(), 1U);
  EXPECT_EQ(cameras[0].model, CameraModel::kFisheye);
  EXPECT_EQ(cameras[0].distortion[3], 0.4);
}

// As ROS and Kalibr name it.
TEST(CameraFile, TheDistortionHasAName) {
  const auto text = [](const std::string& model) {
    return "distortion_model: " + model +
           "\ncamera_matrix: [300, 0, 320, 0, 300, 240, 0, 0, 1]\n"
           "distortion_coefficients: [0.1, 0.2, 0.3, 0.4]\n";
  };
  for (const char* model : {"equidistant", "fisheye"})
    EXPECT_EQ(Read(text(model)).at(0).model, CameraModel::kFisheye) << model;
  for (const char* model : {"plumb_bob", "radtan", "rational_polynomial", "\"\""})
    EXPECT_EQ(Read(text(model)).at(0).model, CameraModel::kOpenCV) << model;
  EXPECT_EQ(Read("fisheye_model: 1\n" + text("equidistant")).at(0).model, CameraModel::kFisheye);
  EXPECT_CONTAINS(ErrorOf(text("equidistent")),
                  "distortion_model: 'equidistent' is not one of plumb_bob, radtan");
  EXPECT_CONTAINS(ErrorOf("fisheye_model: 1\n" + text("radtan")),
                  "'radtan' is not the fisheye model");
}

TEST(CameraFile, ReadsColmapCamerasWithTheirPixelCentres) {
  const std::vector<Camera> cameras = Read(
      "# Camera list with one line of data per camera:\n"
      "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
      "1 SIMPLE_PINHOLE 640 480 500 320.5 240.5\n"
      "2 PINHOLE 640 480 500 501 320.5 240.5\n"
      "3 SIMPLE_RADIAL 640 480 500 320.5 240.5 0.1\n"
      "4 RADIAL 640 480 500 320.5 240.5 0.1 0.2\n"
      "5 OPENCV 640 480 500 501 320.5 240.5 0.1 0.2 0.3 0.4\n"
      "6 FULL_OPENCV 640 480 500 501 320.5 240.5 0.1 0.2 0.3 0.4 0.5 0.6 0.7 0.8\n"
      "7 OPENCV_FISHEYE 640 480 500 501 320.5 240.5 0.1 0.2 0.3 0.4\n");
  ASSERT_EQ(cameras.size(), 7U);
  const std::vector<CameraModel> models = {
      CameraModel::kPinhole, CameraModel::kPinhole, CameraModel::kOpenCV, CameraModel::kOpenCV,
      CameraModel::kOpenCV,  CameraModel::kOpenCV,  CameraModel::kFisheye};
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    EXPECT_EQ(cameras[i].id, std::to_string(i + 1));
    EXPECT_EQ(cameras[i].model, models[i]);
    EXPECT_EQ(cameras[i].fx, 500.0);
    EXPECT_EQ(cameras[i].fy, i == 1 || i > 3 ? 501.0 : 500.0);
    EXPECT_EQ(cameras[i].cx, 320.0);
    EXPECT_EQ(cameras[i].cy, 240.0);
  }
  EXPECT_EQ(cameras[2].distortion[0], 0.1);
  EXPECT_EQ(cameras[3].distortion[1], 0.2);
  EXPECT_EQ(cameras[4].distortion[3], 0.4);
  EXPECT_EQ(cameras[5].distortion[7], 0.8);
  EXPECT_EQ(cameras[6].distortion[2], 0.3);
}

TEST(CameraFile, NamesWhatIsWrong) {
  EXPECT_CONTAINS(ErrorOf("image_width: 640\ncamera_matrx: [1]\n"), "neither");
  EXPECT_CONTAINS(ErrorOf("%YAML:1.0\n---\nimage_width: 640\n"),
                  "'camera_matrix' is missing: a camera needs its focal length");
  EXPECT_CONTAINS(ErrorOf("%YAML:1.0\n---\ncamera_matrix: [0, 0, 320, 0, 0, 240, 0, 0, 1]\n"),
                  "camera_matrix: focal lengths");
  EXPECT_CONTAINS(ErrorOf("1 SIMPLE_PINHOLE 640 480 500 320\n"),
                  "line 1: SIMPLE_PINHOLE has 3 parameters");
  EXPECT_CONTAINS(ErrorOf("\n1 FOV 640 480 500 500 320 240 0.1\n"), "line 2: camera model 'FOV'");
  EXPECT_CONTAINS(ErrorOf("1 SIMPLE_PINHOLE 640 480 -500 320 240\n"), "line 1: ");
  EXPECT_CONTAINS(ErrorOf("1 SIMPLE_PINHOLE 640 480 x 320 240\n"), "'x' is no number");
  EXPECT_CONTAINS(ErrorOf("1 SIMPLE_PINHOLE 640 480 5 3 2\n1 SIMPLE_PINHOLE 640 480 5 3 2\n"),
                  "twice");
  EXPECT_CONTAINS(ErrorOf("# nothing\n"), "has no camera");
  std::vector<Camera> cameras;
  EXPECT_CONTAINS(ReadCameraFile("/nonexistent", &cameras).message, "cannot be opened");
}

}  // namespace
}  // namespace circline::apps
