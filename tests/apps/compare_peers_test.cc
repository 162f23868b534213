// OpenCV's solvePnP beside our solvers.
#include <gtest/gtest.h>

#include <iomanip>
#include <set>
#include <sstream>
#include <string>

#include "apps/compare/peers.h"
#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

using Json = nlohmann::json;

std::string Points(const Board& board) {
  std::ostringstream text;
  text << std::setprecision(12) << "    points: [";
  for (int i = 0; i < 6; ++i) {
    const double x = -0.9 + 0.6 * (i % 3), y = -0.9 + 1.2 * (i / 3);  // Of the plane Z = 0.
    const Eigen::Vector2d pixel = board.Pixel(x, y);
    text << (i == 0 ? "" : ", ") << pixel.x() << ", " << pixel.y() << ", " << x << ", " << y
         << ", 0";
  }
  return text.str() + "]\n";
}

TEST(ComparePeers, ExactPointsGiveTheTruth) {
  if (PeerSolvers().empty()) GTEST_SKIP() << "OpenCV here has no calib3d";
  const TestFolder folder;
  const Board board(40.0);
  board.Paint(folder / "a.png");
  const std::string scene =
      folder.Write("scene.yaml", "%YAML:1.0\n---\n" + BoardCamera() + "images:\n" +
                                     AnnotatedImage(board, "a.png") + Points(board) +
                                     AnnotatedImage(board, "a.png"));
  ASSERT_EQ(RunCompare("--peers --overlays=false --scene='" + scene + "' --output='" +
                       folder / "out" + "'")
                .exit_code,
            0);
  std::set<std::string> solved, refused;
  for (const Json& line : ReadJsonLines(folder / "out/results.jsonl")) {
    const std::string solver = line["solver"];
    if (solver.compare(0, 7, "opencv_") != 0) continue;
    if (line["status"] == "refused") {
      EXPECT_CONTAINS(line["message"].get<std::string>(), "gives 0 points");
      refused.insert(solver);
    } else if (line["hypothesis"] == 0) {
      EXPECT_LT(line["rotation_error_deg"], 1e-4) << line;
      EXPECT_LT(line["translation_error_deg"], 1e-4) << line;
      EXPECT_TRUE(line["probability"].is_null());  // OpenCV says nothing of these.
      EXPECT_TRUE(line["sigma_rotation_deg"][0].is_null());
      solved.insert(solver);
    }
  }
  const std::set<std::string> all = {"opencv_ippe", "opencv_iterative", "opencv_sqpnp"};
  EXPECT_EQ(solved, all);
  EXPECT_EQ(refused, all);  // The second photo has no points.
}

}  // namespace
}  // namespace circline::apps
