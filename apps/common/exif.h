// What a photo says of the camera that took it.
#ifndef CIRCLINE_APPS_COMMON_EXIF_H_
#define CIRCLINE_APPS_COMMON_EXIF_H_

#include <cstdint>
#include <string>
#include <vector>

namespace circline::apps {

struct ExifFocalLength {
  double focal_px = 0.0;  // Of the photo at its present size; 0: the photo does not say.
  std::string words;      // Which tags say so, or why what they say is of no use; may be empty.
};

// From the EXIF data of a JPEG, WebP or PNG: FocalLengthIn35mmFilm, which compares diagonals (CIPA
// DC-008), else FocalLength with the resolution of the focal plane. `width` and `height` are those
// of the photo, pixels; one that was made smaller since has its focal length with it, where EXIF's
// size is still that of the photo as taken. Figures that no lens has are passed over. Never throws,
// whatever is broken in the file.
ExifFocalLength ReadExifFocalLength(const std::string& path, int width, int height);

// How the EXIF data of a WebP say that its picture lies: EXIF's number, 1 (as it should) to 8; 1
// where they say nothing, or there are none. Never throws, whatever is broken in the file.
int WebpOrientation(const std::vector<std::uint8_t>& bytes);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_EXIF_H_
