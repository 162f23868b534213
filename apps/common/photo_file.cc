#include "apps/common/photo_file.h"

// clang-format off: jpeglib.h takes FILE and size_t for declared.
#include <jerror.h>
#include <jpeglib.h>

#include <cstdio>
// clang-format on

#include <array>
#include <csetjmp>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "apps/common/exif.h"
#include "apps/common/text.h"

namespace circline::apps {
namespace {

// libjpeg is told to go on with the next line by returning, and to stop by a jump: it is C.
struct Errors : jpeg_error_mgr {
  std::jmp_buf end;
  std::array<char, JMSG_LENGTH_MAX> sentence;
};

[[noreturn]] void Stop(j_common_ptr jpeg) {
  auto* errors = static_cast<Errors*>(jpeg->err);
  errors->format_message(jpeg, errors->sentence.data());
  std::longjmp(errors->end, 1);  // NOLINT(cert-err52-cpp)
}

// Warnings have a level below 0. Some cameras leave bytes between the picture and its end.
void StopAtWarning(j_common_ptr jpeg, int level) {
  constexpr int kPaddingBytes = 8;
  const bool is_padding =
      jpeg->err->msg_code == JWRN_EXTRANEOUS_DATA && jpeg->err->msg_parm.i[0] <= kPaddingBytes;
  const bool is_color = jpeg->err->msg_code == JWRN_ADOBE_XFORM;
  if (level < 0 && !is_padding && !is_color) Stop(jpeg);
}

bool IsJpeg(const std::vector<std::uint8_t>& bytes) {
  return bytes.size() >= 2 && bytes[0] == 0xFF && bytes[1] == 0xD8;
}

// What is wrong with a JPEG, in words; empty: nothing. Decoders pass over what is damaged with half
// a picture. The picture is not made, and of one with more pixels only the header is read.
std::string JpegDamage(const std::vector<std::uint8_t>& bytes, double max_megapixels) {
  Errors errors;
  errors.sentence[0] = '\0';
  jpeg_decompress_struct jpeg;
  jpeg.err = jpeg_std_error(&errors);
  errors.error_exit = Stop;
  errors.emit_message = StopAtWarning;
  bool is_large = false;
  jpeg_create_decompress(&jpeg);
  if (setjmp(errors.end) == 0) {  // NOLINT(cert-err52-cpp)
    jpeg_mem_src(&jpeg, bytes.data(), bytes.size());
    jpeg_read_header(&jpeg, TRUE);
    if (1.0 * jpeg.image_width * jpeg.image_height > 1e6 * max_megapixels) {
      is_large = true;
    } else {
      jpeg_read_coefficients(&jpeg);
      jpeg_finish_decompress(&jpeg);
    }
  }
  jpeg_destroy_decompress(&jpeg);
  if (is_large) return "has more than " + FormatPlain(max_megapixels) + " megapixels";
  const std::string sentence = errors.sentence.data();
  return sentence.empty() ? "" : "is damaged or cut off: " + sentence;
}

// A picture of 16 bits as one of 8. Cameras of 10 or 12 bits leave the upper ones empty: white is
// taken to be the largest number of as many bits as the brightest pixel has.
void ToEightBits(cv::Mat* photo) {
  double brightest = 0.0;
  cv::minMaxLoc(photo->reshape(1), nullptr, &brightest);
  double white = 255.0;
  while (white < brightest) white = 2.0 * white + 1.0;
  photo->convertTo(*photo, CV_8U, 255.0 / white);
}

// By EXIF's number for how a picture lies: 2 to 4 are flips, 5 to 8 the same of it transposed.
void Turn(int orientation, cv::Mat* photo) {
  if (orientation > 4) cv::transpose(*photo, *photo);
  constexpr std::array kFlips = {1, -1, 0};  // OpenCV's numbers: across, both ways, upside down.
  const int flip = (orientation - 1) % 4;
  if (flip > 0) cv::flip(*photo, *photo, kFlips[static_cast<std::size_t>(flip - 1)]);
}

// What is wrong with a file's picture, in words; empty: nothing. OpenCV turns a JPEG or PNG as its
// EXIF data say; a WebP only some versions do, so that it is told not to. Of other formats of
// floats it makes 8 bits when asked again; of a TIFF it warns, and makes nothing.
std::string Decode(const std::vector<std::uint8_t>& bytes, cv::Mat* photo) {
  const int orientation = WebpOrientation(bytes),
            flags = orientation > 1 ? cv::IMREAD_ANYCOLOR | cv::IMREAD_IGNORE_ORIENTATION
                                    : cv::IMREAD_ANYCOLOR;
  const bool is_tiff =
      bytes.size() >= 2 && bytes[0] == bytes[1] && (bytes[0] == 'I' || bytes[0] == 'M');
  *photo = cv::imdecode(bytes, flags | cv::IMREAD_ANYDEPTH);
  if (is_tiff && photo->depth() >= CV_32F) {
    photo->release();
    return "has floating-point pixels, and does not say which is white: save it with 8 or 16 bits";
  }
  if (photo->depth() == CV_16U) {
    ToEightBits(photo);
  } else if (photo->depth() != CV_8U) {
    *photo = cv::imdecode(bytes, flags);
  }
  Turn(orientation, photo);
  return "";
}

}  // namespace

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
    const std::string wrong = Decode(bytes, photo);
    if (!wrong.empty()) return wrong;
  } catch (const std::exception&) {
    photo->release();
  }
  if (photo->empty()) return "is not an image that can be read";
  if (static_cast<double>(photo->total()) <= 1e6 * max_megapixels) return "";
  photo->release();
  return "has more than " + FormatPlain(max_megapixels) + " megapixels";
}

FileState StateOf(const std::string& path) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  if (error) return {};
  const auto written = std::filesystem::last_write_time(path, error).time_since_epoch().count();
  return {bytes, error ? 0 : written};
}

}  // namespace circline::apps
