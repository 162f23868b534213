#include "apps/common/photo_file.h"

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "apps/common/jpeg_file.h"
#include "apps/common/text.h"

namespace circline::apps {

std::string ReadPhoto(const std::string& path, cv::Mat* photo, double max_megapixels) {
  namespace fs = std::filesystem;
  // Four channels of 32 bits, without compression; what is told beside the picture.
  constexpr double kMaxPixelBytes = 16.0, kMaxOtherBytes = 1e8;
  std::error_code error;
  if (!fs::exists(path, error)) return "the file does not exist";
  if (fs::is_directory(path, error)) return "is a folder, not a photo";
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) return "is not a file that can be read: " + error.message();
  if (static_cast<double>(size) > kMaxPixelBytes * 1e6 * max_megapixels + kMaxOtherBytes)
    return "is larger than a photo of " + FormatPlain(max_megapixels) + " megapixels can be";
  std::ifstream file(path, std::ios::binary);
  if (!file) return "cannot be opened";
  std::vector<std::uint8_t> bytes(size);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!file) return "cannot be read to its end";
  if (bytes.empty()) return "the file is empty";
  const std::string damage = IsJpeg(bytes) ? JpegDamage(bytes, max_megapixels) : "";
  if (!damage.empty()) return damage;
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
