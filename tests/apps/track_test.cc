// circline_track on frames that the tests paint.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

using nlohmann::json;

class TrackTest : public testing::Test {
 protected:
  // A disc in a frame on a board that leans over, a degree and a half a frame.
  void PaintFrames(int count) {
    std::filesystem::create_directories(folder_ / "frames");
    for (int k = 0; k < count; ++k) Board(35.0 + 1.5 * k).Paint(FramePath(k));
  }
  std::string FramePath(int k) const {
    std::array<char, 16> name{};
    std::snprintf(name.data(), name.size(), "%03d.png", k);
    return folder_ / "frames/" + name.data();
  }
  Outcome Track(const std::string& arguments, const std::string& output = "out") const {
    return RunProgram(CIRCLINE_TRACK, "--focal_px=" + std::to_string(kFocal) + " " + arguments +
                                          " --output=" + (folder_ / output));
  }
  std::string Frames() const { return "--images='" + (folder_ / "frames") + "/*.png'"; }
  std::vector<json> Results(const std::string& output = "out") const {
    return ReadJsonLines(folder_ / output + "/results.jsonl");
  }

  TestFolder folder_;
};

int CountBegins(const std::vector<json>& results) {
  int count = 0;
  for (const json& line : results) count += line["reinitialized"].get<bool>() ? 1 : 0;
  return count;
}

TEST_F(TrackTest, WritesALineAFrameATrajectoryAReportAndPictures) {
  PaintFrames(8);
  const Outcome run = Track(Frames() + " --fps=10 --circle_radius=0.5");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_CONTAINS(run.out, "tracked");
  const std::vector<json> results = Results();
  ASSERT_EQ(results.size(), 8U);
  for (std::size_t k = 0; k < results.size(); ++k) {
    const json& line = results[k];
    EXPECT_EQ(line["frame"], k);
    EXPECT_NEAR(line["time_s"].get<double>(), 0.1 * static_cast<double>(k), 1e-12);
    EXPECT_EQ(line["status"], "ok") << line["message"];
    EXPECT_EQ(line["reinitialized"], k == 0);
    EXPECT_EQ(line["cold"], k == 0);
    EXPECT_TRUE(line["metric"].get<bool>());
    EXPECT_EQ(line["hypotheses"].size(), line["num_hypotheses"].get<std::size_t>());
    // The world's Z is the board's normal.
    const Board board(35.0 + 1.5 * static_cast<double>(k));
    double cosine = 0.0;
    for (int i = 0; i < 3; ++i)
      cosine += line["rotation"][static_cast<std::size_t>(3 * i + 2)].get<double>() *
                board.rotation(i, 2);
    EXPECT_GT(std::abs(cosine), std::cos(0.02)) << "frame " << k;
    EXPECT_TRUE(std::filesystem::exists(
        std::filesystem::path(folder_ / "out/overlays") /
        (std::filesystem::path(FramePath(static_cast<int>(k))).stem().string() + ".png")));
  }
  std::istringstream trajectory(ReadAll(folder_ / "out/trajectory.txt"));
  std::string line;
  std::getline(trajectory, line);
  EXPECT_EQ(line.front(), '#');
  for (int k = 0; k < 8; ++k) {
    double time = -1.0, x, y, z, qx, qy, qz, qw;
    ASSERT_TRUE(trajectory >> time >> x >> y >> z >> qx >> qy >> qz >> qw) << k;
    EXPECT_NEAR(time, 0.1 * k, 1e-6);
    EXPECT_NEAR(qx * qx + qy * qy + qz * qz + qw * qw, 1.0, 1e-9);
  }
  const std::string report = ReadAll(folder_ / "out/report.html");
  EXPECT_CONTAINS(report, "<svg");
  EXPECT_CONTAINS(report, "Probabilities");
  EXPECT_CONTAINS(report, "data:image/jpeg");
}

TEST_F(TrackTest, RunsAreRepeatable) {
  PaintFrames(5);
  ASSERT_EQ(Track(Frames(), "a").exit_code, 0);
  ASSERT_EQ(Track(Frames() + " --threads=1", "b").exit_code, 0);
  ExpectSameFiles(folder_ / "a", folder_ / "b");
}

TEST_F(TrackTest, ReadsTheVideoThatItWrites) {
  PaintFrames(6);
  const Outcome wrote = Track(Frames() + " --video_out=overlays.avi");
  ASSERT_EQ(wrote.exit_code, 0) << wrote.err;
  ASSERT_TRUE(std::filesystem::exists(folder_ / "out/overlays.avi"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/part.overlays.avi"));
  const std::string video = folder_ / "left,right.avi";
  std::filesystem::rename(folder_ / "out/overlays.avi", video);
  const Outcome read = Track("--video=" + video + " --overlays=false", "again");
  EXPECT_EQ(read.exit_code, 0) << read.err;
  const std::vector<json> results = Results("again");
  ASSERT_EQ(results.size(), 6U);
  EXPECT_CONTAINS(results.back()["image"].get<std::string>(), "#000005");
}

TEST_F(TrackTest, OneCircleGivenOnceIsAllThatIsFollowed) {
  PaintFrames(6);
  const Outcome run = Track(Frames() + " --roi=80,50,160,140 --overlays=false");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  for (const json& line : ReadJsonLines(folder_ / "out/observations.jsonl")) {
    ASSERT_EQ(line["ellipses"].size(), 1U);
    EXPECT_EQ(line["ellipses"][0]["id"], "circle");
    EXPECT_TRUE(line["pencils"].empty());
  }
  EXPECT_EQ(CountBegins(Results()), 1);
}

TEST_F(TrackTest, NamesFramesThatCannotBeUsedAndGoesOn) {
  PaintFrames(7);
  std::ofstream(FramePath(2)) << "no picture";
  std::ofstream(FramePath(3)).close();
  cv::imwrite(FramePath(4), cv::Mat(60, 80, CV_8U, cv::Scalar(0)));
  const Outcome run = Track(Frames() + " --overlays=false");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_CONTAINS(run.err, "002.png");
  EXPECT_CONTAINS(run.err, "003.png");
  EXPECT_CONTAINS(run.err, "004.png: the frame has 80 x 60 pixels");
  const std::vector<json> results = Results();
  ASSERT_EQ(results.size(), 7U);
  for (const std::size_t bad : {2U, 3U, 4U}) EXPECT_EQ(results[bad]["status"], "failed");
  for (const std::size_t good : {0U, 1U, 5U, 6U}) EXPECT_EQ(results[good]["status"], "ok");
  EXPECT_EQ(CountBegins(results), 1);
}

TEST_F(TrackTest, TimeThatRunsBackwardsIsNamed) {
  PaintFrames(4);
  const std::string times = folder_.Write("times.txt", "# seconds\n0\n0.1\n0.05\n0.2\n");
  const Outcome run = Track(Frames() + " --overlays=false --timestamps=" + times);
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_CONTAINS(run.err, "002.png");
  const std::vector<json> results = Results();
  ASSERT_EQ(results.size(), 4U);
  EXPECT_EQ(results[2]["status"], "failed");
  EXPECT_EQ(results[3]["status"], "ok");
}

TEST_F(TrackTest, ACutBeginsAnew) {
  PaintFrames(4);
  for (int k = 4; k < 9; ++k) {  // Another board, elsewhere.
    Board board(-50.0);
    board.Paint(FramePath(k));
    const cv::Mat photo = cv::imread(FramePath(k), cv::IMREAD_GRAYSCALE);
    cv::Mat turned, moved(photo.size(), CV_8U, photo.at<std::uint8_t>(0, 0));
    cv::rotate(photo, turned, cv::ROTATE_90_CLOCKWISE);
    turned(cv::Rect(0, 40, 240, 240)).copyTo(moved(cv::Rect(80, 0, 240, 240)));
    cv::imwrite(FramePath(k), moved);
  }
  const Outcome run = Track(Frames() + " --overlays=false");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const std::vector<json> results = Results();
  EXPECT_EQ(CountBegins(results), 2);
  EXPECT_TRUE(results[0]["reinitialized"].get<bool>());
}

TEST_F(TrackTest, BeginsAFolderAnew) {
  PaintFrames(3);
  ASSERT_EQ(Track(Frames()).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out/overlays/002.png"));
  ASSERT_EQ(Track("--images='" + FramePath(0) + "," + FramePath(1) + "'").exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out/overlays/001.png"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/overlays/002.png"));
}

TEST_F(TrackTest, NamesTheFlagOfAVideoThatIsNone) {
  EXPECT_CONTAINS(Track("--video=none.mp4").err, "--video=none.mp4: the file does not exist");
  EXPECT_CONTAINS(Track("--video=" + folder_.path()).err, ": is a folder, not a video");
}

TEST_F(TrackTest, UnusableInputWritesNothing) {
  PaintFrames(2);
  const std::string text = folder_.Write("notes.mp4", "no video");
  for (const std::string& arguments :
       {"--video=" + text, "--video=" + (folder_ / "none.mp4"), "--video=" + text + " " + Frames(),
        Frames() + " --video_out=a/b.mp4", Frames() + " --video_out=b.mov",
        Frames() + " --search_px=1", Frames() + " --fps=-1", Frames() + " --resume",
        Frames() + " --lost_after=0", Frames() + " --timestamps=none.txt",
        Frames() + " --robust_loss=huber,cauchy", Frames() + " --nonsense=1"}) {
    const Outcome run = Track(arguments);
    EXPECT_EQ(run.exit_code, 2) << arguments << run.err;
    EXPECT_FALSE(run.err.empty());
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out")) << arguments;
  }
}

}  // namespace
}  // namespace circline::apps
