// The folder of photos that the studio opens.
#include <gtest/gtest.h>

#include <string>

#include "apps/studio/studio.h"
#include "tests/apps/studio_disc.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

TEST(StudioFolder, ListsFiveThousandPhotos) {
  const TestFolder folder;
  for (int i = 0; i < 5000; ++i) folder.Write("photo" + std::to_string(10000 + i) + ".jpg", "");
  PhotoFolder photos;
  ASSERT_TRUE(photos.Open(folder.path()).ok());
  Studio studio(StudioOptions(), photos, nullptr);
  ASSERT_TRUE(studio.ReadFiles().ok());
  EXPECT_EQ(studio.Images()["images"].size(), 5000U);
  EXPECT_EQ(photos.Find("photo14999.jpg"), 4999U);
  EXPECT_EQ(photos.Find("other.jpg"), 5000U);
}

TEST(StudioFolder, APhotoOfFiftyMegapixelsCanBeUsed) {
  const TestFolder folder;
  cv::imwrite(folder / "large.jpg", DiscPhoto(8660, 5774));
  PhotoFolder photos;
  ASSERT_TRUE(photos.Open(folder.path()).ok());
  Studio studio(StudioOptions(), photos, nullptr);
  const ShownPhoto shown = studio.Photo(0);
  EXPECT_EQ(shown.width, 8660);
  EXPECT_EQ(shown.type, "image/jpeg");
  EXPECT_EQ(studio.Detect({{"image", 0}})["ellipses"].size(), 1U);
}

TEST(StudioFolder, SaysThatThereIsNone) {
  PhotoFolder photos;
  const TestFolder empty;
  EXPECT_CONTAINS(photos.Open(empty / "none").message, "must be a folder");
  EXPECT_CONTAINS(photos.Open(empty.path()).message, "has no photo");
}

}  // namespace
}  // namespace circline::apps
