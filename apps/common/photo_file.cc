#include "apps/common/photo_file.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "apps/common/text.h"

namespace circline::apps {

bool IsCutOffJpeg(const std::vector<std::uint8_t>& bytes) {
  constexpr std::uint8_t kMarker = 0xFF, kStart = 0xD8, kStartOfScan = 0xDA;
  constexpr std::array<std::uint8_t, 2> kEnd = {kMarker, 0xD9};
  if (bytes.size() < 2 || bytes[0] != kMarker || bytes[1] != kStart) return false;
  // From one segment to the next, each with its length, to the first scan; a thumbnail within a
  // segment has an end of its own. In a scan the marker of the end cannot be but the end.
  for (std::size_t i = 2; i + 4 <= bytes.size() && bytes[i] == kMarker;) {
    if (bytes[i + 1] == kStartOfScan) {
      const auto scan = bytes.begin() + static_cast<std::ptrdiff_t>(i);
      return std::search(scan, bytes.end(), kEnd.begin(), kEnd.end()) == bytes.end();
    }
    const bool padding = bytes[i + 1] == kMarker;
    i += padding ? 1U : 2U + 256U * bytes[i + 2] + bytes[i + 3];
  }
  return true;
}

std::string ReadPhoto(const std::string& path, cv::Mat* photo, double max_megapixels) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (!fs::exists(path, error)) return "the file does not exist";
  if (fs::is_directory(path, error)) return "is a folder, not a photo";
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) return "is not a file that can be read: " + error.message();
  std::ifstream file(path, std::ios::binary);
  if (!file) return "cannot be opened";
  std::vector<std::uint8_t> bytes(size);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!file) return "cannot be read to its end";
  if (bytes.empty()) return "the file is empty";
  if (IsCutOffJpeg(bytes)) return "is cut off: the end of the JPEG is missing";
  try {
    *photo = cv::imdecode(bytes, cv::IMREAD_ANYCOLOR);
  } catch (const std::exception&) {
    photo->release();
  }
  if (photo->empty()) return "is not an image that can be read";
  if (static_cast<double>(photo->total()) <= 1e6 * max_megapixels) return "";
  photo->release();
  return "has more than " + FormatPlain(max_megapixels) + " megapixels";
}

}  // namespace circline::apps
