// What is written for COLMAP, read by COLMAP itself where it is installed (Debian: colmap).
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "apps/common/camera_file.h"
#include "apps/compare/export.h"
#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

class Colmap : public testing::Test {
 protected:
  void SetUp() override {
    if (RunProgram("colmap", "help").exit_code != 0)
      GTEST_SKIP() << "COLMAP is not installed: apt-get install colmap";
  }
  // COLMAP reads a text model, writes it as binary, and that as text again.
  void ThroughColmap(const std::string& from, const std::string& to) {
    const std::string binary = folder_ / "binary";
    std::filesystem::create_directory(binary);
    std::filesystem::create_directory(to);
    Outcome outcome = RunProgram("colmap", "model_converter --output_type BIN --input_path '" +
                                               from + "' --output_path '" + binary + "'");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    outcome = RunProgram("colmap", "model_converter --output_type TXT --input_path '" + binary +
                                       "' --output_path '" + to + "'");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  const TestFolder folder_;
};

// Of images.txt, by name.
std::map<std::string, CameraPose> ReadPoses(const std::string& path) {
  std::map<std::string, CameraPose> poses;
  std::istringstream lines(ReadAll(path));
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    int id = 0, camera = 0;
    Eigen::Quaterniond q;
    CameraPose pose;
    std::string name;
    words >> id >> q.w() >> q.x() >> q.y() >> q.z() >> pose.translation.x() >>
        pose.translation.y() >> pose.translation.z() >> camera >> name;
    pose.rotation = q.toRotationMatrix();
    poses[name] = pose;
  }
  return poses;
}

Camera MakeCamera(CameraModel model, std::vector<double> distortion) {
  Camera camera;
  camera.model = model;
  camera.width = 640, camera.height = 480;
  camera.fx = 500.25, camera.fy = 501.5, camera.cx = 319.25, camera.cy = 240.75;
  std::copy(distortion.begin(), distortion.end(), camera.distortion.begin());
  return camera;
}

TEST_F(Colmap, ReadsEveryCameraModel) {
  const std::vector<Camera> cameras = {
      MakeCamera(CameraModel::kPinhole, {}),
      MakeCamera(CameraModel::kOpenCV, {-0.2, 0.1, 0.001, -0.002}),
      MakeCamera(CameraModel::kOpenCV, {-0.2, 0.1, 0.001, -0.002, 0.01, 0.02, 0.03, 0.04}),
      MakeCamera(CameraModel::kFisheye, {-0.02, 0.01, 0.001, -0.002})};
  std::vector<ExportedPose> exported;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    exported.push_back({"photos/" + std::to_string(i) + ".jpg",
                        i,
                        cameras[i],
                        {Eigen::Matrix3d::Identity(), Eigen::Vector3d::UnitZ()}});
  }
  std::string note;
  ASSERT_TRUE(ExportPoses("colmap", exported, folder_.path(), &note).ok());
  EXPECT_EQ(note, "");
  ASSERT_NO_FATAL_FAILURE(ThroughColmap(folder_.path(), folder_ / "text"));
  EXPECT_EQ(ReadPoses(folder_ / "text/images.txt").count("photos/3.jpg"), 1U);

  std::vector<Camera> read;
  const Status status = ReadCameraFile(folder_ / "text/cameras.txt", &read);
  ASSERT_TRUE(status.ok()) << status.message;
  ASSERT_EQ(read.size(), cameras.size());
  for (const Camera& camera : read) {
    const Camera& expected = cameras.at(std::stoul(camera.id) - 1);
    EXPECT_EQ(camera.model, expected.model);
    EXPECT_EQ(camera.distortion, expected.distortion);
    EXPECT_EQ(camera.width, expected.width);
    EXPECT_NEAR(camera.fx, expected.fx, 1e-9);
    EXPECT_NEAR(camera.fy, expected.fy, 1e-9);
    EXPECT_NEAR(camera.cx, expected.cx, 1e-9);
    EXPECT_NEAR(camera.cy, expected.cy, 1e-9);
  }
}

// A disc whose radius is known, 0.25 m, half of what it is in the units of the board: the cameras
// stand where they should, in metres.
TEST_F(Colmap, ReadsPosesThatARadiusMadeMetric) {
  const std::vector<double> tilts = {25.0, 40.0, 55.0};
  std::string scene = "%YAML:1.0\n---\n" + BoardCamera() + "images:\n";
  for (const double tilt : tilts) {
    const std::string name = "tilt" + std::to_string(static_cast<int>(tilt)) + ".png";
    Board(tilt).Paint(folder_ / name);
    scene += AnnotatedImage(Board(tilt), name);
  }
  const std::string circle = "{ id: \"c\", ", known = circle + "radius: 0.25, ";
  for (std::size_t at = 0; (at = scene.find(circle, at)) != std::string::npos; at += known.size())
    scene.replace(at, circle.size(), known);
  const Outcome outcome = CompareScene(folder_.Write("scene.yaml", scene), folder_ / "out",
                                       "--overlays=false --export_as=colmap");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out.find("exported poses"), std::string::npos);  // All of them metric.
  ASSERT_NO_FATAL_FAILURE(ThroughColmap(folder_ / "out", folder_ / "text"));

  const std::map<std::string, CameraPose> poses = ReadPoses(folder_ / "text/images.txt");
  ASSERT_EQ(poses.size(), tilts.size());
  for (const double tilt : tilts) {
    const Board board(tilt);
    const CameraPose& pose = poses.at("tilt" + std::to_string(static_cast<int>(tilt)) + ".png");
    EXPECT_LT(RotationAngle(pose.rotation, board.rotation), 1e-6);
    EXPECT_LT((pose.rotation.transpose() * pose.translation -
               0.5 * board.rotation.transpose() * board.translation)
                  .norm(),
              1e-5);
  }
  const Outcome analysis = RunProgram("colmap", "model_analyzer --path '" + folder_ / "out" + "'");
  EXPECT_EQ(analysis.exit_code, 0);
  EXPECT_CONTAINS(analysis.out + analysis.err, "Registered images: 3");
}

// COLMAP ends a name at its first space: two photos "my ..." would be one.
TEST(ExportForColmap, NamesWithSpacesAreLeftOutAndNamed) {
  const TestFolder folder;
  std::vector<ExportedPose> exported;
  const Camera camera = MakeCamera(CameraModel::kPinhole, {});
  std::size_t index = 0;
  for (const char* name : {"my first.jpg", "second.jpg", "my third.jpg"})
    exported.push_back(
        {name, index++, camera, {Eigen::Matrix3d::Identity(), Eigen::Vector3d::UnitZ()}});
  std::string note;
  ASSERT_TRUE(ExportPoses("colmap", exported, folder.path(), &note).ok());
  EXPECT_CONTAINS(note, "'my first.jpg', 'my third.jpg'");
  const std::map<std::string, CameraPose> poses = ReadPoses(folder / "images.txt");
  ASSERT_EQ(poses.size(), 1U);
  EXPECT_EQ(poses.begin()->first, "second.jpg");
}

TEST_F(Colmap, ReadsWhatCalibrateWrites) {
  const std::string out = folder_ / "out", again = folder_ / "again";
  ASSERT_EQ(
      RunProgram(CIRCLINE_CALIBRATE, "--scene=" + MakeSet(folder_) + " --output=" + out).exit_code,
      0);
  ThroughColmap(out, again);
  EXPECT_FALSE(ReadPoses(out + "/images.txt").empty());
  EXPECT_EQ(ReadPoses(again + "/images.txt").size(), ReadPoses(out + "/images.txt").size());
}

}  // namespace
}  // namespace circline::apps
