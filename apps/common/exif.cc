#include "apps/common/exif.h"

#include <libexif/exif-data.h>
#include <libexif/exif-utils.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <memory>
#include <string_view>

#include "apps/common/text.h"

namespace circline::apps {
namespace {

// Of 36 mm x 24 mm.
constexpr double kFilmDiagonalMm = 43.266615305567875;
constexpr double kMmPerInch = 25.4, kMmPerCentimetre = 10.0, kMmPerMicrometre = 1e-3;
// Of focal length to the photo's longer side: a fisheye's, and a long telescope's. Beyond lies what
// no lens has.
constexpr double kShortest = 0.2, kLongest = 60.0;

// What makes a photo smaller sets its size anew in EXIF, and mostly leaves the pixels a millimetre,
// which are those of the sensor: of a sensor smaller than any, mm, or a photo smaller than cameras
// that write this take, pixels, they are not the photo's. (Seven such photographs of Debian
// packages have 400 to 1500 pixels, the sensors that follow are 0.7 to 10 mm, truly 5.3 to 36.)
constexpr double kSmallestSensorMm = 3.2, kSmallestTaken = 1600.0;

using ExifPointer = std::unique_ptr<ExifData, void (*)(ExifData*)>;

// The first number of an entry; 0 where there is none.
double Number(ExifData* data, ExifIfd ifd, ExifTag tag) {
  const ExifEntry* entry = exif_content_get_entry(data->ifd[ifd], tag);
  if (entry == nullptr || entry->data == nullptr || entry->components < 1 ||
      entry->size < exif_format_get_size(entry->format)) {
    return 0.0;
  }
  const ExifByteOrder order = exif_data_get_byte_order(data);
  switch (entry->format) {
    case EXIF_FORMAT_SHORT:
      return exif_get_short(entry->data, order);
    case EXIF_FORMAT_LONG:
      return exif_get_long(entry->data, order);
    case EXIF_FORMAT_RATIONAL: {
      const ExifRational value = exif_get_rational(entry->data, order);
      return value.denominator == 0 ? 0.0
                                    : static_cast<double>(value.numerator) / value.denominator;
    }
    default:
      return 0.0;
  }
}

// Pixels of the photo as taken for a millimetre of the sensor; 0 where it does not say.
double PixelsPerMm(ExifData* data) {
  const double resolution = Number(data, EXIF_IFD_EXIF, EXIF_TAG_FOCAL_PLANE_X_RESOLUTION);
  const double unit = Number(data, EXIF_IFD_EXIF, EXIF_TAG_FOCAL_PLANE_RESOLUTION_UNIT);
  // EXIF knows 2 and 3, and takes 2 where nothing is said; 4 and 5 are usual besides.
  const double mm = unit == 0.0 || unit == 2.0 ? kMmPerInch
                    : unit == 3.0              ? kMmPerCentimetre
                    : unit == 4.0              ? 1.0
                    : unit == 5.0              ? kMmPerMicrometre
                                               : 0.0;
  return mm > 0.0 ? resolution / mm : 0.0;
}

// A whole number of four bytes.
std::size_t FourBytes(std::string_view bytes, bool little_endian) {
  std::size_t number = 0;
  for (std::size_t k = 0; k < 4; ++k)
    number |= static_cast<std::size_t>(static_cast<std::uint8_t>(bytes[k]))
              << 8 * (little_endian ? k : 3 - k);
  return number;
}

// EXIF data as libexif wants them, with the mark that a JPEG has before them; some writers leave it
// there in other formats, too.
std::string Marked(std::string_view exif) {
  const std::string mark("Exif\0\0", 6);
  return exif.substr(0, mark.size()) == mark ? std::string(exif) : mark + std::string(exif);
}

// The EXIF data of a WebP; empty where it has none, or is none. After "RIFF", a size and "WEBP"
// come chunks: a name, a size (little endian) and as many bytes, one more where that is odd.
std::string WebpExif(std::string_view file) {
  constexpr std::size_t kHeader = 12, kChunkHeader = 8;
  if (file.size() < kHeader || file.substr(0, 4) != "RIFF" || file.substr(8, 4) != "WEBP")
    return "";
  for (std::size_t at = kHeader; at + kChunkHeader <= file.size();) {
    const std::size_t size = FourBytes(file.substr(at + 4), true);
    if (file.substr(at, 4) == "EXIF") return Marked(file.substr(at + kChunkHeader, size));
    at += kChunkHeader + size + size % 2;
  }
  return "";
}

// Of a PNG, whose chunks are after a signature: a size (big endian), a name, as many bytes, and
// their sum.
std::string PngExif(std::string_view file) {
  constexpr std::string_view kSignature("\x89PNG\r\n\x1A\n", 8);
  constexpr std::size_t kChunkHeader = 8, kSum = 4;
  if (file.substr(0, kSignature.size()) != kSignature) return "";
  for (std::size_t at = kSignature.size(); at + kChunkHeader <= file.size();) {
    const std::size_t size = FourBytes(file.substr(at), false);
    if (file.substr(at + 4, 4) == "eXIf") return Marked(file.substr(at + kChunkHeader, size));
    at += kChunkHeader + size + kSum;
  }
  return "";
}

ExifPointer FromBytes(const std::string& exif) {
  return {exif.empty()
              ? nullptr
              : exif_data_new_from_data(reinterpret_cast<const unsigned char*>(exif.data()),
                                        static_cast<unsigned int>(exif.size())),
          exif_data_unref};
}

// Null where the file has none. libexif finds those of a JPEG itself.
ExifPointer FromFile(const std::string& path) {
  constexpr std::size_t kEnough = 12;  // To tell the format.
  std::ifstream file(path, std::ios::binary);
  std::string bytes(kEnough, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (bytes.substr(0, 4) != "RIFF" && bytes.substr(1, 3) != "PNG")
    return {exif_data_new_from_file(path.c_str()), exif_data_unref};
  bytes.append(std::istreambuf_iterator<char>(file), {});
  const std::string exif = WebpExif(bytes);
  return FromBytes(exif.empty() ? PngExif(bytes) : exif);
}

std::string Millimetres(const std::string& tag, double mm) {
  return "EXIF's " + tag + " of " + FormatPlain(mm, 4) + " mm";
}

}  // namespace

ExifFocalLength ReadExifFocalLength(const std::string& path, int width, int height) {
  ExifFocalLength focal;
  const ExifPointer data = FromFile(path);
  if (data == nullptr) return focal;
  const double longer = std::max(width, height);
  const double film = Number(data.get(), EXIF_IFD_EXIF, EXIF_TAG_FOCAL_LENGTH_IN_35MM_FILM);
  const double mm = Number(data.get(), EXIF_IFD_EXIF, EXIF_TAG_FOCAL_LENGTH);
  const double per_mm = PixelsPerMm(data.get());
  bool made_smaller = false;
  if (film > 0.0) {
    focal.focal_px = film / kFilmDiagonalMm * std::hypot(width, height);
    focal.words = Millimetres("FocalLengthIn35mmFilm", film);
  } else if (mm > 0.0 && per_mm > 0.0) {
    const double taken = std::max(Number(data.get(), EXIF_IFD_EXIF, EXIF_TAG_PIXEL_X_DIMENSION),
                                  Number(data.get(), EXIF_IFD_EXIF, EXIF_TAG_PIXEL_Y_DIMENSION));
    focal.words = Millimetres("FocalLength and focal plane", mm);
    const double pixels = taken > 0.0 ? taken : longer;
    focal.focal_px = mm * per_mm * longer / pixels;
    made_smaller = pixels < kSmallestTaken || pixels / per_mm < kSmallestSensorMm;
  }
  const double share = focal.focal_px / longer;
  const bool is_lens = share >= kShortest && share <= kLongest;
  if (focal.focal_px > 0.0 && (!is_lens || made_smaller)) {
    focal.words += is_lens ? " are of the photo before it was made smaller" : " is no lens's";
    focal.focal_px = 0.0;
  }
  return focal;
}

int WebpOrientation(const std::vector<std::uint8_t>& bytes) {
  const ExifPointer data =
      FromBytes(WebpExif({reinterpret_cast<const char*>(bytes.data()), bytes.size()}));
  const double number =
      data == nullptr ? 1.0 : Number(data.get(), EXIF_IFD_0, EXIF_TAG_ORIENTATION);
  return number >= 1.0 && number <= 8.0 ? static_cast<int>(number) : 1;
}

}  // namespace circline::apps
