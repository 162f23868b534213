// circline_compare as its users run it.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "apps/common/output_file.h"
#include "tests/apps/board_set.h"
#include "tests/apps/json_lines.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

using Json = nlohmann::json;

TEST(Compare, WritesWhatItPromises) {
  const TestFolder folder;
  const std::string scene = MakeSet(folder);
  const Outcome outcome = RunCompare("--scene='" + scene + "' --output='" + folder / "out" + "'");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_CONTAINS(outcome.out, "joint");
  // The same photo twice: two pictures.
  EXPECT_EQ(
      FilesIn(folder / "out"),
      (std::set<std::string>{"observations.jsonl", "report.html", "results.jsonl", "summary.csv",
                             "timings.jsonl", "overlays/tilt25.png", "overlays/tilt25_2.png",
                             "overlays/tilt40.png", "overlays/tilt40_2.png", "overlays/tilt55.png",
                             "overlays/tilt55_2.png"}));

  const std::vector<Json> results = ReadJsonLines(folder / "out/results.jsonl");
  int num_joint = 0;
  for (const Json& line : results) {
    for (const char* key :
         {"image", "solver", "stage", "loss", "loss_scale_px", "status", "message", "hypothesis",
          "num_hypotheses", "probability", "rotation", "translation", "metric", "rms_px",
          "num_inliers", "num_observations", "sigma_rotation_deg", "free_directions"}) {
      ASSERT_TRUE(line.contains(key)) << key << " in " << line;
    }
    if (line["status"] != "ok") {
      EXPECT_NE(line["message"], "");
      continue;
    }
    EXPECT_EQ(line["rotation"].size(), 9U);
    EXPECT_TRUE(line.contains("normal_error_deg"));
    EXPECT_EQ(line.contains("rotation_error_deg"), line["free_directions"].empty()) << line;
    if (line["solver"] == "joint" && line["hypothesis"] == 0) ++num_joint;
  }
  EXPECT_EQ(num_joint, 6);

  const std::vector<Json> observations = ReadJsonLines(folder / "out/observations.jsonl");
  ASSERT_EQ(observations.size(), 6U);
  for (std::size_t i = 0; i < observations.size(); i += 2) {
    const Json& ellipse = observations[i]["ellipses"].at(0);
    EXPECT_EQ(ellipse["id"], "c");
    EXPECT_EQ(ellipse["conic"].size(), 6U);
    EXPECT_NEAR(ellipse["coverage"], 1.0, 1e-9);
    EXPECT_EQ(observations[i]["segments"].size(), 4U);
    EXPECT_EQ(observations[i]["segments"][0][4], "X");
    EXPECT_EQ(observations[i]["pencils"][0]["num_segments"], 2);
  }
  const std::string csv = ReadAll(folder / "out/summary.csv");
  EXPECT_EQ(csv.compare(0, 30, "solver,stage,loss,loss_scale_p"), 0) << csv;
  const std::string report = ReadAll(folder / "out/report.html");
  for (const char* reference :
       {"http:", "https:", "<link", "url(", "@import", "src='/", "src=\"/"}) {
    EXPECT_EQ(report.find(reference), std::string::npos) << reference;  // Nothing from elsewhere.
  }
  EXPECT_CONTAINS(report, "data:image/jpeg;base64,");
}

TEST(Compare, ExactEvidenceGivesTheTruth) {
  const TestFolder folder;
  const std::string scene = MakeSet(folder);
  ASSERT_EQ(RunCompare("--scene='" + scene + "' --overlays=false --output='" + folder / "out" + "'")
                .exit_code,
            0);
  const std::vector<Json> results = ReadJsonLines(folder / "out/results.jsonl");
  std::set<std::string> solvers;
  for (const Json& line : results) {
    if (line["status"] != "ok" || line["hypothesis"] != 0 ||
        !line.contains("translation_error_deg"))
      continue;
    if (!line.contains("rotation_error_deg")) continue;
    EXPECT_LT(line["rotation_error_deg"], 1e-3) << line;
    EXPECT_LT(line["translation_error_deg"], 1e-3) << line;
    solvers.insert(line["solver"]);
  }
  EXPECT_EQ(solvers.count("circle_frame"), 1U);
  EXPECT_EQ(solvers.count("line_pairs"), 1U);
  EXPECT_EQ(solvers.count("joint"), 1U);
}

TEST(Compare, StatesTheFocalLengthItFinds) {
  const TestFolder folder;
  const std::string scene = MakeSet(folder);
  ASSERT_EQ(RunCompare("--scene='" + scene + "' --focal_sigma=0.05 --overlays=false --output='" +
                       folder / "out" + "'")
                .exit_code,
            0);
  int found = 0;
  for (const Json& line : ReadJsonLines(folder / "out/results.jsonl")) {
    if (line["status"] != "ok") continue;
    EXPECT_EQ(line.contains("focal_scale"), line["stage"] == "refined") << line;
    if (line["solver"] != "joint" || line["hypothesis"] != 0) continue;
    const double scale = line["focal_scale"], sigma = line["focal_sigma"];
    EXPECT_GT(sigma, 0.0);
    EXPECT_LE(sigma, 0.05 * scale * 1.001);  // The prior alone, or less.
    EXPECT_LT(std::abs(scale - 1.0), 3.0 * sigma);
    ++found;
  }
  EXPECT_EQ(found, 6);
}

// The scene file says how well the camera is known, unless --focal_sigma does.
TEST(Compare, TakesTheFocalSigmaOfTheSceneFile) {
  const TestFolder folder;
  std::string content = ReadAll(MakeSet(folder));
  const std::size_t matrix = content.find("camera_matrix");
  ASSERT_NE(matrix, std::string::npos);
  const std::string scene =
      folder.Write("known.yaml", content.insert(matrix, "focal_sigma: 0.05, "));
  const auto estimates_focal = [&](const std::string& flags) {
    EXPECT_EQ(RunCompare("--scene='" + scene + "' --solvers=joint --overlays=false --output='" +
                         folder / "out" + "' " + flags)
                  .exit_code,
              0);
    int found = 0;
    for (const Json& line : ReadJsonLines(folder / "out/results.jsonl"))
      found += line["hypothesis"] == 0 && line.contains("focal_scale") ? 1 : 0;
    return found;
  };
  EXPECT_EQ(estimates_focal(""), 6);  // Annotated and detected.
  EXPECT_EQ(estimates_focal("--focal_sigma=0"), 0);
}

TEST(Compare, NamesWhatIsWrongInANoiseModel) {
  const TestFolder folder;
  const std::string scene = MakeSet(folder);
  const std::string noise = folder.Write("noise.yml", "contour: 0.1\n");
  const Outcome outcome = RunCompare("--scene='" + scene + "' --noise_model='" + noise +
                                     "' --output='" + folder / "out" + "'");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_CONTAINS(outcome.err, "--noise_model: ");
  EXPECT_CONTAINS(outcome.err, "unknown key 'contour'");
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

TEST(Compare, SameBytesForAnyNumberOfThreads) {
  const TestFolder folder;
  const std::string scene = MakeSet(folder);
  for (const char* threads : {"1", "2", "3"}) {
    const Outcome outcome = RunCompare("--scene='" + scene + "' --threads=" + threads +
                                       " --robust_loss=huber,tukey --output='" +
                                       folder / (std::string("out") + threads) + "'");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  ExpectSameFiles(folder / "out1", folder / "out2");
  ExpectSameFiles(folder / "out1", folder / "out3");
}

TEST(Compare, ShardsPartTheImages) {
  const TestFolder folder;
  const std::string scene = MakeSet(folder);
  const auto lines = [&](const std::string& shard) {
    EXPECT_EQ(RunCompare("--scene='" + scene + "' --overlays=false --shard=" + shard +
                         " --output='" + folder / "out" + "'")
                  .exit_code,
              0);
    return ReadAll(folder / "out/observations.jsonl");
  };
  const std::vector<std::string> whole = [&] {
    std::vector<std::string> parts;
    std::istringstream text(lines("0/1"));
    for (std::string line; std::getline(text, line);) parts.push_back(line + "\n");
    return parts;
  }();
  ASSERT_EQ(whole.size(), 6U);
  EXPECT_EQ(lines("0/2"), whole[0] + whole[2] + whole[4]);
  EXPECT_EQ(lines("1/2"), whole[1] + whole[3] + whole[5]);
  EXPECT_EQ(lines("2/2"), whole[0] + whole[2] + whole[4]);
}

// ---- Bad input: the exit code, one line that names the thing, nothing half-written.

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
    EXPECT_CONTAINS(outcome.err, words.c_str());
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
  for (const Json& line : ReadJsonLines(folder_ / "out/results.jsonl"))
    EXPECT_EQ(line["image"], "good.png");
  const std::vector<Json> observations = ReadJsonLines(folder_ / "out/observations.jsonl");
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
  const Outcome outcome = RunCompare("--scene='" + SceneOf(Image("good.png")) + "' --output='" +
                                     folder_ / "file" + "'");
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
  for (const Json& line : ReadJsonLines(folder_ / "out/results.jsonl"))
    solvers.insert(line["solver"]);
  EXPECT_EQ(solvers, (std::set<std::string>{"joint", "line_pairs"}));
}

}  // namespace
}  // namespace circline::apps
