#include "apps/common/photo_list.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

TEST(PhotoList, NamesFilesFoldersAndWildcards) {
  const TestFolder folder;
  for (const char* name : {"b.jpg", "a.PNG", "notes.txt", "c.jpg"}) folder.Write(name, "x");
  std::vector<std::string> paths;
  const auto names = [&] {
    std::string text;
    for (const std::string& path : paths) text += path.substr(folder.path().size()) + " ";
    return text;
  };
  ASSERT_TRUE(ListPhotos(folder.path(), &paths).ok());
  EXPECT_EQ(names(), "/a.PNG /b.jpg /c.jpg ");
  ASSERT_TRUE(ListPhotos(folder / "*.jpg", &paths).ok());
  EXPECT_EQ(names(), "/b.jpg /c.jpg ");
  ASSERT_TRUE(ListPhotos(folder / "c.jpg" + ", " + folder / "missing.jpg", &paths).ok());
  EXPECT_EQ(names(), "/c.jpg /missing.jpg ");
  folder.Write("left, right.jpg", "x");
  ASSERT_TRUE(ListPhotos(folder / "left, right.jpg", &paths).ok());
  EXPECT_EQ(names(), "/left, right.jpg ");
  EXPECT_CONTAINS(ListPhotos(folder / "*.tif", &paths).message, "nothing matches");
}

}  // namespace
}  // namespace circline::apps
