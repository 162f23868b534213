// Pictures as the bytes of a file. Throws std::runtime_error where a picture is empty or has more
// rows or columns than the format takes: a million in a PNG, 65500 in a JPEG.
#ifndef CIRCLINE_APPS_COMPARE_ENCODE_H_
#define CIRCLINE_APPS_COMPARE_ENCODE_H_

#include <opencv2/core.hpp>
#include <string>

namespace circline::apps {

std::string EncodePng(const cv::Mat& picture);
// At most `max_width` pixels wide.
std::string EncodeJpeg(const cv::Mat& picture, int max_width);
// The same of a picture's file; empty where there is none.
std::string JpegOfFile(const std::string& path, int max_width);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_ENCODE_H_
