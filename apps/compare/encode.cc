#include "apps/compare/encode.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace circline::apps {

std::string EncodePng(const cv::Mat& picture) {
  std::vector<std::uint8_t> bytes;
  // OpenCV's default (zlib's fastest level on differences of neighbours): every other level and
  // strategy takes 1.3 to 2 times as long, for files up to a tenth smaller.
  cv::imencode(".png", picture, bytes);
  return {bytes.begin(), bytes.end()};
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
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", small, bytes, {cv::IMWRITE_JPEG_QUALITY, 82});
  return {bytes.begin(), bytes.end()};
}

std::string JpegOfFile(const std::string& path, int max_width) {
  const cv::Mat picture = cv::imread(path, cv::IMREAD_COLOR);
  return picture.empty() ? "" : EncodeJpeg(picture, max_width);
}

}  // namespace circline::apps
