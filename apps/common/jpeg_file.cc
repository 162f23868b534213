#include "apps/common/jpeg_file.h"

// clang-format off: jpeglib.h takes FILE and size_t for declared.
#include <jerror.h>
#include <jpeglib.h>

#include <cstdio>
// clang-format on

#include <array>
#include <csetjmp>

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
void Hear(j_common_ptr jpeg, int level) {
  constexpr int kPaddingBytes = 8;
  const bool is_padding =
      jpeg->err->msg_code == JWRN_EXTRANEOUS_DATA && jpeg->err->msg_parm.i[0] <= kPaddingBytes;
  const bool is_color = jpeg->err->msg_code == JWRN_ADOBE_XFORM;
  if (level < 0 && !is_padding && !is_color) Stop(jpeg);
}

}  // namespace

bool IsJpeg(const std::vector<std::uint8_t>& bytes) {
  return bytes.size() >= 2 && bytes[0] == 0xFF && bytes[1] == 0xD8;
}

std::string JpegDamage(const std::vector<std::uint8_t>& bytes, double max_megapixels) {
  Errors errors;
  errors.sentence[0] = '\0';
  jpeg_decompress_struct jpeg;
  jpeg.err = jpeg_std_error(&errors);
  errors.error_exit = Stop;
  errors.emit_message = Hear;
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

}  // namespace circline::apps
