// circline_compare as its users run it.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

using nlohmann::json;

class Compare : public testing::Test {
 protected:
  Outcome Run(const std::string& flags = "", const std::string& output = "out") const {
    return CompareScene(scene_, folder_ / output, flags);
  }
  const TestFolder folder_;
  std::string scene_ = MakeSet(folder_);
};

TEST_F(Compare, WritesWhatItPromises) {
  const Outcome outcome = Run();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_CONTAINS(outcome.out, "joint");
  // The same photo twice: two pictures.
  EXPECT_EQ(
      FilesIn(folder_ / "out"),
      (std::set<std::string>{"observations.jsonl", "report.html", "results.jsonl", "summary.csv",
                             "timings.jsonl", "overlays/tilt25.png", "overlays/tilt25_2.png",
                             "overlays/tilt40.png", "overlays/tilt40_2.png", "overlays/tilt55.png",
                             "overlays/tilt55_2.png"}));

  const std::vector<json> results = ReadJsonLines(folder_ / "out/results.jsonl");
  int num_joint = 0;
  for (const json& line : results) {
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

  const std::vector<json> observations = ReadJsonLines(folder_ / "out/observations.jsonl");
  ASSERT_EQ(observations.size(), 6U);
  for (std::size_t i = 0; i < observations.size(); i += 2) {
    const json& ellipse = observations[i]["ellipses"].at(0);
    EXPECT_EQ(ellipse["id"], "c");
    EXPECT_EQ(ellipse["conic"].size(), 6U);
    EXPECT_NEAR(ellipse["coverage"], 1.0, 1e-9);
    EXPECT_EQ(observations[i]["segments"].size(), 4U);
    EXPECT_EQ(observations[i]["segments"][0][4], "X");
    EXPECT_EQ(observations[i]["pencils"][0]["num_segments"], 2);
  }
  const std::string csv = ReadAll(folder_ / "out/summary.csv");
  EXPECT_EQ(csv.compare(0, 30, "solver,stage,loss,loss_scale_p"), 0) << csv;
  EXPECT_CONTAINS(ReadAll(folder_ / "out/report.html"), "data:image/jpeg;base64,");
}

TEST_F(Compare, ExactEvidenceGivesTheTruth) {
  ASSERT_EQ(Run("--overlays=false").exit_code, 0);
  const std::vector<json> results = ReadJsonLines(folder_ / "out/results.jsonl");
  std::set<std::string> solvers;
  for (const json& line : results) {
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

TEST_F(Compare, StatesTheFocalLengthItFinds) {
  ASSERT_EQ(Run("--focal_sigma=0.05 --overlays=false").exit_code, 0);
  int found = 0;
  for (const json& line : ReadJsonLines(folder_ / "out/results.jsonl")) {
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
TEST_F(Compare, TakesTheFocalSigmaOfTheSceneFile) {
  std::string content = ReadAll(scene_);
  const std::size_t matrix = content.find("camera_matrix");
  ASSERT_NE(matrix, std::string::npos);
  scene_ = folder_.Write("known.yaml", content.insert(matrix, "focal_sigma: 0.05, "));
  const auto estimates_focal = [&](const std::string& flags) {
    EXPECT_EQ(Run("--solvers=joint --overlays=false " + flags).exit_code, 0);
    int found = 0;
    for (const json& line : ReadJsonLines(folder_ / "out/results.jsonl"))
      found += line["hypothesis"] == 0 && line.contains("focal_scale") ? 1 : 0;
    return found;
  };
  EXPECT_EQ(estimates_focal(""), 6);  // Annotated and detected.
  EXPECT_EQ(estimates_focal("--focal_sigma=0"), 0);
}

TEST_F(Compare, NamesWhatIsWrongInANoiseModel) {
  const std::string noise = folder_.Write("noise.yml", "contour: 0.1\n");
  const Outcome outcome = Run("--noise_model='" + noise + "'");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_CONTAINS(outcome.err, "--noise_model: ");
  EXPECT_CONTAINS(outcome.err, "unknown key 'contour'");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

TEST_F(Compare, SameBytesForAnyNumberOfThreads) {
  for (const char* threads : {"1", "2", "3"}) {
    const Outcome outcome = Run(std::string("--robust_loss=huber,tukey --threads=") + threads,
                                std::string("out") + threads);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  ExpectSameFiles(folder_ / "out1", folder_ / "out2");
  ExpectSameFiles(folder_ / "out1", folder_ / "out3");
}

TEST_F(Compare, ShardsPartTheImages) {
  const auto lines = [&](const std::string& shard) {
    EXPECT_EQ(Run("--overlays=false --shard=" + shard).exit_code, 0);
    return ReadAll(folder_ / "out/observations.jsonl");
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

}  // namespace
}  // namespace circline::apps
