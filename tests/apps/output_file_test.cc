#include "apps/common/output_file.h"

#include <gtest/gtest.h>

#include <ctime>
#include <filesystem>
#include <vector>

#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

TEST(OutputFile, AppearsWholeOrNotAtAll) {
  const TestFolder folder;
  {
    OutputFile file(folder / "a.txt");
    file.Write("half");
    EXPECT_FALSE(std::filesystem::exists(folder / "a.txt"));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  OutputFile file(folder / "a.txt");
  file.Write("whole");
  EXPECT_TRUE(file.Commit().ok());
  EXPECT_EQ(ReadAll(folder / "a.txt"), "whole");
}

TEST(OutputFile, NamesWhatCannotBeWritten) {
  const TestFolder folder;
  folder.Write("file", "x");
  EXPECT_NE(WriteFile(folder / "file/a.txt", "x").message.find("file/a.txt"), std::string::npos);
  EXPECT_FALSE(CreateFolder(folder / "file").ok());
  EXPECT_FALSE(CreateFolder(folder / "file/sub").ok());
  EXPECT_TRUE(CreateFolder(folder / "new/sub").ok());
}

TEST(FolderLock, HasOneHolder) {
  const TestFolder folder;
  {
    FolderLock first, second;
    EXPECT_TRUE(first.Acquire(folder.path()).ok());
    EXPECT_CONTAINS(second.Acquire(folder.path()).message, "another run is writing");
  }
  FolderLock third;
  EXPECT_TRUE(third.Acquire(folder.path()).ok());
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(UniqueStems, KeepNamesApart) {
  EXPECT_EQ(UniqueStems({"x/a.jpg", "x/b.jpg"}), (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(UniqueStems({"left/1.jpg", "right/1.jpg", "right/2.jpg"}),
            (std::vector<std::string>{"left_1", "right_1", "2"}));
  EXPECT_EQ(UniqueStems({"a.jpg", "a.png", "A.bmp"}),
            (std::vector<std::string>{"a", "a_2", "A_3"}));
  EXPECT_EQ(UniqueStems({"../r/l/1.jpg", "../s/l/1.jpg", "l_1.jpg"}),
            (std::vector<std::string>{"r_l_1", "s_l_1", "l_1"}));
}

TEST(UniqueStems, OneNameManyTimesTakesNoLongerThanManyNames) {
  const std::clock_t begin = std::clock();
  const std::vector<std::string> stems = UniqueStems(std::vector<std::string>(20000, "a.jpg"));
  EXPECT_EQ(stems.back(), "a_20000");
  EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 10.0);
}

}  // namespace
}  // namespace circline::apps
