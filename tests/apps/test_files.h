// Folders, files and pictures that the tests of the apps make for themselves.
#ifndef CIRCLINE_TESTS_APPS_TEST_FILES_H_
#define CIRCLINE_TESTS_APPS_TEST_FILES_H_

#include <gtest/gtest.h>

#include <string>

#define EXPECT_CONTAINS(text, part) EXPECT_PRED_FORMAT2(testing::IsSubstring, part, text)

namespace circline::apps {

// An empty folder of the running test's own, removed at the end.
class TestFolder {
 public:
  TestFolder();
  ~TestFolder();
  TestFolder(const TestFolder&) = delete;
  TestFolder& operator=(const TestFolder&) = delete;

  const std::string& path() const { return path_; }
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }
  // Writes a file into the folder; returns its path.
  std::string Write(const std::string& name, const std::string& content) const;

 private:
  std::string path_;
};

std::string ReadAll(const std::string& path);

// How many times the part stands in the text.
int Count(const std::string& text, const std::string& part);

}  // namespace circline::apps

#endif  // CIRCLINE_TESTS_APPS_TEST_FILES_H_
