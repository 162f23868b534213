// circline_compare and bad input: the exit code, one line that names the thing, nothing
// half-written.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <string>

#include "apps/common/output_file.h"
#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

using nlohmann::json;

class CompareBadInput : public testing::Test {
 protected:
  CompareBadInput() {
    Board(30.0).Paint(folder_ / "good.png");
    folder_.Write("words.jpg", "these are words");
    folder_.Write("empty.jpg", "");
  }
  std::string SceneOf(const std::string& images) {
    return folder_.Write("scene.yaml", "%YAML:1.0\n---\n" + BoardCamera() + "images:\n" + images);
  }
  std::string Image(const std::string& file) {
    return "  - { file: \"" + file + "\", camera: \"k\" }\n";
  }
  std::string Arguments(const std::string& scene) {
    return "--scene='" + scene + "' --output='" + folder_ / "out" + "' ";
  }
  // Exit code 2, one line on stderr with these words in it, no output.
  void ExpectUnusable(const std::string& arguments, const std::string& words) {
    const Outcome outcome = RunCompare(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments << "\n" << outcome.err;
    EXPECT_CONTAINS(outcome.err, words);
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  }
  const TestFolder folder_;
};

TEST_F(CompareBadInput, UnreadablePhotosAreNamedAndTheRestIsDone) {
  const std::string scene =
      SceneOf(Image("missing.jpg") + Image("good.png") + Image("words.jpg") + Image("empty.jpg"));
  const Outcome outcome = RunCompare(Arguments(scene));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_CONTAINS(outcome.err, "missing.jpg: the file does not exist\n");
  EXPECT_CONTAINS(outcome.err, "words.jpg: is not an image that can be read\n");
  EXPECT_CONTAINS(outcome.err, "empty.jpg: the file is empty\n");
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 3) << outcome.err;
  for (const json& line : ReadJsonLines(folder_ / "out/results.jsonl"))
    EXPECT_EQ(line["image"], "good.png");
  const std::vector<json> observations = ReadJsonLines(folder_ / "out/observations.jsonl");
  ASSERT_EQ(observations.size(), 4U);
  EXPECT_TRUE(observations[0].contains("error"));
  EXPECT_FALSE(observations[1].contains("error"));
  EXPECT_FALSE(ReadJsonLines(folder_ / "out/results.jsonl").empty());
}

TEST_F(CompareBadInput, PhotoOfAnotherSizeThanItsCamera) {
  cv::imwrite(folder_ / "small.png", cv::Mat::zeros(20, 30, CV_8U));
  const Outcome outcome = RunCompare(Arguments(SceneOf(Image("small.png"))));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_CONTAINS(outcome.err, "30 x 20");
}

TEST_F(CompareBadInput, SceneFile) {
  const std::string good = Image("good.png");
  ExpectUnusable(Arguments(folder_ / "none.yaml"), "none.yaml: cannot be opened");
  ExpectUnusable(Arguments(folder_.path()), "is a folder");
  ExpectUnusable(Arguments(SceneOf("  - { file: \"good.png\", camera: \"k\", circels: [] }\n")),
                 "unknown key 'circels'; did you mean 'circles'?");
  ExpectUnusable(Arguments(SceneOf("  - { file: \"good.png\", camera: \"K2\" }\n")),
                 "there is no camera 'K2'");
  ExpectUnusable(Arguments(folder_.Write("broken.yaml", "%YAML:1.0\n---\nimages: [ {\n")),
                 "broken.yaml: not valid");
  ExpectUnusable(
      Arguments(folder_.Write("s.yaml",
                              "cameras:\n  - { id: \"k\", model: \"pinhole\" }\nimages:\n" + good)),
      "'camera_matrix' is missing: a camera needs its focal length");
}

TEST_F(CompareBadInput, Flags) {
  const std::string good = Arguments(SceneOf(Image("good.png")));
  ExpectUnusable(good + "--robust_los=huber",
                 "unknown flag --robust_los; did you mean 'robust_loss'?");
  ExpectUnusable(good + "--robust_loss=hubert", "--robust_loss: 'hubert' is not one of");
  ExpectUnusable(good + "--loss_scale_px=0", "--loss_scale_px: '0'");
  ExpectUnusable(good + "--loss_scale_px=1,-2", "--loss_scale_px: '-2'");
  ExpectUnusable(good + "--conic_loss=x", "--conic_loss: 'x'");
  ExpectUnusable(good + "--line_loss_scale_px=x", "--line_loss_scale_px: 'x'");
  ExpectUnusable(good + "--inlier_threshold_px=-1", "--inlier_threshold_px=-1");
  ExpectUnusable(good + "--inlier_threshold_px=two", "--inlier_threshold_px=two: must be a number");
  ExpectUnusable(good + "--inlier_threshold_px=nan", "--inlier_threshold_px=nan");
  ExpectUnusable(good + "--ransac_confidence=1.5", "--ransac_confidence=1.5");
  ExpectUnusable(good + "--ransac_max_iterations=0", "--ransac_max_iterations=0");
  ExpectUnusable(good + "--min_arc_deg=400", "--min_arc_deg=400");
  ExpectUnusable(good + "--seed=-1", "--seed=-1");
  ExpectUnusable(good + "--threads=-2", "--threads=-2");
  ExpectUnusable(good + "--threads", "--threads: its value is missing");
  ExpectUnusable(good + "--shard=3/2", "--shard=3/2");
  ExpectUnusable(good + "--solvers=joint,line_pair",
                 "there is no solver 'line_pair'; did you mean 'line_pairs'?");
  ExpectUnusable(good + "stray", "unexpected argument 'stray'");
  ExpectUnusable("--output='" + folder_ / "out" + "'", "give --scene");
  ExpectUnusable("--scene='" + folder_ / "scene.yaml" + "'", "--output is missing");
  ExpectUnusable(good + "--images=x.jpg", "not both");
}

TEST_F(CompareBadInput, CameraFile) {
  const std::string photos =
      "--images='" + folder_ / "good.png" + "' --output='" + folder_ / "out" + "' --camera=";
  ExpectUnusable(photos + "'" + folder_ / "none.yml" + "'", "none.yml: cannot be opened");
  ExpectUnusable(
      photos + "'" +
          folder_.Write("c.yml", "%YAML:1.0\n---\nimage_width: 320\nimage_height: 240\n") + "'",
      "'camera_matrix' is missing: a camera needs its focal length");
  ExpectUnusable("--images='" + folder_ / "*.tif" + "' --output='" + folder_ / "out" +
                     "' --camera='" +
                     folder_.Write("cameras.txt", "1 SIMPLE_PINHOLE 320 240 300 160 120\n") + "'",
                 "nothing matches");
}

TEST_F(CompareBadInput, OutputThatCannotBe) {
  folder_.Write("file", "x");
  const Outcome outcome = CompareScene(SceneOf(Image("good.png")), folder_ / "file");
  EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
  EXPECT_EQ(ReadAll(folder_ / "file"), "x");
}

TEST_F(CompareBadInput, FolderOfARunUnderWay) {
  const std::string arguments = Arguments(SceneOf(Image("good.png")));
  ASSERT_EQ(RunCompare(arguments).exit_code, 0);
  const std::string results = ReadAll(folder_ / "out/results.jsonl");
  std::filesystem::copy(folder_ / "out", folder_ / "shard",
                        std::filesystem::copy_options::recursive);
  FolderLock lock;
  ASSERT_TRUE(lock.Acquire(folder_ / "out").ok());
  for (const std::string& flags :
       {arguments + "--seed=3",
        "--merge='" + folder_ / "shard" + "' --output='" + folder_ / "out" + "'"}) {
    const Outcome outcome = RunCompare(flags);
    EXPECT_EQ(outcome.exit_code, 2) << flags;
    EXPECT_CONTAINS(outcome.err, "another run is writing into this folder");
  }
  EXPECT_EQ(ReadAll(folder_ / "out/results.jsonl"), results);
}

TEST_F(CompareBadInput, HelpAndVersionAndSolvers) {
  Outcome outcome = RunCompare("--help");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_CONTAINS(outcome.out, "--loss_scale_px");
  outcome = RunCompare("--version");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_CONTAINS(outcome.out, "circline_compare ");
  outcome = RunCompare("--list_solvers");
  EXPECT_EQ(outcome.exit_code, 0);
  for (const char* name : {"circle_center", "circle_frame", "line_pairs", "joint"}) {
    EXPECT_CONTAINS(outcome.out, name);
  }
}

TEST_F(CompareBadInput, PhotosWithoutASceneFile) {
  const std::string camera = folder_.Write("cameras.txt", "1 SIMPLE_PINHOLE 320 240 300 160 120\n");
  const Outcome outcome =
      RunCompare("--images='" + folder_ / "g*.png" + "' --camera='" + camera +
                 "' --solvers=joint,line_pairs --output='" + folder_ / "out" + "'");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  std::set<std::string> solvers;
  for (const json& line : ReadJsonLines(folder_ / "out/results.jsonl"))
    solvers.insert(line["solver"]);
  EXPECT_EQ(solvers, (std::set<std::string>{"joint", "line_pairs"}));
}

}  // namespace
}  // namespace circline::apps
