// Models of COLMAP's as they come, cut off, and of nonsense.
#include "apps/common/colmap_file.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <string>

#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

// Bytes of a little-endian number.
template <typename T>
std::string Bytes(T value) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  return bytes;
}

std::string BinaryCameras(std::uint32_t model = 2, double focal = 500.0) {
  return Bytes<std::uint64_t>(1) + Bytes<std::uint32_t>(7) + Bytes(model) +
         Bytes<std::uint64_t>(640) + Bytes<std::uint64_t>(480) + Bytes(focal) + Bytes(320.0) +
         Bytes(240.0) + Bytes(-0.1);
}

std::string BinaryImages(double qw = 1.0, std::uint32_t camera = 7, std::uint64_t points = 2) {
  std::string bytes = Bytes<std::uint64_t>(1) + Bytes<std::uint32_t>(3);
  for (const double value : {qw, 0.0, 0.0, 0.0, 0.1, 0.2, 0.3}) bytes += Bytes(value);
  bytes += Bytes(camera) + std::string("left/a.jpg") + '\0' + Bytes(points);
  return bytes + std::string(48, '\0');
}

class ColmapFile : public testing::Test {
 protected:
  Status ReadBinary(const std::string& cameras, const std::string& images) {
    folder_.Write("cameras.bin", cameras);
    folder_.Write("images.bin", images);
    return ReadColmapModel(folder_.path(), &model_);
  }
  Status ReadText(const std::string& cameras, const std::string& images) {
    folder_.Write("cameras.txt", cameras);
    folder_.Write("images.txt", images);
    return ReadColmapModel(folder_.path(), &model_);
  }

  const TestFolder folder_;
  ColmapModel model_;
};

TEST_F(ColmapFile, BinaryAndTextSayTheSame) {
  const auto expect = [this](const Status& status) {
    ASSERT_TRUE(status.ok()) << status.message;
    ASSERT_EQ(model_.cameras.size(), 1U);
    EXPECT_EQ(model_.cameras[0].id, "7");
    EXPECT_EQ(model_.cameras[0].width, 640);
    EXPECT_EQ(model_.cameras[0].fx, 500.0);
    EXPECT_EQ(model_.cameras[0].cx, 319.5);
    EXPECT_EQ(model_.cameras[0].distortion[0], -0.1);
    ASSERT_EQ(model_.images.size(), 1U);
    EXPECT_EQ(model_.images[0].name, "left/a.jpg");
    EXPECT_EQ(model_.images[0].cam_from_world.translation, Eigen::Vector3d(0.1, 0.2, 0.3));
  };
  expect(ReadText("# comment\n7 SIMPLE_RADIAL 640 480 500 320 240 -0.1\n",
                  "# comment\n3 1 0 0 0 0.1 0.2 0.3 7 left/a.jpg\n1.5 2.5 -1\n"));
  expect(ReadBinary(BinaryCameras(), BinaryImages()));
}

// At every length.
TEST_F(ColmapFile, WhatIsCutOffIsNamed) {
  const std::string cameras = BinaryCameras(), images = BinaryImages();
  for (std::size_t size = 0; size < cameras.size(); ++size) {
    const Status status = ReadBinary(cameras.substr(0, size), images);
    EXPECT_CONTAINS(status.message, "cameras.bin") << size;
  }
  for (std::size_t size = 0; size + 48 < images.size(); ++size) {
    const Status status = ReadBinary(cameras, images.substr(0, size));
    EXPECT_CONTAINS(status.message, "images.bin") << size;
  }
}

TEST_F(ColmapFile, NonsenseIsNamed) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_CONTAINS(ReadBinary(BinaryCameras(99), BinaryImages()).message, "number 99");
  EXPECT_CONTAINS(ReadBinary(BinaryCameras(7), BinaryImages()).message, "'FOV' is not one of");
  EXPECT_CONTAINS(ReadBinary(BinaryCameras(2, kNan), BinaryImages()).message, "camera 7");
  EXPECT_CONTAINS(ReadBinary(BinaryCameras(), BinaryImages(kNan)).message, "unit quaternion");
  EXPECT_CONTAINS(ReadBinary(BinaryCameras(), BinaryImages(0.0)).message, "unit quaternion");
  EXPECT_CONTAINS(ReadBinary(BinaryCameras(), BinaryImages(1.0, 8)).message, "no camera 8");
  const std::uint64_t most = std::numeric_limits<std::uint64_t>::max();
  EXPECT_CONTAINS(ReadBinary(BinaryCameras(), BinaryImages(1.0, 7, most)).message, "cut off");
  EXPECT_CONTAINS(ReadBinary(Bytes(most), BinaryImages()).message, "cut off");
}

TEST_F(ColmapFile, NonsenseInTextIsNamedWithItsLine) {
  const std::string cameras = "7 PINHOLE 640 480 500 500 320 240\n";
  const std::string image = "3 1 0 0 0 0.1 0.2 0.3 7 a.jpg\n\n";
  EXPECT_TRUE(ReadText(cameras, image).ok());
  EXPECT_CONTAINS(ReadText(cameras, image + image).message,
                  "line 3: image a.jpg stands there twice");
  EXPECT_CONTAINS(ReadText(cameras, "3 1 0 0 0 0.1 nan 0.3 7 a.jpg\n\n").message, "line 1");
  EXPECT_CONTAINS(ReadText(cameras, "3 1 0 0 0 0.1\n").message, "QW QX QY QZ");
  EXPECT_CONTAINS(ReadText(cameras, "# nothing\n").message, "no image");
  EXPECT_CONTAINS(ReadText(cameras + cameras, image).message, "twice");
  EXPECT_CONTAINS(ReadColmapModel(folder_ / "nowhere", &model_).message, "no COLMAP model");
}

}  // namespace
}  // namespace circline::apps
