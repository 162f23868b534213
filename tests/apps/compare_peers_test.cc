// OpenCV's, OpenGV's and ViSP's poses beside our solvers.
#include <gtest/gtest.h>

#include <iomanip>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "apps/compare/peers.h"
#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

using nlohmann::json;

std::string Points(const Board& board) {
  std::ostringstream text;
  text << std::setprecision(12) << "    points: [";
  for (int i = 0; i < 6; ++i) {
    // Of the plane Z = 0; no three of the first four on a line.
    const double x = -0.9 + 0.6 * (i / 2), y = -0.9 + 1.2 * (i % 2);
    const Eigen::Vector2d pixel = board.Pixel(x, y);
    text << (i == 0 ? "" : ", ") << pixel.x() << ", " << pixel.y() << ", " << x << ", " << y
         << ", 0";
  }
  return text.str() + "]\n";
}

using Row = std::pair<std::string, std::string>;  // Solver, stage.

// A photo of a board with known points, and one without, through our solvers and all peers; the
// lines of the peers.
class ComparePeers : public testing::Test {
 protected:
  void SetUp() override {
    const Board board(40.0);
    board.Paint(folder_ / "a.png");
    const std::string scene =
        folder_.Write("scene.yaml", "%YAML:1.0\n---\n" + BoardCamera() + "images:\n" +
                                        AnnotatedImage(board, "a.png") + Points(board) +
                                        AnnotatedImage(board, "a.png"));
    ASSERT_EQ(CompareScene(scene, folder_ / "out", "--peers --overlays=false").exit_code, 0);
    for (const PeerSolver& peer : PeerSolvers()) {
      peers_.insert({peer.name, SolverStageName(peer.stage)});
    }
    for (const json& line : ReadJsonLines(folder_ / "out/results.jsonl")) {
      if (peers_.count(RowOf(line)) != 0) lines_.push_back(line);
    }
  }
  static Row RowOf(const json& line) { return {line["solver"], line["stage"]}; }
  // The peers whose name begins so.
  std::set<Row> Rows(const std::string& prefix) const {
    std::set<Row> rows;
    for (const Row& row : peers_) {
      if (row.first.compare(0, prefix.size(), prefix) == 0) rows.insert(row);
    }
    return rows;
  }
  void ExpectPointsGiveTheTruth(const std::string& prefix) const {
    std::set<Row> solved, refused;
    for (const json& line : lines_) {
      if (Rows(prefix).count(RowOf(line)) == 0) continue;
      if (line["status"] == "refused") {
        EXPECT_CONTAINS(line["message"].get<std::string>(), "gives 0 points");
        refused.insert(RowOf(line));
      } else if (line["hypothesis"] == 0) {
        EXPECT_LT(line["rotation_error_deg"], 1e-4) << line;
        EXPECT_LT(line["translation_error_deg"], 1e-4) << line;
        EXPECT_LT(line["rms_px"], 1e-3) << line;
        solved.insert(RowOf(line));
      }
    }
    EXPECT_EQ(solved, Rows(prefix));
    EXPECT_EQ(refused, Rows(prefix));  // The second photo has no points.
  }

  const TestFolder folder_;
  std::set<Row> peers_;
  std::vector<json> lines_;
};

TEST_F(ComparePeers, ExactPointsGiveTheTruth) {
  if (Rows("opencv_").empty()) GTEST_SKIP() << "OpenCV here has no calib3d";
  EXPECT_EQ(Rows("opencv_").size(), 3U);
  ExpectPointsGiveTheTruth("opencv_");
}

TEST_F(ComparePeers, ExactPointsGiveTheTruthInOpenGv) {
  if (Rows("opengv_").empty()) GTEST_SKIP() << "built without CIRCLINE_WITH_OPENGV";
  EXPECT_EQ(Rows("opengv_").size(), 3U);
  ExpectPointsGiveTheTruth("opengv_");
}

TEST_F(ComparePeers, ExactPointsGiveTheTruthInVisp) {
  if (Rows("visp_").empty()) GTEST_SKIP() << "built without CIRCLINE_WITH_VISP";
  EXPECT_EQ(Rows("visp_points").size(), 2U);
  ExpectPointsGiveTheTruth("visp_points");
}

TEST_F(ComparePeers, AnExactCircleGivesTheTrueNormalInVisp) {
  if (Rows("visp_").empty()) GTEST_SKIP() << "built without CIRCLINE_WITH_VISP";
  int answers = 0, others = 0;
  for (const json& line : lines_) {
    if (line["solver"] != "visp_circle") continue;
    ASSERT_EQ(line["num_hypotheses"], 2) << line;
    EXPECT_FALSE(line.contains("rotation_error_deg"));  // Free about the normal.
    EXPECT_TRUE(line["metric"] == false);               // The scene gives no radius.
    if (line["hypothesis"] == 0) {                      // Told by the centre.
      EXPECT_LT(line["normal_error_deg"], 1e-4) << line;
      EXPECT_LT(line["translation_error_deg"], 1e-4) << line;
      ++answers;
    } else {
      EXPECT_GT(line["normal_error_deg"], 10.0) << line;
      ++others;
    }
  }
  EXPECT_EQ(answers, 2);
  EXPECT_EQ(others, 2);
}

TEST_F(ComparePeers, StateNoProbabilityAndNoCovariance) {
  if (peers_.empty()) GTEST_SKIP() << "no peers in this build";
  for (const json& line : lines_) {
    if (line["status"] != "ok") continue;
    EXPECT_TRUE(line["probability"].is_null()) << line;
    EXPECT_TRUE(line["sigma_rotation_deg"][0].is_null()) << line;
    EXPECT_TRUE(line["sigma_normal_deg"].is_null()) << line;
  }
}

TEST_F(ComparePeers, AreListed) {
  const std::string list = RunCompare("--list_solvers").out;
  for (const Row& row : peers_) EXPECT_CONTAINS(list, row.first);
}

}  // namespace
}  // namespace circline::apps
