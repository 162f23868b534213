#include "apps/compare/encode.h"

#include <gtest/gtest.h>

#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/basics.h"

namespace circline::apps {
namespace {

cv::Mat Grey(int width, int height) { return cv::Mat(height, width, CV_8U, cv::Scalar(90)); }

std::string ErrorOf(const std::function<std::string()>& encode) {
  try {
    encode();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(Encode, PicturesComeBack) {
  for (const std::string& file : {EncodePng(Grey(40, 30)), EncodeJpeg(Grey(80, 60), 40)}) {
    const std::vector<char> bytes(file.begin(), file.end());
    const cv::Mat picture = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
    EXPECT_EQ(picture.size(), cv::Size(40, 30));
    EXPECT_EQ(cv::norm(picture, Grey(40, 30), cv::NORM_INF), 0.0);
  }
}

TEST(Encode, SaysWhichPictureTheFormatCannotHold) {
  EXPECT_EQ(ErrorOf([] { return EncodePng(Grey(1000001, 1)); }),
            "a picture of 1000001 x 1 pixels cannot be a .png file");
  EXPECT_EQ(ErrorOf([] { return EncodeJpeg(Grey(1, 65501), 65501); }),
            "a picture of 1 x 65501 pixels cannot be a .jpg file");
  EXPECT_CONTAINS(ErrorOf([] { return EncodePng(cv::Mat()); }), "0 x 0 pixels");
}

}  // namespace
}  // namespace circline::apps
