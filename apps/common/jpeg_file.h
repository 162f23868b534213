// Whether a JPEG is whole: decoders pass over what is damaged with half a picture.
#ifndef CIRCLINE_APPS_COMMON_JPEG_FILE_H_
#define CIRCLINE_APPS_COMMON_JPEG_FILE_H_

#include <cstdint>
#include <string>
#include <vector>

namespace circline::apps {

bool IsJpeg(const std::vector<std::uint8_t>& bytes);

// What is wrong with a JPEG, in words; empty: nothing. The picture is not made, and of one with
// more pixels only the header is read.
std::string JpegDamage(const std::vector<std::uint8_t>& bytes, double max_megapixels);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_JPEG_FILE_H_
