// circline_compare on real photographs, where they are at hand.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "apps/compare/summary.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

// The folder of photographs with truth: $CIRCLINE_DATA, or beside the sources. Empty if there is
// none.
std::string DataFolder() {
  std::vector<std::string> candidates;
  if (const char* given = std::getenv("CIRCLINE_DATA")) candidates.emplace_back(given);
  candidates.emplace_back(CIRCLINE_SOURCE_DIR "/../shared/data");
  for (const std::string& folder : candidates) {
    if (std::filesystem::is_directory(folder)) return folder;
  }
  return "";
}

// Runs a demo scene on the photographs of a set and returns the errors of the best hypotheses.
class PhotographsTest : public testing::Test {
 protected:
  void RunDemo(const std::string& demo, const std::string& set) {
    const std::string photos = DataFolder() + "/" + set;
    if (DataFolder().empty() || !std::filesystem::is_directory(photos)) {
      GTEST_SKIP() << "no photographs here: set CIRCLINE_DATA to the folder that has " << set;
    }
    for (const auto& entry : std::filesystem::directory_iterator(photos)) {
      std::filesystem::create_symlink(std::filesystem::absolute(entry.path()),
                                      folder_ / entry.path().filename().string());
    }
    const std::string scene = folder_.Write(
        "scene.yaml", ReadAll(std::string(CIRCLINE_SOURCE_DIR) + "/apps/demo/" + demo));
    const Outcome outcome = CompareScene(scene, folder_ / "out", "--overlays=false");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    for (const nlohmann::json& line : ReadJsonLines(folder_ / "out/results.jsonl")) {
      if (line["status"] == "ok" && line["hypothesis"] == 0 &&
          line.contains("rotation_error_deg")) {
        errors_[std::string(line["solver"]) + " " + std::string(line["stage"])].push_back(
            line["rotation_error_deg"]);
      }
    }
  }

  const TestFolder folder_;
  std::map<std::string, std::vector<double>> errors_;
};

TEST_F(PhotographsTest, ChessboardsWithEverythingDetected) {
  RunDemo("chessboard.yaml", "chessboard-opencv");
  if (IsSkipped() || HasFatalFailure()) return;
  EXPECT_EQ(errors_["joint refined"].size(), 26U);
  // README.md says 0.15.
  EXPECT_LT(Median(errors_["joint refined"]), 0.155);
  EXPECT_LT(Median(errors_["line_pairs refined"]), 0.155);
}

// Nothing is known of the camera, 495.7 px, nor that the discs form a grid.
TEST_F(PhotographsTest, FourPhotographsOfDiscsCalibrate) {
  const std::string photos = DataFolder() + "/circles-discocal-rgb";
  if (DataFolder().empty() || !std::filesystem::is_directory(photos))
    GTEST_SKIP() << "no photographs here: set CIRCLINE_DATA";
  const Outcome outcome =
      RunProgram(CIRCLINE_CALIBRATE, "--images='" + photos + "/circle_left_raw_00[0-3].jpg' " +
                                         "--overlays=false --output='" + folder_ / "out" + "'");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto made = nlohmann::json::parse(ReadAll(folder_ / "out/calibration.json"));
  const double fx = made["cameras"][0]["fx"], sigma = made["cameras"][0]["sigma"]["fx"];
  EXPECT_NEAR(fx, 495.7, 3.0 * sigma);
  EXPECT_LT(sigma, 5.0);
}

}  // namespace
}  // namespace circline::apps
