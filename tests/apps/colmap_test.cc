// What is written for COLMAP, read by COLMAP itself (Debian package colmap).
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <tuple>

#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

// Lines of text that are neither empty nor comments.
int CountLines(const std::string& path) {
  std::istringstream text(ReadAll(path));
  int count = 0;
  for (std::string line; std::getline(text, line);) count += !line.empty() && line[0] != '#';
  return count;
}

// To COLMAP's binary files and back: what it could not read is missing then.
void ExpectColmapReads(const TestFolder& folder, const std::string& model) {
  const std::string binary = folder / "binary", again = folder / "again";
  for (const auto& [from, to, type] :
       {std::tuple(model, binary, "BIN"), std::tuple(binary, again, "TXT")}) {
    std::filesystem::create_directories(to);
    const Outcome run = RunProgram("colmap", "model_converter --input_path " + from +
                                                 " --output_path " + to + " --output_type " + type);
    ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  }
  for (const char* file : {"/cameras.txt", "/images.txt"}) {
    EXPECT_GT(CountLines(model + file), 0);
    EXPECT_EQ(CountLines(again + file), CountLines(model + file)) << file;
  }
}

class Colmap : public testing::Test {
 protected:
  void SetUp() override {
    if (std::system("command -v colmap > /dev/null") != 0)
      GTEST_SKIP() << "the Debian package colmap is not installed";
    scene_ = "--scene=" + MakeSet(folder_);
  }
  TestFolder folder_;
  std::string scene_;
};

TEST_F(Colmap, ReadsWhatCompareExports) {
  const std::string out = folder_ / "out";
  ASSERT_EQ(
      RunCompare(scene_ + " --overlays=false --solvers=joint --export_as=colmap --output=" + out)
          .exit_code,
      0);
  ExpectColmapReads(folder_, out);
}

TEST_F(Colmap, ReadsWhatCalibrateWrites) {
  const std::string out = folder_ / "out";
  ASSERT_EQ(RunProgram(CIRCLINE_CALIBRATE, scene_ + " --output=" + out).exit_code, 0);
  ExpectColmapReads(folder_, out);
}

}  // namespace
}  // namespace circline::apps
