// Runs of circline_compare that are stopped, go on, and grow large.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"
#include "tests/trials.h"

namespace circline::apps {
namespace {

namespace fs = std::filesystem;

// The same board annotated and to be detected, and a photo that is not there.
std::string MakeLongSet(const TestFolder& folder) {
  std::string scene = "%YAML:1.0\n---\n" + BoardCamera() + "images:\n";
  for (int i = 0; i < 8; ++i) {
    const Board board(20.0 + 5.0 * i);
    const std::string name = "photo" + std::to_string(i) + ".png";
    board.Paint(folder / name);
    scene += AnnotatedImage(board, name) + DetectedImage(board, name);
  }
  return folder.Write("scene.yaml", scene + kMissingImage);
}

// Waits until a program has begun to write the file, or has ended.
void WaitForBytes(pid_t pid, const std::string& path) {
  siginfo_t ended{};
  while (ReadAll(path).empty()) {
    if (waitid(P_PID, static_cast<id_t>(pid), &ended, WEXITED | WNOHANG | WNOWAIT) != 0 ||
        ended.si_pid == pid)
      return;
    std::this_thread::sleep_for(std::chrono::microseconds(500));
  }
}

constexpr int kTrials = Trials(20);

TEST(CompareResume, KilledAtRandomGivesTheSameBytes) {
  const TestFolder folder;
  const std::string scene = MakeLongSet(folder);
  const auto begin = std::chrono::steady_clock::now();
  // One photo is not there.
  ASSERT_EQ(CompareScene(scene, folder / "whole", "--threads=2").exit_code, 1);
  const double whole_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();

  RandomKiller anywhere(whole_ms), in_the_midst(0.5 * whole_ms);
  int num_killed = 0, num_begun = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const std::string out = folder / ("killed" + std::to_string(trial));
    const pid_t pid = StartProgram(CIRCLINE_COMPARE_BINARY,
                                   {"--scene=" + scene, "--threads=2", "--output=" + out});
    ASSERT_GT(pid, 0);
    const bool begun = trial % 2 == 1;  // Every other one has something to go on from.
    if (begun) WaitForBytes(pid, out + "/results.jsonl");
    const bool killed = (begun ? in_the_midst : anywhere).Kill(pid);
    if (killed) ++num_killed;
    for (const char* file : {"results.jsonl", "observations.jsonl"}) {
      const std::string bytes = ReadAll(out + "/" + file);
      EXPECT_TRUE(ReadAll(folder / "whole/" + file).compare(0, bytes.size(), bytes) == 0) << file;
    }
    if (killed && !ReadAll(out + "/results.jsonl").empty()) ++num_begun;
    const Outcome outcome = CompareScene(scene, out, "--resume");
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_CONTAINS(outcome.err, "gone.png: the file does not exist");
    ExpectSameFiles(folder / "whole", out);
  }
  EXPECT_GE(num_killed, kTrials / 2);
  EXPECT_GE(num_begun, kTrials / 8);
}

TEST(CompareResume, DropsALineThatWasCutOff) {
  const TestFolder folder;
  const std::string scene = MakeSet(folder);
  ASSERT_EQ(CompareScene(scene, folder / "whole").exit_code, 0);
  for (const char* file : {"results.jsonl", "observations.jsonl", "timings.jsonl"}) {
    for (const std::uintmax_t cut : {1U, 700U, 9000U}) {
      fs::remove_all(folder / "cut");
      fs::copy(folder / "whole", folder / "cut", fs::copy_options::recursive);
      const std::uintmax_t size = fs::file_size(folder / "cut/" + file);
      fs::resize_file(folder / "cut/" + file, size - std::min(cut, size));
      ASSERT_EQ(CompareScene(scene, folder / "cut", "--resume").exit_code, 0);
      ExpectSameFiles(folder / "whole", folder / "cut");
    }
  }
}

TEST(CompareResume, LeavesTheFilesOfOthers) {
  const TestFolder folder;
  const std::string scene = MakeSet(folder);
  fs::create_directories(folder / "out/overlays");
  for (const char* name : {"out/download.part", "out/overlays/film.mp4.part"})
    folder.Write(name, "theirs");
  for (const char* name : {"out/report.html.part", "out/overlays/01.png.part"})
    folder.Write(name, "cut off");
  ASSERT_EQ(CompareScene(scene, folder / "out").exit_code, 0);
  EXPECT_EQ(ReadAll(folder / "out/download.part"), "theirs");
  EXPECT_EQ(ReadAll(folder / "out/overlays/film.mp4.part"), "theirs");
  EXPECT_FALSE(fs::exists(folder / "out/report.html.part"));
  EXPECT_FALSE(fs::exists(folder / "out/overlays/01.png.part"));
}

TEST(CompareResume, SkipsWhatIsDone) {
  const TestFolder folder;
  const std::string scene = MakeSet(folder);
  ASSERT_EQ(CompareScene(scene, folder / "out", "--resume").exit_code, 0);
  const std::string times = ReadAll(folder / "out/timings.jsonl");
  ASSERT_EQ(CompareScene(scene, folder / "out", "--resume").exit_code, 0);
  EXPECT_EQ(ReadAll(folder / "out/timings.jsonl"), times);  // Measured again, they would differ.
}

TEST(CompareResume, DoesAgainWhatHasChanged) {
  const TestFolder folder;
  const std::array<std::string, 3> photos = {folder / "a.png", folder / "b.png", folder / "c.png"};
  for (const std::string& photo : {photos[0], photos[2]}) Board(35.0).Paint(photo);
  const std::string scene = folder.Write(
      "scene.yaml", "%YAML:1.0\n---\n" + BoardCamera() + "images:\n" +
                        DetectedImage(Board(35.0), "a.png") + DetectedImage(Board(35.0), "b.png") +
                        DetectedImage(Board(35.0), "c.png"));
  const auto run = [&scene](const std::string& out) {
    return CompareScene(scene, out, "--resume --threads=1");
  };
  const std::string out = folder / "out";
  EXPECT_CONTAINS(run(out).err, "b.png: the file does not exist");
  const auto first_times = [&out] {  // Of a.png, measured anew if it is done anew.
    const std::string times = ReadAll(out + "/timings.jsonl");
    return times.substr(0, times.find("b.png"));
  };
  const std::string before = first_times();
  Board(50.0).Paint(photos[1]);  // It is there now.
  EXPECT_CONTAINS(run(out).err, "b.png: has changed");
  EXPECT_EQ(run(folder / "anew").exit_code, 0);
  ExpectSameFiles(folder / "anew", out);
  const auto written = fs::last_write_time(photos[2]);
  Board(20.0).Paint(photos[2]);  // Whether its size or its time tells.
  fs::last_write_time(photos[2], written + std::chrono::seconds(1));
  const Outcome outcome = run(out);
  EXPECT_CONTAINS(outcome.err, "c.png: has changed");
  EXPECT_EQ(outcome.err.find("b.png"), std::string::npos);
  fs::remove_all(folder / "anew");
  EXPECT_EQ(run(folder / "anew").exit_code, 0);
  ExpectSameFiles(folder / "anew", out);
  EXPECT_EQ(first_times(), before);
  EXPECT_EQ(run(out).err.find("changed"), std::string::npos);
}

TEST(CompareResume, RefusesTheResultsOfAnotherRun) {
  const TestFolder folder;
  const std::string scene = MakeSet(folder);
  const std::string arguments =
      "--resume --overlays=false --scene='" + scene + "' --output='" + folder / "out" + "' ";
  ASSERT_EQ(RunCompare(arguments).exit_code, 0);
  const std::string before = ReadAll(folder / "out/results.jsonl");
  Outcome outcome = RunCompare(arguments + "--solvers=joint");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_CONTAINS(outcome.err, "its solvers or losses differ");
  outcome = RunCompare(arguments + "--shard=1/2");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_CONTAINS(outcome.err, "its image 1 is tilt25.png");
  outcome = RunCompare(arguments + "--seed=2 --max_pencils=4");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_CONTAINS(outcome.err, "with the default flags, not with --max_pencils=4 --seed=2");
  outcome = RunCompare(arguments + "--max_megapixels=50");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_CONTAINS(outcome.err, "with the default flags, not with --max_megapixels=50");
  EXPECT_EQ(RunCompare(arguments + "--seed=1").exit_code, 0);  // The default, said aloud.
  EXPECT_EQ(ReadAll(folder / "out/results.jsonl"), before);
}

TEST(CompareResume, RefusesTheResultsOfAnotherCamera) {
  const TestFolder folder;
  Board(35.0).Paint(folder / "board.png");
  const std::string arguments = "--resume --overlays=false --images='" + folder / "board.png" +
                                "' --output='" + folder / "out" + "' ";
  const auto camera = [&](const std::string& focal) {
    return "--camera='" +
           folder.Write(focal + ".txt", "1 SIMPLE_PINHOLE 320 240 " + focal + " 160 120\n") + "'";
  };
  ASSERT_EQ(RunCompare(arguments + camera("300")).exit_code, 0);
  const std::string before = ReadAll(folder / "out/results.jsonl");
  for (const std::string& other : {camera("301"), std::string()}) {
    const Outcome outcome = RunCompare(arguments + other);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_CONTAINS(outcome.err, "board.png differs");
  }
  EXPECT_EQ(RunCompare(arguments + camera("300")).exit_code, 0);
  EXPECT_EQ(ReadAll(folder / "out/results.jsonl"), before);
}

// ---- Begun anew ----

TEST(CompareAnew, RemovesWhatAnEarlierRunWroteAndNothingElse) {
  const TestFolder folder;
  for (const char* name : {"a.png", "b.png"}) Board(35.0).Paint(folder / name);
  const auto run = [&](const std::string& photo, const std::string& flags) {
    return RunCompare("--images='" + folder / photo + "' --focal_px=300 --solvers=joint " + flags +
                      " --output='" + folder / "out" + "'");
  };
  ASSERT_EQ(run("?.png", "--export_as=colmap,gltf,tum").exit_code, 0);
  for (const char* name : {"mine.png", "overlays/mine.png", "notes.txt"})
    folder.Write(std::string("out/") + name, "mine");
  const Outcome anew = run("a.png", "");
  ASSERT_EQ(anew.exit_code, 0) << anew.err;
  EXPECT_EQ(FilesIn(folder / "out"),
            (std::set<std::string>{"mine.png", "notes.txt", "observations.jsonl", "overlays/a.png",
                                   "overlays/mine.png", "report.html", "results.jsonl",
                                   "summary.csv", "timings.jsonl"}));
  // A model of somebody else's.
  const std::set<std::string> before = FilesIn(folder / "out");
  std::set<std::string> after = before;
  for (const char* name : {"images.txt", "cameras.txt", "points3D.txt", "trajectory.txt"}) {
    folder.Write(std::string("out/") + name, "# Of another program\n");
    after.insert(name);
  }
  ASSERT_EQ(run("a.png", "").exit_code, 0);
  EXPECT_EQ(FilesIn(folder / "out"), after);
}

// ---- Many images ----

// Peak memory of the program over the photos of a folder, kilobytes.
long PeakKilobytes(const std::string& photos, const std::string& camera,
                   const std::string& output) {
  const pid_t pid = StartProgram(CIRCLINE_COMPARE_BINARY,
                                 {"--images=" + photos, "--camera=" + camera, "--output=" + output,
                                  "--threads=2", "--overlays=false"});
  int status = 0;
  rusage usage{};
  EXPECT_EQ(wait4(pid, &status, 0, &usage), pid);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  return usage.ru_maxrss;
}

TEST(CompareScale, APhotoTakesHalfAKilobyte) {
  if (kSanitized) GTEST_SKIP() << "sanitizers keep freed memory";
  const TestFolder folder;
  const char* const asked = std::getenv("CIRCLINE_STREAMED_PHOTOS");
  const int kFew = 100, kMany = asked != nullptr ? std::atoi(asked) : 10000;
  Board(35.0).Paint(folder / "big.png");
  cv::Mat small;
  cv::resize(cv::imread(folder / "big.png", cv::IMREAD_GRAYSCALE), small, {80, 60}, 0.0, 0.0,
             cv::INTER_AREA);
  fs::create_directory(folder / "few");
  fs::create_directory(folder / "many");
  cv::imwrite(folder / "small.png", small);
  for (int i = 0; i < kMany; ++i) {
    const std::string name = "/a_photo_of_a_board_" + std::to_string(i) + ".png";
    fs::create_symlink(folder / "small.png", folder / "many" + name);
    if (i < kFew) fs::create_symlink(folder / "small.png", folder / "few" + name);
  }
  const std::string camera = folder.Write("cameras.txt", "1 SIMPLE_PINHOLE 80 60 75 40 30\n");
  const long few = PeakKilobytes(folder / "few", camera, folder / "out_few");
  const long many = PeakKilobytes(folder / "many", camera, folder / "out_many");
  RecordProperty("few_kb", std::to_string(few));
  RecordProperty("many_kb", std::to_string(many));
  // A photo's names, and of each solver the numbers whose medians are asked for.
  constexpr double kKilobytesAPhoto = 0.6;
  constexpr double kArenas = 4096.0;  // Of the threads' heaps, from run to run.
  EXPECT_LE(static_cast<double>(many - few), kArenas + kKilobytesAPhoto * kMany)
      << few << " kB for " << kFew << ", " << many << " kB for " << kMany;
}

}  // namespace
}  // namespace circline::apps
