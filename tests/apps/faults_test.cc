// What the programs leave where the disk is full or may not be written, where the folder goes away
// under them, and where they are killed: a sentence, and no file that is not whole.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/small_disk.h"
#include "tests/apps/test_files.h"
#include "tests/trials.h"

namespace circline::apps {
namespace {

namespace fs = std::filesystem;

struct Program {
  const char* name;
  const char* path;
  const char* arguments;  // FOLDER: where the photos are.
};

constexpr Program kPrograms[] = {
    {"compare", CIRCLINE_COMPARE_BINARY,
     "--scene=FOLDER/scene.yaml --export_as=tum,gltf,colmap --threads=2"},
    {"calibrate", CIRCLINE_CALIBRATE, "--images=FOLDER/*.png"},
    {"track", CIRCLINE_TRACK, "--images=FOLDER/*.png --focal_px=300 --video_out=overlays.avi"},
    {"reconstruct", CIRCLINE_RECONSTRUCT, "--scene=FOLDER/scene.yaml --image=tilt40.png"},
    {"simulate", CIRCLINE_SIMULATE, "--trials=20"},
};

class Faults : public testing::TestWithParam<Program> {
 protected:
  Faults() { MakeSet(folder_); }

  std::vector<std::string> Arguments(const std::string& output) const {
    std::vector<std::string> arguments = {"--output=" + output};
    std::istringstream text(GetParam().arguments);
    const std::string folder = "FOLDER";
    for (std::string word; text >> word;) {
      const std::size_t at = word.find(folder);
      if (at != std::string::npos) word.replace(at, folder.size(), folder_.path());
      arguments.push_back(word);
    }
    return arguments;
  }
  Outcome Run(const std::string& output) const {
    std::string line;
    for (const std::string& argument : Arguments(output)) line += "'" + argument + "' ";
    return RunProgram(GetParam().path, line);
  }
  pid_t Start(const std::string& output) const {
    return StartProgram(GetParam().path, Arguments(output));
  }
  // The whole answer, and how long it takes.
  void MakeWhole() {
    const auto begin = std::chrono::steady_clock::now();
    const Outcome outcome = Run(Whole());
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    whole_ms_ =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  }
  std::string Whole() const { return folder_ / "whole"; }

  // Every file is the whole run's, but for lines that were not reached, and for what carries
  // another name until it is whole. The system may cut off the line that a killed program writes.
  void ExpectNothingHalf(const std::string& output, bool killed) const {
    if (!fs::exists(output)) return;
    const std::set<std::string> repeatable = RepeatableFilesIn(Whole());
    for (const std::string& file : FilesIn(output)) {
      const std::string bytes = ReadAll(output + "/" + file);
      if (fs::path(file).extension() == ".jsonl") {
        EXPECT_TRUE(killed || bytes.empty() || bytes.back() == '\n') << file;
        if (repeatable.count(file) == 0) continue;
        const std::string whole = ReadAll(Whole() + "/" + file);
        EXPECT_TRUE(whole.compare(0, bytes.size(), bytes) == 0) << file << " has other lines";
      } else if (repeatable.count(file) > 0) {
        EXPECT_TRUE(bytes == ReadAll(Whole() + "/" + file)) << file << " is not whole";
      }
    }
  }
  bool HasPart(const std::string& output) const {
    if (!fs::exists(output)) return false;
    const std::set<std::string> files = FilesIn(output);
    return std::any_of(files.begin(), files.end(), [](const std::string& file) {
      return file.find("part") != std::string::npos;
    });
  }

  TestFolder folder_;
  double whole_ms_ = 0.0;
};

#ifndef CIRCLINE_SANITIZED  // A sanitizer's own memory is not what is limited.
// From too little to be loaded, to what is enough twice, which is more where there are more cores.
TEST_P(Faults, MemoryThatRunsOutIsSaid) {
  MakeWhole();
  int num_enough = 0;
  for (int megabytes = 180; num_enough < 2 && megabytes < 20000;
       megabytes += megabytes < 420 ? 16 : megabytes) {
    const auto limited = [&](const std::vector<std::string>& arguments) {
      std::string line = "-c 'ulimit -v " + std::to_string(megabytes * 1000) +
                         "; exec \"$@\"' sh '" + GetParam().path + "' ";
      for (const std::string& argument : arguments) line += "'" + argument + "' ";
      return RunProgram("sh", line);
    };
    if (limited({"--version"}).exit_code != 0) continue;
    const std::string output = folder_ / ("limited" + std::to_string(megabytes));
    const Outcome outcome = limited(Arguments(output));
    // GDAL, which OpenCV starts for the first photo, ends the program where it gets none.
    const std::vector<std::string> of_gdal = {"CPLCreateMutexInternal() failed", "./port/cpl",
                                              "CPLMalloc(): Out of memory"};
    const bool is_gdal =
        std::any_of(of_gdal.begin(), of_gdal.end(), [&](const std::string& sentence) {
          return outcome.err.find(sentence) != std::string::npos;
        });
    EXPECT_TRUE(outcome.exit_code == 0 || (outcome.exit_code == 1 && !outcome.err.empty()) ||
                is_gdal)
        << megabytes << " MB: " << outcome.exit_code << " " << outcome.err;
    EXPECT_FALSE(HasPart(output)) << megabytes;
    num_enough = outcome.exit_code == 0 ? num_enough + 1 : 0;
  }
  EXPECT_EQ(num_enough, 2);
}
#endif

TEST_P(Faults, AFullDiskIsNamed) {
  const SmallDisk disk(folder_ / "disk");
  if (!disk.mounted()) GTEST_SKIP() << "no file system can be mounted here (root may)";
  MakeWhole();
  std::uintmax_t bytes = 0;
  for (const std::string& file : FilesIn(Whole())) bytes += fs::file_size(Whole() + "/" + file);
  constexpr std::uintmax_t kSteps = 8, kBlock = 4;  // Kilobytes.
  for (std::uintmax_t step = 0; step < kSteps; ++step) {
    const std::uintmax_t kilobytes = kBlock + step * bytes / 1024 / kSteps;
    ASSERT_TRUE(disk.Renew(kilobytes));
    const Outcome outcome = Run(disk / "out");
    EXPECT_EQ(outcome.exit_code, 1) << kilobytes << " kB: " << outcome.err;
    EXPECT_CONTAINS(outcome.err, disk / "out/");
    ExpectNothingHalf(disk / "out", false);
    EXPECT_FALSE(HasPart(disk / "out")) << kilobytes << " kB";
  }
  ASSERT_TRUE(disk.Renew(2 * bytes / 1024 + 1024));
  EXPECT_EQ(Run(disk / "out").exit_code, 0);
  ExpectSameFiles(Whole(), disk / "out");
}

TEST_P(Faults, AFolderThatMayNotBeWrittenIsNamed) {
  const SmallDisk disk(folder_ / "disk");
  if (!disk.mounted()) GTEST_SKIP() << "no file system can be mounted here (root may)";
  ASSERT_TRUE(disk.Renew(1024, true));
  const Outcome outcome = Run(disk / "out");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_CONTAINS(outcome.err, disk / "out");
}

TEST_P(Faults, KilledAtRandomLeavesNothingHalf) {
  MakeWhole();
  RandomKiller killer(whole_ms_);
  int num_killed = 0;
  constexpr int kRuns = Trials(6);
  for (int run = 0; run < kRuns; ++run) {
    const std::string out = folder_ / ("killed" + std::to_string(run));
    if (killer.Kill(Start(out))) ++num_killed;
    ExpectNothingHalf(out, true);
    EXPECT_EQ(Run(out).exit_code, 0);
    ExpectSameFiles(Whole(), out);
  }
  EXPECT_GE(num_killed, kRuns / 3);
}

INSTANTIATE_TEST_SUITE_P(Programs, Faults, testing::ValuesIn(kPrograms),
                         [](const auto& test) { return std::string(test.param.name); });

// Of the programs that work in their folder for long.
class FolderFaults : public Faults {};

TEST_P(FolderFaults, AFolderThatGoesAwayIsNamed) {
  const std::string out = folder_ / "out";
  std::atomic<bool> ended{false};
  std::thread mover([&] {
    std::error_code error;
    while (!ended && !fs::exists(out, error)) std::this_thread::yield();
    fs::rename(out, folder_ / "moved", error);
  });
  const Outcome outcome = Run(out);
  ended = true;
  mover.join();
  EXPECT_NE(outcome.exit_code, 0);  // 2 where it goes away at the very beginning.
  EXPECT_CONTAINS(outcome.err, out);
}

INSTANTIATE_TEST_SUITE_P(Programs, FolderFaults,
                         testing::Values(kPrograms[0], kPrograms[2], kPrograms[4]),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(PhotoFaults, PhotosThatChangeWhileTheyAreReadAreReadOrNamed) {
  const TestFolder folder;
  MakeSet(folder);
  const std::string photo = ReadAll(folder / "tilt40.png");
  constexpr std::size_t kImages = 40;
  std::string scene = "%YAML:1.0\n---\n" + BoardCamera() + "images:\n";
  for (std::size_t i = 0; i < kImages; ++i) scene += DetectedImage(Board(40.0), "tilt40.png");
  folder.Write("scene.yaml", scene);
  std::atomic<bool> ended{false};
  std::thread writer([&] {
    std::mt19937 random(3);
    while (!ended) {
      std::ofstream file(folder / "tilt40.png", std::ios::binary);
      file << photo.substr(0, random() % photo.size()) << std::flush;
      if (random() % 2 == 0) fs::remove(folder / "tilt40.png");
      file << photo.substr(photo.size() / 2) << std::flush;
      folder.Write("tilt40.png", photo);
    }
  });
  const Outcome outcome = CompareScene(folder / "scene.yaml", folder / "out", "--solvers=joint");
  ended = true;
  writer.join();
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_CONTAINS(outcome.err, "tilt40.png: ");
  EXPECT_EQ(ReadJsonLines(folder / "out/observations.jsonl").size(), kImages);
}

}  // namespace
}  // namespace circline::apps
