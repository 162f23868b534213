// circline_calibrate on painted boards of which nothing is known.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

Outcome Calibrate(const std::string& arguments) {
  return RunProgram(CIRCLINE_CALIBRATE, arguments);
}

nlohmann::json ReadJson(const std::string& path) {
  std::ifstream file(path);
  return nlohmann::json::parse(file);
}

class CalibrateTest : public testing::Test {
 protected:
  // A disc in a frame, tilted about one axis only.
  void SetUp() override {
    for (const double tilt : {-55.0, -40.0, 35.0, 45.0, 55.0})
      Board(tilt).Paint(folder_.path() + "/board" + std::to_string(number_++) + ".png");
  }
  std::string Photos() const { return "--images='" + folder_.path() + "/board*.png'"; }
  std::string Output() const { return folder_.path() + "/out"; }

  TestFolder folder_;
  int number_ = 0;
};

TEST_F(CalibrateTest, FindsTheFocalLengthOfBoardsOfWhichNothingIsKnown) {
  const Outcome run = Calibrate(Photos() + " --output=" + Output());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("focal length"), std::string::npos);
  const nlohmann::json made = ReadJson(Output() + "/calibration.json");
  const nlohmann::json& camera = made["cameras"][0];
  const double fx = camera["fx"], sigma = camera["sigma"]["fx"];
  EXPECT_NEAR(fx, kFocal, 3.0 * sigma);
  EXPECT_NEAR(fx, kFocal, 0.15 * kFocal);
  EXPECT_EQ(camera["width"], kWidth);
  EXPECT_EQ(made["images"].size(), 5U);
  for (const char* file : {"/calibration.yml", "/cameras.txt", "/images.txt", "/report.html"})
    EXPECT_TRUE(std::filesystem::exists(Output() + file)) << file;
}

// What it writes is a camera for the others.
TEST_F(CalibrateTest, ItsCameraCanBeUsed) {
  ASSERT_EQ(Calibrate(Photos() + " --output=" + Output()).exit_code, 0);
  const Outcome compared = RunCompare(Photos() + " --camera=" + Output() +
                                      "/calibration.yml --solvers=joint "
                                      "--overlays=false --output=" +
                                      folder_.path() + "/compared");
  EXPECT_EQ(compared.exit_code, 0) << compared.err;
}

TEST_F(CalibrateTest, NamesWhatCannotBeRead) {
  folder_.Write("board9.png", "no picture");
  const Outcome run = Calibrate(Photos() + " --output=" + Output());
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("board9.png"), std::string::npos) << run.err;
  EXPECT_TRUE(std::filesystem::exists(Output() + "/calibration.json"));
}

TEST_F(CalibrateTest, UnusableFlagsWriteNothing) {
  for (const char* flag :
       {"--model=round", "--fix=k9", "--free=k1", "--rigid=perhaps", "--robust_loss=none",
        "--conic_distance=far", "--fix=aspect --free=aspect", "--nonsense=1"}) {
    const Outcome run = Calibrate(Photos() + " " + flag + " --output=" + Output());
    EXPECT_EQ(run.exit_code, 2) << flag << run.err;
    EXPECT_FALSE(std::filesystem::exists(Output())) << flag;
  }
}

}  // namespace
}  // namespace circline::apps
