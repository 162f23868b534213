#include "apps/common/photo_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

// A picture with enough in it that its file has a middle.
cv::Mat Texture() {
  cv::Mat picture(60, 80, CV_8UC3);
  for (int v = 0; v < picture.rows; ++v) {
    for (int u = 0; u < picture.cols; ++u) {
      const int value = (u * u + 7 * v * v) % 256;
      picture.at<cv::Vec3b>(v, u) = {static_cast<std::uint8_t>(value), 90, 200};
    }
  }
  return picture;
}

std::vector<std::uint8_t> Encoded(const std::string& extension, const cv::Mat& picture) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(extension, picture, bytes);
  return bytes;
}

class PhotoFile : public testing::Test {
 protected:
  std::string Read(const std::vector<std::uint8_t>& bytes) {
    return ReadPhoto(folder_.Write("photo", std::string(bytes.begin(), bytes.end())), &photo_);
  }
  const TestFolder folder_;
  cv::Mat photo_;
};

TEST_F(PhotoFile, RefusesMoreMegapixelsThanAsked) {
  const std::vector<std::uint8_t> bytes = Encoded(".png", cv::Mat(1001, 1000, CV_8U, 7.0));
  const std::string path = folder_.Write("photo", std::string(bytes.begin(), bytes.end()));
  EXPECT_EQ(ReadPhoto(path, &photo_, 1.0), "has more than 1 megapixels");
  EXPECT_TRUE(photo_.empty());
  EXPECT_EQ(ReadPhoto(path, &photo_, 1.01), "");
}

// Such as a disk's image in a folder of photos, which would fill the memory.
TEST_F(PhotoFile, RefusesLargeFilesUnread) {
  const std::string path = folder_.Write("huge.png", "x");
  std::filesystem::resize_file(path, std::uintmax_t{1} << 40);
  EXPECT_EQ(ReadPhoto(path, &photo_), "is larger than a photo of 100 megapixels can be");
}

// OpenCV reads some, and warns of the others on stderr.
TEST_F(PhotoFile, SaysWhatToDoWithATiffOfFloats) {
  for (const int depth : {CV_32F, CV_64F}) {
    cv::Mat grey;
    cv::extractChannel(Texture(), grey, 0);
    grey.convertTo(grey, depth);
    testing::internal::CaptureStderr();
    EXPECT_CONTAINS(Read(Encoded(".tiff", grey)), "save it with 8 or 16 bits");
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_TRUE(photo_.empty());
  }
}

std::string LittleEndian(std::size_t number, int bytes) {
  std::string text;
  for (int k = 0; k < bytes; ++k) text += static_cast<char>(number >> 8 * k & 0xFF);
  return text;
}

// A lossless WebP, with EXIF data that say how it lies.
std::vector<std::uint8_t> TurnedWebp(const cv::Mat& picture, std::size_t orientation) {
  std::vector<std::uint8_t> plain;
  cv::imencode(".webp", picture, plain, {cv::IMWRITE_WEBP_QUALITY, 101});
  const auto columns = static_cast<std::size_t>(picture.cols),
             rows = static_cast<std::size_t>(picture.rows);
  constexpr std::size_t kHasExif = 8, kOrientation = 0x112, kShort = 3;
  // A TIFF of one entry.
  const std::string exif = "II" + LittleEndian(42, 2) + LittleEndian(8, 4) + LittleEndian(1, 2) +
                           LittleEndian(kOrientation, 2) + LittleEndian(kShort, 2) +
                           LittleEndian(1, 4) + LittleEndian(orientation, 4) + LittleEndian(0, 4);
  const std::string body = "WEBPVP8X" + LittleEndian(10, 4) + LittleEndian(kHasExif, 4) +
                           LittleEndian(columns - 1, 3) + LittleEndian(rows - 1, 3) +
                           std::string(plain.begin() + 12, plain.end()) + "EXIF" +
                           LittleEndian(exif.size(), 4) + exif;
  const std::string file = "RIFF" + LittleEndian(body.size(), 4) + body;
  return {file.begin(), file.end()};
}

TEST_F(PhotoFile, TurnsAWebpAsItsExifDataSay) {
  const cv::Mat picture = Texture();
  for (std::size_t orientation = 1; orientation <= 8; ++orientation) {
    EXPECT_EQ(Read(TurnedWebp(picture, orientation)), "");
    ASSERT_EQ(photo_.size(), orientation > 4 ? cv::Size(60, 80) : cv::Size(80, 60)) << orientation;
    // EXIF says where row 0 and column 0 of the file are to be seen.
    const bool row_is_right = orientation == 6 || orientation == 7,
               column_is_right = orientation == 2 || orientation == 3,
               row_is_bottom = orientation == 3 || orientation == 4,
               column_is_bottom = orientation == 7 || orientation == 8;
    const cv::Point corner(row_is_right || column_is_right ? photo_.cols - 1 : 0,
                           row_is_bottom || column_is_bottom ? photo_.rows - 1 : 0);
    const cv::Point along = orientation > 4
                                ? cv::Point(corner.x, corner.y + (column_is_bottom ? -9 : 9))
                                : cv::Point(corner.x + (column_is_right ? -9 : 9), corner.y);
    EXPECT_EQ(photo_.at<cv::Vec3b>(corner), picture.at<cv::Vec3b>(0, 0)) << orientation;
    EXPECT_EQ(photo_.at<cv::Vec3b>(along), picture.at<cv::Vec3b>(0, 9)) << orientation;
  }
}

TEST_F(PhotoFile, ReadsWhateverDepthAndChannels) {
  for (const char* extension : {".jpg", ".png", ".bmp", ".tiff"}) {
    EXPECT_EQ(Read(Encoded(extension, Texture())), "") << extension;
    EXPECT_EQ(photo_.type(), CV_8UC3) << extension;
  }
  cv::Mat grey, deep, with_alpha;
  cv::extractChannel(Texture(), grey, 0);
  EXPECT_EQ(Read(Encoded(".png", grey)), "");
  EXPECT_EQ(photo_.type(), CV_8UC1);
  grey.convertTo(deep, CV_16U, 257.0);
  EXPECT_EQ(Read(Encoded(".png", deep)), "");
  EXPECT_EQ(photo_.depth(), CV_8U);
  EXPECT_EQ(cv::norm(photo_, grey, cv::NORM_INF), 0.0);
  // Of 12 bits, or of 8, in 16.
  for (const double scale : {16.0, 1.0}) {
    grey.convertTo(deep, CV_16U, scale);
    for (const char* extension : {".png", ".tiff"}) {
      EXPECT_EQ(Read(Encoded(extension, deep)), "");
      EXPECT_EQ(photo_.type(), CV_8UC1) << extension;
      EXPECT_LE(cv::norm(photo_, grey, cv::NORM_INF), 1.0) << extension << " " << scale;
    }
  }
  cv::merge(std::vector<cv::Mat>{grey, grey, grey, grey}, with_alpha);
  EXPECT_EQ(Read(Encoded(".png", with_alpha)), "");
  EXPECT_EQ(photo_.type(), CV_8UC3);
}

TEST_F(PhotoFile, SaysWhatIsWrong) {
  EXPECT_EQ(ReadPhoto(folder_ / "none.jpg", &photo_), "the file does not exist");
  EXPECT_EQ(ReadPhoto(folder_.path(), &photo_), "is a folder, not a photo");
  ASSERT_EQ(mkfifo((folder_ / "pipe.jpg").c_str(), 0600), 0);
  EXPECT_CONTAINS(ReadPhoto(folder_ / "pipe.jpg", &photo_), "is not a file that can be read");
  EXPECT_EQ(Read({}), "the file is empty");
  EXPECT_EQ(Read({1, 2, 3, 4}), "is not an image that can be read");
}

// A decoder would give half a picture.
TEST_F(PhotoFile, FindsWhatIsCutOff) {
  for (const char* extension : {".jpg", ".png"}) {
    std::vector<std::uint8_t> bytes = Encoded(extension, Texture());
    bytes.resize(bytes.size() / 2);
    EXPECT_NE(Read(bytes), "") << extension;
  }
  // The end of a thumbnail is not that of the photo.
  std::vector<std::uint8_t> photo = Encoded(".jpg", Texture());
  const std::vector<std::uint8_t> thumbnail = Encoded(".jpg", Texture()(cv::Rect(0, 0, 16, 16)));
  std::vector<std::uint8_t> segment = {0xFF, 0xE1,
                                       static_cast<std::uint8_t>((thumbnail.size() + 2) / 256),
                                       static_cast<std::uint8_t>((thumbnail.size() + 2) % 256)};
  segment.insert(segment.end(), thumbnail.begin(), thumbnail.end());
  photo.insert(photo.begin() + 2, segment.begin(), segment.end());
  EXPECT_EQ(Read(photo), "");
  photo.resize(photo.size() - 2);
  EXPECT_CONTAINS(Read(photo), "is damaged or cut off: ");
  photo.resize(segment.size() + 10);  // Before the first scan.
  EXPECT_CONTAINS(Read(photo), "is damaged or cut off: ");
}

TEST_F(PhotoFile, FindsWhatIsDamaged) {
  cv::Mat large;
  cv::resize(Texture(), large, {640, 480});
  const std::vector<std::uint8_t> whole = Encoded(".jpg", large);
  std::mt19937 random(1);
  int named = 0;
  constexpr int kPhotos = 50, kBytes = 1000;
  for (int i = 0; i < kPhotos; ++i) {
    std::vector<std::uint8_t> photo = whole;
    const std::size_t at = photo.size() / 4 + random() % (photo.size() / 2);
    for (std::size_t k = at; k < at + kBytes; ++k) photo[k] = static_cast<std::uint8_t>(random());
    named += Read(photo).empty() ? 0 : 1;
  }
  EXPECT_GE(named, kPhotos * 9 / 10);  // Some bytes make another picture as good.
}

// Its header says so: nothing is decoded.
TEST_F(PhotoFile, RefusesAJpegOfManyPixelsUndecoded) {
  std::vector<std::uint8_t> photo = Encoded(".jpg", Texture());
  const std::vector<std::uint8_t> size = {0x00, 60, 0x00, 80};
  const auto at = std::search(photo.begin(), photo.end(), size.begin(), size.end());
  ASSERT_NE(at, photo.end());
  std::fill(at, at + 4, 0xFA);
  EXPECT_EQ(Read(photo), "has more than 100 megapixels");
}

}  // namespace
}  // namespace circline::apps
