#include "apps/compare/encode.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <vector>

namespace circline::apps {
namespace {

std::string Encode(const std::string& extension, const cv::Mat& picture,
                   const std::vector<int>& parameters = {}) {
  std::vector<std::uint8_t> bytes;
  try {
    if (cv::imencode(extension, picture, bytes, parameters)) return {bytes.begin(), bytes.end()};
  } catch (const cv::Exception& error) {  // Of most it says no more than where it was noticed.
    if (error.code == cv::Error::StsNoMem) throw;
  }
  throw std::runtime_error("a picture of " + std::to_string(picture.cols) + " x " +
                           std::to_string(picture.rows) + " pixels cannot be a " + extension +
                           " file");
}

}  // namespace

std::string EncodePng(const cv::Mat& picture) {
  // OpenCV's default (zlib's fastest level on differences of neighbours): every other level and
  // strategy takes 1.3 to 2 times as long, for files up to a tenth smaller.
  return Encode(".png", picture);
}

std::string EncodeJpeg(const cv::Mat& picture, int max_width) {
  constexpr int kMaxRatio = 8;  // Of height to width; a JPEG has 65500 rows at most.
  const double scale = std::min({1.0, static_cast<double>(max_width) / picture.cols,
                                 static_cast<double>(kMaxRatio * max_width) / picture.rows});
  const auto scaled = [scale](int side) {
    return std::max(1, static_cast<int>(std::lround(side * scale)));
  };
  cv::Mat small = picture;
  if (scale < 1.0)
    cv::resize(picture, small, {scaled(picture.cols), scaled(picture.rows)}, 0.0, 0.0,
               cv::INTER_AREA);
  return Encode(".jpg", small, {cv::IMWRITE_JPEG_QUALITY, 82});
}

std::string JpegOfFile(const std::string& path, int max_width) {
  const cv::Mat picture = cv::imread(path, cv::IMREAD_COLOR);
  return picture.empty() ? "" : EncodeJpeg(picture, max_width);
}

}  // namespace circline::apps
