// Reading photos, of which any may be broken.
#ifndef CIRCLINE_APPS_COMMON_PHOTO_FILE_H_
#define CIRCLINE_APPS_COMMON_PHOTO_FILE_H_

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace circline::apps {

// Larger photos are refused where nobody says otherwise: 100 megapixels take some 2 GB in
// detection.
constexpr double kMaxMegapixels = 100.0;

// Grey or colour, 8 bits a channel, turned as its EXIF data say; of 16 bits, those that the photo
// uses are scaled to 8. Returns what is wrong with the file, in words; empty: nothing.
std::string ReadPhoto(const std::string& path, cv::Mat* photo,
                      double max_megapixels = kMaxMegapixels);

// Of a file as it lies there, to tell whether it has changed: its size and when it was last
// written, in ticks of the file clock. Both 0 where there is none.
struct FileState {
  std::uint64_t bytes = 0;
  std::int64_t written = 0;

  bool operator==(const FileState& other) const {
    return bytes == other.bytes && written == other.written;
  }
};
FileState StateOf(const std::string& path);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_PHOTO_FILE_H_
