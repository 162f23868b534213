#include "apps/common/exif.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "circline/estimators/random.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

constexpr int kPhotoWidth = 4000, kPhotoHeight = 3000;

void Put(std::uint32_t value, int bytes, std::string* out) {
  for (int k = 0; k < bytes; ++k) out->push_back(static_cast<char>(value >> (8 * k)));
}

// An entry of the EXIF directory: a SHORT, or a RATIONAL where `denominator` says so.
struct Tag {
  std::uint16_t tag;
  std::uint32_t value;
  std::optional<std::uint32_t> denominator;
};

// EXIF data, little-endian: one directory that refers to the other.
std::string Tiff(const std::vector<Tag>& tags) {
  constexpr std::uint32_t kFirst = 8, kExif = kFirst + 2 + 12 + 4;
  const auto after = kExif + 2 + 12 * static_cast<std::uint32_t>(tags.size()) + 4;
  std::string tiff("II*\0", 4), values;
  Put(kFirst, 4, &tiff);
  Put(1, 2, &tiff);  // Entries of the first directory: where the other one is.
  Put(0x8769, 2, &tiff);
  Put(4, 2, &tiff);
  Put(1, 4, &tiff);
  Put(kExif, 4, &tiff);
  Put(0, 4, &tiff);
  Put(static_cast<std::uint32_t>(tags.size()), 2, &tiff);
  for (const Tag& t : tags) {
    Put(t.tag, 2, &tiff);
    Put(t.denominator ? 5 : 3, 2, &tiff);
    Put(1, 4, &tiff);
    Put(t.denominator ? after + static_cast<std::uint32_t>(values.size()) : t.value, 4, &tiff);
    if (!t.denominator) continue;
    Put(t.value, 4, &values);
    Put(*t.denominator, 4, &values);
  }
  Put(0, 4, &tiff);
  return tiff + values;
}

const std::string kMark("Exif\0\0", 6);

// A JPEG that consists of EXIF data alone.
std::string Jpeg(const std::vector<Tag>& tags) {
  const std::string exif = kMark + Tiff(tags);
  std::string jpeg("\xFF\xD8\xFF\xE1", 4);
  jpeg.push_back(static_cast<char>((exif.size() + 2) >> 8));
  jpeg.push_back(static_cast<char>((exif.size() + 2) & 0xFF));
  return jpeg + exif + "\xFF\xD9";
}

// Files of one chunk that is passed over and one of EXIF data, with the mark of a JPEG or without.
std::string Webp(const std::string& exif) {
  std::string file("RIFF\0\0\0\0WEBPVP8X\x03\0\0\0abc\0EXIF", 28);
  Put(static_cast<std::uint32_t>(exif.size()), 4, &file);
  return file + exif;
}

std::string Png(const std::string& exif) {
  std::string file("\x89PNG\r\n\x1A\n\0\0\0\x03IHDRabcsum.", 23);
  for (const int shift : {24, 16, 8, 0}) file.push_back(static_cast<char>(exif.size() >> shift));
  return file + "eXIf" + exif + "sum.";
}

constexpr std::uint16_t kFilm = 0xA405, kFocalLength = 0x920A, kResolution = 0xA20E, kUnit = 0xA210,
                        kPixelX = 0xA002;

class Exif : public testing::Test {
 protected:
  ExifFocalLength Read(const std::string& bytes) const {
    return ReadExifFocalLength(folder_.Write("photo.jpg", bytes), kPhotoWidth, kPhotoHeight);
  }
  const TestFolder folder_;
};

TEST_F(Exif, EquivalentFocalLengthComparesDiagonals) {
  const ExifFocalLength focal = Read(Jpeg({{kFilm, 28, {}}}));
  EXPECT_NEAR(focal.focal_px, 28.0 * 5000.0 / std::hypot(36.0, 24.0), 1e-6);
  EXPECT_CONTAINS(focal.words, "FocalLengthIn35mmFilm of 28 mm");
}

TEST_F(Exif, IsReadOfWebpAndPng) {
  const std::string tiff = Tiff({{kFilm, 28, {}}});
  const double expected = 28.0 * 5000.0 / std::hypot(36.0, 24.0);
  for (const std::string& exif : {tiff, kMark + tiff}) {
    EXPECT_NEAR(Read(Webp(exif)).focal_px, expected, 1e-6);
    EXPECT_NEAR(Read(Png(exif)).focal_px, expected, 1e-6);
  }
  // Cut off anywhere, and with sizes beyond the end.
  for (const std::string& whole : {Webp(tiff), Png(tiff)}) {
    for (std::size_t size = 0; size < whole.size(); ++size)
      EXPECT_TRUE(std::isfinite(Read(whole.substr(0, size)).focal_px)) << size;
    for (std::size_t at = 8; at < whole.size(); ++at) {
      std::string broken = whole;
      broken[at] = '\xFF';
      EXPECT_TRUE(std::isfinite(Read(broken).focal_px)) << at;
    }
  }
}

TEST_F(Exif, FocalPlaneGivesPixelsForAMillimetre) {
  // 8 mm, 2540 pixels an inch.
  const std::vector<Tag> inches = {{kFocalLength, 80, 10}, {kResolution, 2540, 1}, {kUnit, 2, {}}};
  EXPECT_NEAR(Read(Jpeg(inches)).focal_px, 800.0, 1e-6);
  const std::vector<Tag> centimetres = {
      {kFocalLength, 8, 1}, {kResolution, 10000, 1}, {kUnit, 3, {}}};
  EXPECT_NEAR(Read(Jpeg(centimetres)).focal_px, 8000.0, 1e-6);
  const std::vector<Tag> millimetres = {
      {kFocalLength, 8, 1}, {kResolution, 100, 1}, {kUnit, 4, {}}};
  EXPECT_NEAR(Read(Jpeg(millimetres)).focal_px, 800.0, 1e-6);
  const std::vector<Tag> micrometres = {{kFocalLength, 8, 1}, {kResolution, 1, 5}, {kUnit, 5, {}}};
  EXPECT_NEAR(Read(Jpeg(micrometres)).focal_px, 1600.0, 1e-6);
  const std::vector<Tag> unitless = {
      {kFocalLength, 80, 10}, {kResolution, 2540, 1}, {kUnit, 1, {}}};
  EXPECT_EQ(Read(Jpeg(unitless)).focal_px, 0.0);  // 1: no unit of length.
  // Made half as large since.
  const std::vector<Tag> smaller = {
      {kFocalLength, 80, 10}, {kResolution, 2540, 1}, {kPixelX, 8000, {}}};
  EXPECT_NEAR(Read(Jpeg(smaller)).focal_px, 0.0, 1e-6);  // 400 px is no lens's.
  const std::vector<Tag> longer = {
      {kFocalLength, 320, 10}, {kResolution, 2540, 1}, {kPixelX, 8000, {}}};
  EXPECT_NEAR(Read(Jpeg(longer)).focal_px, 1600.0, 1e-6);
}

// Its size was written anew, the resolution of the focal plane was not.
TEST_F(Exif, FocalPlaneOfAPhotoMadeSmallerIsPassedOver) {
  const auto read = [&](std::uint32_t width, std::uint32_t per_inch) {
    return ReadExifFocalLength(folder_.Write("small.jpg", Jpeg({{kFocalLength, 6, 1},
                                                                {kResolution, per_inch, 1},
                                                                {kUnit, 2, {}},
                                                                {kPixelX, width, {}}})),
                               static_cast<int>(width), static_cast<int>(width * 3 / 4));
  };
  EXPECT_NEAR(read(3648, 12493).focal_px, 6.0 * 12493.0 / 25.4, 1e-6);
  for (const std::uint32_t width : {768U, 1500U}) {
    EXPECT_EQ(read(width, 3810).focal_px, 0.0) << width;
    EXPECT_CONTAINS(read(width, 3810).words, "before it was made smaller");
  }
  EXPECT_EQ(read(1800, 20000).focal_px, 0.0);  // Of a sensor of 2.3 mm.
}

TEST_F(Exif, WhatNoLensHasIsPassedOver) {
  for (const std::vector<Tag>& tags : std::vector<std::vector<Tag>>{
           {{kFilm, 1, {}}},
           {{kFilm, 65535, {}}},
           {{kFocalLength, 4000000000U, 1}, {kResolution, 4000000000U, 1}}}) {
    const ExifFocalLength focal = Read(Jpeg(tags));
    EXPECT_EQ(focal.focal_px, 0.0);
    EXPECT_CONTAINS(focal.words, "is no lens's");
  }
  for (const std::vector<Tag>& tags :
       std::vector<std::vector<Tag>>{{},
                                     {{kFilm, 0, {}}},
                                     {{kFocalLength, 8, 1}},  // No focal plane.
                                     {{kFocalLength, 8, 0}, {kResolution, 2540, 0}}}) {
    EXPECT_EQ(Read(Jpeg(tags)).focal_px, 0.0);
  }
}

// Whatever is broken: an answer that is finite, and no crash.
TEST_F(Exif, BrokenDataGiveNone) {
  const std::string whole =
      Jpeg({{kFilm, 28, {}}, {kFocalLength, 80, 10}, {kResolution, 2540, 1}, {kUnit, 2, {}}});
  ASSERT_GT(Read(whole).focal_px, 0.0);
  for (std::size_t size = 0; size < whole.size(); size += 3) {
    EXPECT_TRUE(std::isfinite(Read(whole.substr(0, size)).focal_px)) << size;
  }
  Random random(7);
  for (int i = 0; i < 300; ++i) {
    std::string broken = whole;
    for (int k = 0; k < 3; ++k) {
      const auto at =
          static_cast<std::size_t>(random.Uniform() * static_cast<double>(whole.size()));
      broken[std::min(at, whole.size() - 1)] = static_cast<char>(random.UniformInt(256));
    }
    const double focal = Read(broken).focal_px;
    EXPECT_TRUE(std::isfinite(focal) && focal >= 0.0) << i;
  }
  EXPECT_EQ(ReadExifFocalLength(folder_ / "none.jpg", kPhotoWidth, kPhotoHeight).focal_px, 0.0);
  EXPECT_EQ(Read("\x89PNG\r\n").focal_px, 0.0);
}

}  // namespace
}  // namespace circline::apps
