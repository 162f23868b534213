// Photos without a scene file: what stands in for a calibration, and what is known of one circle.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "circline/estimators/basics.h"
#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

using nlohmann::json;

class CompareInputs : public testing::Test {
 protected:
  CompareInputs() { board_.Paint(folder_ / "photo.png"); }
  Outcome Run(const std::string& flags) {
    std::filesystem::remove_all(folder_ / "out");
    return RunCompare("--images='" + folder_ / "photo.png" + "' --output='" + folder_ / "out" +
                      "' " + flags);
  }
  std::string Results() { return ReadAll(folder_ / "out/results.jsonl"); }
  // Best answer of a solver.
  json Best(const std::string& solver) {
    for (const json& line : ReadJsonLines(folder_ / "out/results.jsonl")) {
      if (line["solver"] == solver && line["stage"] == "refined" && line["hypothesis"] == 0) {
        return line;
      }
    }
    return {};
  }
  void ExpectUnusable(const std::string& flags, const char* words) {
    const Outcome outcome = Run(flags);
    EXPECT_EQ(outcome.exit_code, 2) << flags;
    EXPECT_CONTAINS(outcome.err, words);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  }
  const Board board_{40.0};
  const TestFolder folder_;
};

TEST_F(CompareInputs, FocalLengthOrFieldOfViewStandInForACalibration) {
  // The board's camera: the principal point in the middle.
  const std::string calibration = folder_.Write("cameras.txt", "1 PINHOLE 320 240 300 300 160 120");
  ASSERT_EQ(Run("--camera='" + calibration + "'").exit_code, 0);
  const std::string calibrated = Results();
  // As well known as a calibration, it is one.
  ASSERT_EQ(Run("--focal_px=300 --focal_sigma=0.002").exit_code, 0);
  EXPECT_EQ(Results(), calibrated);
  const double fov = 2.0 * std::atan(0.5 * kWidth / kFocal) / kDegree;
  ASSERT_EQ(Run("--focal_sigma=0.002 --fov_deg=" + std::to_string(fov)).exit_code, 0);
  const json guessed = Best("joint");
  std::istringstream lines(calibrated);
  ASSERT_EQ(Run("--camera='" + calibration + "'").exit_code, 0);
  const json expected = Best("joint");
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_NEAR(guessed["rotation"][i], expected["rotation"][i], 1e-6);
  }
}

// What is known of the camera, and where that is from, stands in all that is written.
TEST_F(CompareInputs, SaysHowWellAGuessIsKnown) {
  const auto check = [&](const std::string& flags, const char* on_stderr, const char* words,
                         double sigma) {
    const Outcome outcome = Run(flags + " --solvers=single_circle");
    ASSERT_EQ(outcome.exit_code, 0) << flags;
    EXPECT_CONTAINS(outcome.err, on_stderr);
    const std::string from =
        ReadJsonLines(folder_ / "out/observations.jsonl").at(0)["camera_from"].dump();
    EXPECT_CONTAINS(from, words);
    EXPECT_CONTAINS(ReadAll(folder_ / "out/report.html"), words);
    const json best = Best("single_circle");
    ASSERT_TRUE(best.contains("focal_px")) << flags;
    // One circle does not tell.
    EXPECT_NEAR(best["focal_sigma"], sigma, 0.15 * sigma) << flags;
    EXPECT_NEAR(best["focal_px"].get<double>(), best["camera"]["fx"].get<double>(), 1e-9);
  };
  check("", "no camera is given", "60.0 degrees, as nothing is known, +- 50.0 %", 0.5);
  check("--fov_deg=50", "good to 25.0 %", "--fov_deg=50.0, +- 25.0 %", 0.25);
  check("--focal_px=300", "good to 25.0 %", "--focal_px=300, +- 25.0 %", 0.25);
  check("--focal_px=300 --focal_sigma=0.1", "good to 10.0 %", "+- 10.0 %", 0.1);
}

TEST_F(CompareInputs, SaysThatAGuessIsTakenAsExact) {
  const Outcome outcome = Run("--fov_deg=50 --focal_sigma=0 --solvers=single_circle");
  ASSERT_EQ(outcome.exit_code, 0);
  EXPECT_CONTAINS(outcome.err, "its focal length taken as exact");
  EXPECT_CONTAINS(ReadJsonLines(folder_ / "out/observations.jsonl").at(0)["camera_from"].dump(),
                  "--fov_deg=50.0, taken as exact");
}

// A noise model that says how well the camera is known says so of a guess too.
TEST_F(CompareInputs, NoiseModelCountsForAGuess) {
  ASSERT_EQ(Run("--focal_px=300 --noise=exact --focal_sigma=0").exit_code, 0);
  const std::string exact = Results();
  ASSERT_EQ(Run("--focal_px=300 --noise=exact").exit_code, 0);
  EXPECT_EQ(Results(), exact);
  EXPECT_FALSE(Best("single_circle").contains("focal_sigma"));
  const std::string noise = folder_.Write("noise.yml", "camera: { log_focal: 0.1 }\n");
  ASSERT_EQ(Run("--focal_px=300 --noise_model='" + noise + "'").exit_code, 0);
  EXPECT_NEAR(Best("single_circle")["focal_sigma"], 0.1, 0.015);
  // Nothing is known exactly of a camera that nobody has given.
  ASSERT_EQ(Run("--noise=exact").exit_code, 0);
  EXPECT_GT(Best("single_circle")["focal_sigma"].get<double>(), 0.1);
}

// Conics and closed forms are of the camera that the photo was seen through, and say so.
TEST_F(CompareInputs, StatesTheCameraThatAPhotoWasSeenThrough) {
  ASSERT_EQ(Run("--focal_px=420").exit_code, 0);
  const json photo = ReadJsonLines(folder_ / "out/observations.jsonl").at(0);
  ASSERT_TRUE(photo.contains("calibrated_with"));
  int closed_forms = 0;
  for (const json& line : ReadJsonLines(folder_ / "out/results.jsonl")) {
    if (line["stage"] != "closed_form" || line["status"] != "ok") continue;
    EXPECT_EQ(line["camera"], photo["calibrated_with"]);
    EXPECT_EQ(line["focal_px"], photo["calibrated_with"]["fx"]);
    EXPECT_FALSE(line.contains("focal_sigma_px"));
    ++closed_forms;
  }
  EXPECT_GT(closed_forms, 0);
  ASSERT_EQ(Run("--focal_px=300 --focal_sigma=0.002").exit_code, 0);
  EXPECT_FALSE(ReadJsonLines(folder_ / "out/observations.jsonl").at(0).contains("calibrated_with"));
}

TEST_F(CompareInputs, FolderThatIsNotThere) {
  const Outcome outcome = RunCompare("--images='" + folder_ / "photos" + "' --focal_px=300" +
                                     " --output='" + folder_ / "out" + "'");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_CONTAINS(outcome.err, "there is no folder");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

TEST_F(CompareInputs, BadValuesAreNamed) {
  for (const char* bad : {"180", "-3", "nan", "1e-300"})
    ExpectUnusable(std::string("--fov_deg=") + bad, "--fov_deg must be between 0.01 and 179");
  for (const char* bad : {"1e308", "nan", "inf"})
    ExpectUnusable(std::string("--focal_px=") + bad, "--focal_px must be positive, and no more");
  for (const char* bad : {"-0.5", "nan", "inf"})
    ExpectUnusable(std::string("--focal_sigma=") + bad,
                   "--focal_sigma must be a finite number of 0 or more, or -1: by where");
  ExpectUnusable("--focal_px=-1", "--focal_px must be positive");
  ExpectUnusable("--focal_px=300 --fov_deg=60", "give one of --camera, --focal_px, --fov_deg");
  ExpectUnusable("--focal_px=300 --roi=1,2,3", "--roi=1,2,3: must be x,y,width,height");
  ExpectUnusable("--focal_px=300 --roi=1,2,0,5", "--roi=1,2,0,5");
  ExpectUnusable("--focal_px=300 --circle_radius=-2", "--circle_radius must be positive");
}

// Length of the translation to the disc's centre is that of the board, not 1.
TEST_F(CompareInputs, RadiusMakesTheTranslationMetric) {
  const double distance = board_.translation.norm();
  ASSERT_EQ(Run("--focal_px=300 --focal_sigma=0 --roi=40,20,230,210 --circle_radius=0.5").exit_code,
            0);
  json best = Best("single_circle");
  ASSERT_FALSE(best.is_null());
  EXPECT_EQ(best["metric"], true);
  const auto norm = [](const json& t) {
    return std::hypot(t[0].get<double>(), t[1].get<double>(), t[2].get<double>());
  };
  EXPECT_NEAR(norm(best["translation"]), distance, 0.01 * distance);
  const std::vector<json> observations = ReadJsonLines(folder_ / "out/observations.jsonl");
  EXPECT_EQ(observations.at(0)["ellipses"].size(), 1U);  // Nothing else is detected.
  EXPECT_EQ(observations.at(0)["pencils"].size(), 0U);

  ASSERT_EQ(Run("--focal_px=300 --focal_sigma=0 --circle_radius=0.5").exit_code,
            0);  // The largest one.
  best = Best("single_circle");
  ASSERT_FALSE(best.is_null());
  EXPECT_EQ(best["metric"], true);
  EXPECT_NEAR(norm(best["translation"]), distance, 0.01 * distance);
}

}  // namespace
}  // namespace circline::apps
