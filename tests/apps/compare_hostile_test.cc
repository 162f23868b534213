// Photos, names, files and streams as nobody means them: a sentence and the right exit code, and
// nothing else is lost.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

namespace fs = std::filesystem;

class CompareHostile : public testing::Test {
 protected:
  Outcome Run(const std::string& flags) {
    return RunCompare("--images='" + folder_ / "photos" + "' --output='" + folder_ / "out" +
                      "' --fov_deg=60 " + flags);
  }
  // A photo that can be worked on, as the last of the folder.
  void PaintLast() {
    fs::create_directories(folder_ / "photos");
    board_.Paint(folder_ / "photos/z.png");
  }
  std::size_t NumPhotos() { return ReadJsonLines(folder_ / "out/observations.jsonl").size(); }

  TestFolder folder_;
  Board board_{40.0};
};

TEST_F(CompareHostile, PhotosOfOneRowOrColumnAreDrawnLikeOthers) {
  PaintLast();
  cv::imwrite(folder_ / "photos/row.png", cv::Mat(1, 100000, CV_8UC1, cv::Scalar(90)));
  cv::imwrite(folder_ / "photos/column.png", cv::Mat(100000, 1, CV_8UC1, cv::Scalar(90)));
  const Outcome outcome = Run("");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(NumPhotos(), 3U);
  EXPECT_TRUE(fs::exists(folder_ / "out/report.html"));
}

TEST_F(CompareHostile, TheLongestNameOfAFileHasItsOverlay) {
  PaintLast();
  fs::copy_file(folder_ / "photos/z.png", folder_ / ("photos/" + std::string(251, 'n') + ".png"));
  const Outcome outcome = Run("");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(NumPhotos(), 2U);
}

TEST_F(CompareHostile, NamesThatAreNoTextCanBeResumed) {
  PaintLast();
  fs::copy_file(folder_ / "photos/z.png", folder_ / "photos/a\xff.png");
  EXPECT_EQ(Run("").exit_code, 0);
  const Outcome again = Run("--resume");
  EXPECT_EQ(again.exit_code, 0) << again.err;
}

TEST_F(CompareHostile, NamesDoNotSteerTheTerminal) {
  PaintLast();
  std::ofstream(folder_ / "photos/b\n\x1b[31m.png") << "no picture";
  const Outcome outcome = Run("");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.err.find('\x1b'), std::string::npos);
  EXPECT_CONTAINS(outcome.err, "b\\x0a\\x1b[31m.png");
}

TEST_F(CompareHostile, FoldersThatCannotBeAreNamed) {
  PaintLast();
  const Outcome outcome = RunCompare("--images='" + folder_ / "photos" +
                                     "' --fov_deg=60 --output=" + std::string(300, 'x'));
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_CONTAINS(outcome.err, "cannot be created");
}

TEST_F(CompareHostile, EndlessFilesAreRefused) {
  PaintLast();
  for (const std::string flag : {"--scene", "--camera", "--flagfile"}) {
    const Outcome outcome =
        RunCompare((flag == "--camera" ? "--images='" + folder_ / "photos" + "' " : std::string()) +
                   flag + "=/dev/zero --output='" + folder_ / "out" + "'");
    EXPECT_EQ(outcome.exit_code, 2) << flag;
    EXPECT_CONTAINS(outcome.err, "larger than 256 MB");
  }
}

TEST_F(CompareHostile, ADeviceIsWrittenToAndALinkFollowed) {
  PaintLast();
  fs::create_symlink(folder_ / "best.txt", folder_ / "link");
  EXPECT_EQ(Run("--save_options='" + folder_ / "link" + "'").exit_code, 0);
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_CONTAINS(ReadAll(folder_ / "best.txt"), "--robust_loss");
  fs::create_symlink("/dev/full", folder_ / "full");
  const Outcome full = Run("--save_options='" + folder_ / "full" + "'");
  EXPECT_EQ(full.exit_code, 1);
  EXPECT_CONTAINS(full.err, "cannot be written");
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

TEST_F(CompareHostile, AFolderWithTheNameOfAFileStays) {
  PaintLast();
  ASSERT_EQ(Run("").exit_code, 0);
  const std::string results = ReadAll(folder_ / "out/results.jsonl");
  fs::remove(folder_ / "out/summary.csv");
  fs::create_directory(folder_ / "out/summary.csv");
  const Outcome outcome = Run("");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_CONTAINS(outcome.err, "out/summary.csv: is no file, and is not replaced by one");
  EXPECT_TRUE(fs::is_directory(folder_ / "out/summary.csv"));
  EXPECT_EQ(ReadAll(folder_ / "out/results.jsonl"), results);
}

TEST_F(CompareHostile, ALostStandardOutputIsAnError) {
  for (const std::string where : {">/dev/full", ">&-"}) {
    const Outcome outcome =
        RunProgram("sh", "-c '\"" CIRCLINE_COMPARE_BINARY "\" --list_solvers " + where + "'");
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_CONTAINS(outcome.err, "standard output cannot be written");
  }
}

TEST_F(CompareHostile, ClosedStreamsDoNotReachTheResults) {
  PaintLast();
  std::ofstream(folder_ / "photos/broken.png") << "no picture";
  const Outcome outcome = RunProgram(
      "sh", "-c '\"" CIRCLINE_COMPARE_BINARY "\" --fov_deg=60 --images=\"" + folder_ / "photos" +
                "\" --output=\"" + folder_ / "out" + "\" <&- >&- 2>&-'");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(NumPhotos(), 2U);  // Each line is JSON.
}

}  // namespace
}  // namespace circline::apps
