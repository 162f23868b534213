// circline_calibrate on painted boards of which nothing is known.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "apps/common/scene.h"
#include "apps/common/text.h"
#include "circline/estimators/basics.h"
#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

Outcome Calibrate(const std::string& arguments) {
  return RunProgram(CIRCLINE_CALIBRATE, arguments);
}

nlohmann::json ReadJson(const std::string& path) { return nlohmann::json::parse(ReadAll(path)); }

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

// Nine circles of a board, from several sides; contours given.
std::string SheetPhoto(const Board& board, const std::string& file, double squeeze) {
  std::string text = "  - file: \"" + file + "\"\n    camera: \"k\"\n    circles:\n";
  for (int k = 0; k < 9; ++k) {
    std::vector<Eigen::Vector2d> contour;
    for (int i = 0; i < 40; ++i) {
      const double t = 2.0 * kPi * i / 40;
      contour.push_back(
          board.Pixel(k % 3 - 1 + 0.3 * std::cos(t), k / 3 * 0.8 - 0.8 + 0.3 * std::sin(t)));
      contour.back().x() *= squeeze;
    }
    text += "      - { id: \"c" + std::to_string(k) + "\", contour: " + Numbers(contour) +
            ", plane: \"p\" }\n";
  }
  return text;
}

std::string SheetScene(const TestFolder& folder, int count, int gross) {
  std::string scene = "%YAML:1.0\n---\n" + BoardCamera() + "images:\n";
  for (int i = 0; i < count; ++i) {
    Board board(0.0);
    const double turn = 2.0 * kPi * i / count;
    board.rotation = Eigen::AngleAxisd(0.6, Eigen::Vector3d(std::cos(turn), std::sin(turn), 0.0)) *
                     Eigen::AngleAxisd(0.3 * i, Eigen::Vector3d::UnitZ());
    board.translation.x() += 0.3 * std::sin(2.0 * turn);
    const std::string name = "view" + std::to_string(i) + ".png";
    scene += SheetPhoto(board, folder.Write(name, ""), i == gross ? 0.8 : 1.0);
  }
  return folder.Write("scene.yaml", scene);
}

// The scene with the estimated camera is one for the other programs.
TEST_F(CalibrateTest, WritesASceneOfTheEstimatedCamera) {
  constexpr std::size_t kCircles[] = {0, 9, 1};
  for (int k = 0; k < 3; ++k) {
    const std::string input = k == 0   ? Photos()
                              : k == 1 ? "--scene=" + SheetScene(folder_, 5, -1)
                                       : "--scene=" + MakeSet(folder_);
    const Outcome run = Calibrate(input + " --output=" + Output());
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const nlohmann::json made = ReadJson(Output() + "/calibration.json");
    std::vector<SceneImage> images;
    const Status status = ReadScene(Output() + "/scene.yaml", {}, &images);
    ASSERT_TRUE(status.ok()) << status.message;
    ASSERT_EQ(images.size(), made["images"].size());
    const Camera& camera = images.front().observations.camera;
    EXPECT_NEAR(camera.fx, made["cameras"][0]["fx"].get<double>(), 1e-6);
    EXPECT_EQ(camera.id, made["cameras"][0]["id"]);
    EXPECT_NEAR(*images.front().camera_sigma.log_focal * camera.fx,
                made["cameras"][0]["sigma"]["fx"].get<double>(), 1e-6);
    EXPECT_TRUE(std::filesystem::exists(images.front().path)) << images.front().path;
    EXPECT_EQ(images[0].observations.circles.size(), kCircles[k]);
  }
  const Outcome compared = RunCompare("--scene=" + Output() +
                                      "/scene.yaml --solvers=joint --output=" + folder_ / "again");
  EXPECT_EQ(compared.exit_code, 0) << compared.err;
}

// What the scene file says of the world counts, whatever the flag.
TEST_F(CalibrateTest, TheSceneSaysWhetherTheWorldIsRigid) {
  const std::string scene = SheetScene(folder_, 5, -1);
  for (const std::string rigid : {"no", "auto"}) {
    const std::string stated =
        folder_.Write("stated.yaml", ReadAll(scene) + "rigid: " + rigid + "\n");
    const Outcome run = Calibrate("--scene=" + stated + " --rigid=yes --output=" + Output());
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(ReadJson(Output() + "/calibration.json")["rigid"], rigid == "auto");
    EXPECT_EQ(Count(run.out, "Show one flat sheet, and all of it,"), rigid == "no" ? 1 : 0);
    EXPECT_CONTAINS(ReadAll(Output() + "/scene.yaml"), "\"rigid\": \"" + rigid + "\"");
  }
  const Outcome run =
      Calibrate("--scene=" + folder_.Write("bad.yaml", ReadAll(scene) + "rigid: 3\n") +
                " --output=" + folder_ / "none");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_CONTAINS(run.err, "rigid: must be auto, yes or no");
}

// Of photos in which everything is detected, too.
TEST_F(CalibrateTest, TheSceneSaysHowWellItsCameraIsKnown) {
  std::string camera = BoardCamera();
  camera.insert(camera.rfind(" }"), ", focal_sigma: 0");
  std::string scene = "%YAML:1.0\n---\n" + camera + "images:\n";
  for (int i = 0; i < 3; ++i)
    scene += "  - { file: \"board" + std::to_string(i) + ".png\", camera: \"k\" }\n";
  const Outcome run =
      Calibrate("--scene=" + folder_.Write("known.yaml", scene) + " --output=" + Output());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const nlohmann::json made = ReadJson(Output() + "/calibration.json")["cameras"][0];
  EXPECT_EQ(made["fx"], kFocal);
  EXPECT_EQ(made["sigma"]["fx"], 0.0);
}

// Twelve discs of a sheet, seen from a side.
void PaintSheet(double side_rad, const std::string& path) {
  Board board(0.0);
  board.rotation =
      Eigen::AngleAxisd(0.6, Eigen::Vector3d(std::cos(side_rad), std::sin(side_rad), 0.0));
  board.translation.x() = 0.0;
  PaintPhoto(path, kWidth, kHeight, 4, [&board](double u, double v) {
    const Eigen::Vector3d ray((u - (kWidth - 1) / 2.0) / kFocal, (v - (kHeight - 1) / 2.0) / kFocal,
                              1.0);
    const Eigen::Vector3d normal = board.rotation.col(2);
    const Eigen::Vector3d p =
        board.rotation.transpose() *
        (normal.dot(board.translation) / normal.dot(ray) * ray - board.translation);
    if (std::abs(p.x()) > 1.6 || std::abs(p.y()) > 1.2) return 210.0;
    const Eigen::Vector2d off(std::remainder(p.x() - 0.4, 0.8), std::remainder(p.y(), 0.8));
    return off.norm() < 0.3 ? 40.0 : 210.0;
  });
}

// A scene file's camera, too, is where the search begins, and no more: seen through half the
// angle of view the discs of a sheet lie in different planes.
TEST_F(CalibrateTest, DiscsAreDetectedThroughACameraThatIsFarOff) {
  std::string camera = BoardCamera();
  for (const auto at : {camera.find("300"), camera.rfind("300")}) camera.replace(at, 3, "750");
  std::string scene = "%YAML:1.0\n---\n" + camera + "images:\n";
  for (int i = 0; i < 2; ++i) {
    const std::string name = "sheet" + std::to_string(i) + ".png";
    PaintSheet(0.3 + 2.0 * i, folder_ / name);
    scene += "  - { file: \"" + name + "\", camera: \"k\" }\n";
  }
  const Outcome run =
      Calibrate("--scene=" + folder_.Write("far.yaml", scene) + " --output=" + Output());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const nlohmann::json made = ReadJson(Output() + "/calibration.json");
  EXPECT_TRUE(made["rigid"].get<bool>());
  EXPECT_NEAR(made["cameras"][0]["fx"].get<double>(), kFocal, 0.05 * kFocal);
}

TEST_F(CalibrateTest, ItsReportShowsThePhotosAndWhatEachHasAdded) {
  ASSERT_EQ(Calibrate(Photos() + " --output=" + Output()).exit_code, 0);
  const std::string report = ReadAll(Output() + "/report.html");
  EXPECT_EQ(Count(report, "data:image/jpeg"), 5);
  EXPECT_CONTAINS(report, "What each photo has added");
  const nlohmann::json sigmas =
      ReadJson(Output() + "/calibration.json")["cameras"][0]["sigma_by_photos"];
  ASSERT_EQ(sigmas.size(), 4U);  // 1, 2, 4, 5 photos.
  for (std::size_t k = 1; k < sigmas.size(); ++k)
    EXPECT_LE(sigmas[k][1].get<double>(), 1.001 * sigmas[k - 1][1].get<double>());
  EXPECT_EQ(sigmas.back()[0], 5);
}

TEST_F(CalibrateTest, ItsReportShowsItsNotes) {
  std::filesystem::copy(folder_ / "board0.png", folder_ / "board9.png");
  ASSERT_EQ(Calibrate(Photos() + " --output=" + Output()).exit_code, 0);
  const nlohmann::json notes = ReadJson(Output() + "/calibration.json")["notes"];
  ASSERT_FALSE(notes.empty());
  for (const std::string note : notes)
    EXPECT_CONTAINS(ReadAll(Output() + "/report.html"), "<li>" + EscapeHtml(note) + "</li>");
}

TEST_F(CalibrateTest, NamesAGrossPhotoOfTen) {
  const Outcome run = Calibrate("--scene=" + SheetScene(folder_, 10, 4) + " --output=" + Output());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_CONTAINS(run.out, "view4.png: left out, it contradicts the other photos");
  const nlohmann::json made = ReadJson(Output() + "/calibration.json");
  EXPECT_EQ(made["cameras"][0]["num_images"], 9);
  EXPECT_NEAR(made["cameras"][0]["fx"].get<double>(), kFocal, 0.01 * kFocal);
}

TEST_F(CalibrateTest, OnePhotoSaysWhatItCannotTell) {
  const Outcome run = Calibrate("--images=" + folder_ / "board0.png" + " --output=" + Output());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_CONTAINS(run.out, "1 photo,");
  EXPECT_CONTAINS(run.out, "the photos say next to nothing of: ");
  EXPECT_CONTAINS(run.out, "Take five photos or more");
}

// Of photos whose camera is a guess those of another size are another camera's.
TEST_F(CalibrateTest, PhotosOfAnotherSizeAreAnotherCameras) {
  for (const char* name : {"board1.png", "board4.png"}) {
    const cv::Mat photo = cv::imread(folder_ / name);
    cv::Mat half;
    cv::resize(photo, half, {}, 0.75, 0.75, cv::INTER_AREA);
    cv::imwrite(folder_ / name, half);
  }
  const Outcome run = Calibrate(Photos() + " --output=" + Output());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const nlohmann::json cameras = ReadJson(Output() + "/calibration.json")["cameras"];
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_EQ(cameras[1]["id"], "guessed_240x180");
  EXPECT_EQ(cameras[0]["num_images"], 3);
  EXPECT_EQ(cameras[1]["num_images"], 2);
  EXPECT_TRUE(std::filesystem::exists(Output() + "/calibration_guessed_240x180.yml"));
  // Those of an earlier run into that folder go, and nothing else does.
  const std::string kept = folder_.Write("out/calibration_mine.yml", "mine");
  ASSERT_EQ(Calibrate("--images=" + folder_ / "board0.png" + " --output=" + Output()).exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(Output() + "/calibration_guessed_240x180.yml"));
  EXPECT_EQ(ReadAll(kept), "mine");
  // A camera that is given has a size.
  const std::string given = folder_.Write("camera.yml",
                                          "%YAML:1.0\n---\nimage_width: 320\n"
                                          "image_height: 240\ncamera_matrix: "
                                          "!!opencv-matrix\n   rows: 3\n   cols: 3\n"
                                          "   dt: d\n   data: [ 300., 0., 159.5, 0., "
                                          "300., 119.5, 0., 0., 1. ]\n");
  const Outcome stated =
      Calibrate(Photos() + " --camera=" + given + " --output=" + folder_.path() + "/stated");
  EXPECT_EQ(stated.exit_code, 1);
  EXPECT_CONTAINS(stated.err, "board4.png: the photo has 240 x 180 pixels");
}

TEST_F(CalibrateTest, NamesWhatCannotBeRead) {
  folder_.Write("board9.png", "no picture");
  const Outcome run = Calibrate(Photos() + " --output=" + Output());
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("board9.png"), std::string::npos) << run.err;
  EXPECT_TRUE(std::filesystem::exists(Output() + "/calibration.json"));
}

// Nothing is lost of what was given for want of a picture.
TEST_F(CalibrateTest, NamesPhotosOfGivenEvidenceThatCannotBeShown) {
  const std::string scene = SheetScene(folder_, 6, -1);
  std::filesystem::remove(folder_ / "view1.png");
  const Outcome run = Calibrate("--scene=" + scene + " --output=" + Output());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_CONTAINS(run.err, "view1.png: the file does not exist; no picture of it");
  const nlohmann::json calibration = ReadJson(Output() + "/calibration.json");
  for (const auto& image : calibration["images"]) EXPECT_EQ(image["status"], "ok") << image["file"];
}

// Counted among the readable photos or not, the other one has a name; and COLMAP is told of less.
TEST_F(CalibrateTest, NamesThePhotoThatAnotherOneRepeats) {
  folder_.Write("board00.png", "no picture");
  std::filesystem::copy(folder_ / "board0.png", folder_ / "board again.png");
  const Outcome run = Calibrate(Photos() + " --output=" + Output());
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_CONTAINS(run.out, "board0.png: left out, it shows nearly the same as ");
  EXPECT_CONTAINS(run.out, "board again.png, whose errors it shares");
  EXPECT_CONTAINS(run.out, "names COLMAP cannot read, for their spaces: ");
}

TEST_F(CalibrateTest, UnusableFlagsWriteNothing) {
  for (const char* flag :
       {"--model=round", "--fix=k9", "--free=k1", "--rigid=perhaps", "--robust_loss=none",
        "--conic_distance=far", "--fix=aspect --free=aspect", "--export_as=colmap",
        "--save_options=best.flags", "--solvers=joint", "--resume", "--peers", "--list_solvers",
        "--merge=a,b", "--plugin=a.so", "--conic_distance=sampson", "--robust_loss=huber,cauchy",
        "--loss_scale_px=1,2", "--nonsense=1"}) {
    const Outcome run = Calibrate(Photos() + " " + flag + " --output=" + Output());
    EXPECT_EQ(run.exit_code, 2) << flag << run.err;
    EXPECT_FALSE(std::filesystem::exists(Output())) << flag;
  }
}

}  // namespace
}  // namespace circline::apps
