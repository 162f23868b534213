// What a run reads it does not write over.
#include "apps/common/written_files.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <map>
#include <string>

#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

namespace fs = std::filesystem;

TEST(WrittenFiles, AreFoundByAnyNameOfTheirs) {
  const TestFolder folder;
  fs::create_directories(folder / "own/overlays");
  folder.Write("own/photo.png", "");
  folder.Write("own/report.html", "");
  fs::create_directory_symlink(folder / "own", folder / "link");
  fs::create_symlink(folder / "own/photo.png", folder / "own/summary.csv");
  WrittenFiles written(folder / "link", {"report.html", "summary.csv", "overlays/*.png"});
  EXPECT_TRUE(written.Has(folder / "own/report.html"));
  EXPECT_TRUE(written.Has(folder / "link/../own/./report.html"));
  EXPECT_TRUE(written.Has(folder / "own/photo.png"));  // Through the link that is written.
  EXPECT_TRUE(written.Has(folder / "own/overlays/none.png"));
  EXPECT_FALSE(written.Has(folder / "own/overlays/a.jpg"));
  EXPECT_FALSE(written.Has(folder / "own/a.png"));
  EXPECT_FALSE(written.Has(folder / "report.html"));
}

TEST(WrittenFiles, InAFolderThatIsNotThere) {
  const TestFolder folder;
  WrittenFiles written(folder / "none/yet", {"report.html", "overlays/*.png"});
  EXPECT_TRUE(written.Has(folder / "none/yet/report.html"));
  EXPECT_TRUE(written.CheckKept({folder / "none/report.html"}).ok());
  EXPECT_CONTAINS(written.CheckKept({"a", folder / "none/yet/overlays/b.png"}).message,
                  "overlays/b.png: is read, and would be written over");
}

// As of --camera=<(...) and --save_options=/dev/stdout.
TEST(WrittenFiles, PipesAreNotAllTheSame) {
  std::array<int, 2> one{}, other{};
  ASSERT_EQ(pipe(one.data()), 0);
  ASSERT_EQ(pipe(other.data()), 0);
  const auto path = [](int descriptor) { return "/proc/self/fd/" + std::to_string(descriptor); };
  WrittenFiles written("", {path(one[1])});
  EXPECT_TRUE(written.Has(path(one[1])));
  EXPECT_FALSE(written.Has(path(other[0])));
  for (const int descriptor : {one[0], one[1], other[0], other[1]}) close(descriptor);
}

class KeptInputs : public testing::Test {
 protected:
  KeptInputs() {
    fs::create_directories(folder_ / "own/overlays");
    for (const char* name : {"photo.png", "views.png", "overlays/photo.png"})
      Board(35.0).Paint(folder_ / "own/" + name);
    folder_.Write("own/scene.yaml", "%YAML:1.0\n---\n" + BoardCamera() +
                                        "images:\n  - { file: \"photo.png\", camera: \"k\" }\n");
    folder_.Write("own/calibration.yml",
                  "camera_matrix: [300, 0, 159.5, 0, 300, 119.5, 0, 0, 1]\n");
    folder_.Write("own/cameras.txt", "1 PINHOLE 320 240 300 300 160 120\n");
    folder_.Write("own/images.txt", "1 1 0 0 0 0 0 1 1 photo.png\n\n");
    folder_.Write("own/report.html", "--seed=3\n");
    folder_.Write("own/trajectory.txt", "0.5\n");
  }
  // Exit code 2, one line that names the file, and every file as it was.
  void ExpectKept(const std::string& program, const std::string& flags, const std::string& name) {
    const std::map<std::string, std::string> before = Files();
    const Outcome outcome = RunProgram(program, flags + " --output='" + folder_ / "own" + "'");
    EXPECT_EQ(outcome.exit_code, 2) << program << " " << flags << outcome.err;
    EXPECT_CONTAINS(outcome.err, name + ": is read, and would be written over");
    EXPECT_TRUE(Files() == before) << program << " " << flags;
  }
  std::map<std::string, std::string> Files() const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path()))
      files[entry.path().string()] = entry.is_directory() ? "" : ReadAll(entry.path().string());
    return files;
  }
  std::string Flag(const std::string& name, const std::string& file) const {
    return " --" + name + "='" + folder_ / "own/" + file + "'";
  }
  const TestFolder folder_;
};

TEST_F(KeptInputs, AreKeptByEveryProgram) {
  const std::string photo = Flag("images", "photo.png");
  ExpectKept(CIRCLINE_CALIBRATE, Flag("scene", "scene.yaml"), "scene.yaml");
  ExpectKept(CIRCLINE_CALIBRATE, photo + Flag("camera", "calibration.yml"), "calibration.yml");
  ExpectKept(CIRCLINE_CALIBRATE, photo + Flag("import", ""), "cameras.txt");
  ExpectKept(CIRCLINE_RECONSTRUCT, Flag("images", "views.png"), "views.png");
  ExpectKept(CIRCLINE_COMPARE, Flag("images", "overlays"), "overlays/photo.png");
  ExpectKept(CIRCLINE_COMPARE, photo + Flag("save_options", "photo.png"), "photo.png");
  ExpectKept(CIRCLINE_COMPARE, photo + Flag("camera", "cameras.txt") + " --export_as=colmap",
             "cameras.txt");
  ExpectKept(CIRCLINE_COMPARE, photo + Flag("flagfile", "report.html"), "report.html");
  ExpectKept(CIRCLINE_TRACK, Flag("images", "overlays"), "overlays/photo.png");
  ExpectKept(CIRCLINE_TRACK, photo + Flag("timestamps", "trajectory.txt"), "trajectory.txt");
  folder_.Write("own/results.jsonl", "{}\n");
  const Outcome merged = RunCompare("--merge='" + folder_ / "own" + "' --output='" +
                                    folder_ / "none" + "'" + Flag("save_options", "results.jsonl"));
  EXPECT_EQ(merged.exit_code, 2);
  EXPECT_CONTAINS(merged.err, "own/results.jsonl: is read, and would be written over");
  folder_.Write("own/simulation.csv", "--trials=1\n");
  ExpectKept(CIRCLINE_SIMULATE, Flag("flagfile", "simulation.csv"), "simulation.csv");
}

TEST_F(KeptInputs, AreKeptByTheStudio) {
  fs::create_directories(folder_ / "own/export/photo.png");
  fs::rename(folder_ / "own/cameras.txt", folder_ / "own/export/photo.png/cameras.txt");
  const Outcome outcome =
      RunProgram(CIRCLINE_STUDIO,
                 Flag("images", "") + " --port=0" + Flag("camera", "export/photo.png/cameras.txt"));
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_CONTAINS(outcome.err, "cameras.txt: is read, and would be written over");
}

// Their folder may be written into.
TEST_F(KeptInputs, LieBesideWhatIsWritten) {
  const std::string rest = " --solvers=joint --output='" + folder_ / "own" + "'";
  EXPECT_EQ(RunCompare(Flag("scene", "scene.yaml") + rest).exit_code, 0);
  EXPECT_EQ(
      RunCompare(Flag("images", "photo.png") + Flag("camera", "cameras.txt") + rest).exit_code, 0);
  EXPECT_EQ(ReadAll(folder_ / "own/cameras.txt"), "1 PINHOLE 320 240 300 300 160 120\n");
}

}  // namespace
}  // namespace circline::apps
