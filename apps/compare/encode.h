// Pictures as the bytes of a file.
#ifndef CIRCLINE_APPS_COMPARE_ENCODE_H_
#define CIRCLINE_APPS_COMPARE_ENCODE_H_

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace circline::apps {

std::vector<std::uint8_t> EncodePng(const cv::Mat& picture);
// At most `max_width` pixels wide.
std::vector<std::uint8_t> EncodeJpeg(const cv::Mat& picture, int max_width);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_ENCODE_H_
