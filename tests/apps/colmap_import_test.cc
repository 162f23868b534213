// A model that COLMAP itself makes of rendered photos gets its scale and axes from their discs.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/common/colmap_file.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/random.h"
#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

constexpr int kRenderedWidth = 640, kRenderedHeight = 480;
constexpr double kRenderedFocal = 600.0;
constexpr double kLargest = 0.25;  // Radius of the largest disc, metres.

constexpr double kWall = 1.2;  // Its y.
const Eigen::Vector3d kWallDisc(0.2, kWall, 0.8);
constexpr double kWallRadius = 0.2;

// A floor (Z = 0) and a wall of random texture, with dark discs; metres.
class Room {
 public:
  Room() {
    Random random(3);
    for (auto& table : tables_) {
      for (double& value : table) value = random.Uniform();
    }
  }

  // Grey value where a ray from the eye ends.
  double Brightness(const Eigen::Vector3d& eye, const Eigen::Vector3d& ray) const {
    const double to_floor = ray.z() < 0.0 ? -eye.z() / ray.z() : 1e9,
                 to_wall = ray.y() > 0.0 ? (kWall - eye.y()) / ray.y() : 1e9;
    if (to_wall < to_floor) {
      const Eigen::Vector3d X = eye + to_wall * ray;
      return (X - kWallDisc).norm() < kWallRadius ? 30.0 : Texture(X.x(), X.z(), 2);
    }
    const Eigen::Vector3d X = eye + to_floor * ray;
    constexpr double kDiscs[][3] = {{0.0, 0.0, kLargest},
                                    {0.7, 0.3, 0.12},
                                    {-0.6, 0.5, 0.12},
                                    {0.5, -0.6, 0.12},
                                    {-0.5, -0.5, 0.12}};
    for (const auto& disc : kDiscs) {
      if (std::hypot(X.x() - disc[0], X.y() - disc[1]) < disc[2]) return 30.0;
    }
    return Texture(X.x(), X.y(), 0);
  }

  void Paint(const CameraPose& pose, const std::string& path) const {
    const Eigen::Matrix3d back = pose.rotation.transpose();
    const Eigen::Vector3d eye = -back * pose.translation;
    PaintPhoto(path, kRenderedWidth, kRenderedHeight, 2, [&](double u, double v) {
      const double x = u - (kRenderedWidth - 1) / 2.0, y = v - (kRenderedHeight - 1) / 2.0;
      return Brightness(eye, back * Eigen::Vector3d(x / kRenderedFocal, y / kRenderedFocal, 1.0));
    });
  }

 private:
  static constexpr int kSize = 64;

  // Random values on a grid, and smooth between.
  double Smooth(double x, double y, int table) const {
    const double i = std::floor(x), j = std::floor(y);
    const auto at = [&](double p, double q) {
      const int row = static_cast<int>(p) & (kSize - 1), column = static_cast<int>(q) & (kSize - 1);
      return tables_.at(static_cast<std::size_t>(table))
          .at(static_cast<std::size_t>(kSize * row + column));
    };
    const auto ease = [](double a) { return a * a * (3.0 - 2.0 * a); };
    const double a = ease(x - i), b = ease(y - j);
    return (1.0 - b) * ((1.0 - a) * at(i, j) + a * at(i + 1, j)) +
           b * ((1.0 - a) * at(i, j + 1) + a * at(i + 1, j + 1));
  }
  double Texture(double x, double y, int table) const {
    return 110.0 + 80.0 * Smooth(x / 0.09, y / 0.09, table) +
           60.0 * Smooth(x / 0.03, y / 0.03, table + 1);
  }

  std::array<std::array<double, kSize * kSize>, 4> tables_;
};

// A box about the image of a disc: "[x, y, width, height]".
std::string BoxAbout(const CameraPose& pose, const Eigen::Vector3d& center, double radius,
                     const Eigen::Vector3d& across) {
  constexpr int kMargin = 12, kPoints = 24;
  Eigen::Vector2d low(1e9, 1e9), high = -low;
  for (int i = 0; i < kPoints; ++i) {
    const double a = 2.0 * kPi * i / kPoints;
    const Eigen::Vector3d X =
        center + radius * (std::cos(a) * Eigen::Vector3d::UnitX() + std::sin(a) * across);
    const Eigen::Vector3d x = pose.rotation * X + pose.translation;
    const Eigen::Vector2d pixel(kRenderedFocal * x.x() / x.z() + (kRenderedWidth - 1) / 2.0,
                                kRenderedFocal * x.y() / x.z() + (kRenderedHeight - 1) / 2.0);
    low = low.cwiseMin(pixel);
    high = high.cwiseMax(pixel);
  }
  const Eigen::Vector2i from = low.cast<int>().array() - kMargin,
                        size = (high - low).cast<int>().array() + 2 * kMargin;
  return "[" + std::to_string(from.x()) + ", " + std::to_string(from.y()) + ", " +
         std::to_string(size.x()) + ", " + std::to_string(size.y()) + "]";
}

// From above, half around the large disc.
std::vector<CameraPose> Poses() {
  std::vector<CameraPose> poses;
  constexpr int kCount = 6;
  for (int k = 0; k < kCount; ++k) {
    const double turn = -0.5 + 1.0 * k / (kCount - 1);
    const Eigen::Vector3d eye(2.64 * std::sin(turn), -2.6 * std::cos(turn) + 0.1 * (k % 3),
                              1.5 + 0.25 * (k % 2));
    const Eigen::Vector3d z = (Eigen::Vector3d(0.0, 0.25, 0.15) - eye).normalized(),
                          x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
    CameraPose pose;
    pose.rotation.row(0) = x;
    pose.rotation.row(1) = z.cross(x);
    pose.rotation.row(2) = z;
    pose.translation = -pose.rotation * eye;
    poses.push_back(pose);
  }
  return poses;
}

Eigen::Vector3d Eye(const CameraPose& pose) {
  return -pose.rotation.transpose() * pose.translation;
}

class ColmapImport : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directory(folder_ / "photos");
    std::filesystem::create_directory(folder_ / "sparse");
    const Room room;
    const std::vector<CameraPose> poses = Poses();
    for (std::size_t i = 0; i < poses.size(); ++i)
      room.Paint(poses[i], folder_ / ("photos/" + std::to_string(i) + ".png"));
  }

  void Colmap(const std::string& arguments) {
    const Outcome outcome = RunProgram("env", "QT_QPA_PLATFORM=offscreen colmap " + arguments);
    ASSERT_EQ(outcome.exit_code, 0) << arguments << "\n" << outcome.err;
  }
  // COLMAP's own reconstruction, from a focal length that is 2 % off.
  void Reconstruct() {
    const std::string photos = " --image_path '" + folder_ / "photos" + "'",
                      database = " --database_path '" + folder_ / "photos.db" + "'";
    ASSERT_NO_FATAL_FAILURE(
        Colmap("feature_extractor" + photos + database +
               " --ImageReader.single_camera 1 --ImageReader.camera_model SIMPLE_PINHOLE"
               " --ImageReader.camera_params 612,320,240 --SiftExtraction.use_gpu 0"
               " --SiftExtraction.max_num_features 1500"));
    ASSERT_NO_FATAL_FAILURE(Colmap("exhaustive_matcher --SiftMatching.use_gpu 0" + database));
    ASSERT_NO_FATAL_FAILURE(
        Colmap("mapper" + photos + database + " --output_path '" + folder_ / "sparse" + "'"));
  }
  Outcome Import(const std::string& more) {
    return RunProgram(CIRCLINE_CALIBRATE, "--overlays=false --import='" + folder_ / "sparse/0" +
                                              "' --output='" + folder_ / "out" + "' " + more);
  }
  std::string WriteScene() const {
    std::string scene =
        "%YAML:1.0\n---\ncameras:\n  - { id: \"k\", model: \"pinhole\", camera_matrix: "
        "[612., 0., 319.5, 0., 612., 239.5, 0., 0., 1.] }\nimages:\n";
    const std::vector<CameraPose> poses = Poses();
    for (std::size_t i = 0; i < poses.size(); ++i) {
      scene += "  - file: \"photos/" + std::to_string(i) +
               ".png\"\n    camera: \"k\"\n    circles:\n      - { id: \"f\", roi: " +
               BoxAbout(poses[i], Eigen::Vector3d::Zero(), kLargest, Eigen::Vector3d::UnitY()) +
               ", radius: " + std::to_string(kLargest) +
               ", plane: \"floor\" }\n      - { id: \"w\", roi: " +
               BoxAbout(poses[i], kWallDisc, kWallRadius, Eigen::Vector3d::UnitZ()) +
               ", plane: \"wall\" }\n    frame: { plane: \"floor\" }\n";
    }
    return folder_.Write("scene.yaml", scene);
  }
  std::string Photos() const { return "--images='" + folder_ / "photos" + "' "; }
  nlohmann::json Landmarks() const {
    return nlohmann::json::parse(ReadAll(folder_ / "out/landmarks.json"));
  }

  const TestFolder folder_;
};

// Distances between cameras in the model that COLMAP has moved as we say, against the truth.
TEST_F(ColmapImport, ADiscOfKnownRadiusGivesScaleAndAxes) {
  if (RunProgram("colmap", "help").exit_code != 0)
    GTEST_SKIP() << "COLMAP is not installed: apt-get install colmap";
  ASSERT_NO_FATAL_FAILURE(Reconstruct());
  const Outcome run = Import(Photos() + "--circle_radius=" + std::to_string(kLargest));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_CONTAINS(run.out, "one unit of the model is");
  const nlohmann::json made = Landmarks();
  EXPECT_EQ(made["metric"], true);
  EXPECT_GE(made["planes"][0]["circles"].size(), 5U);

  const std::string moved = folder_ / "moved";
  std::filesystem::create_directory(moved);
  ASSERT_NO_FATAL_FAILURE(Colmap("model_transformer --input_path '" + folder_ / "sparse/0" +
                                 "' --output_path '" + moved + "' --transform_path '" +
                                 folder_ / "out/transform.txt" + "'"));
  ColmapModel model;
  const Status status = ReadColmapModel(moved, &model);
  ASSERT_TRUE(status.ok()) << status.message;
  const std::vector<CameraPose> truth = Poses();
  ASSERT_EQ(model.images.size(), truth.size());
  const ColmapImage& first = model.images.front();
  const CameraPose& first_truth = truth.at(std::stoul(first.name));
  double sum = 0.0;  // Of logarithms of distances from the first camera, against the truth.
  for (const ColmapImage& image : model.images) {
    const CameraPose& expected = truth.at(std::stoul(image.name));
    // The floor is Z = 0, and up is up.
    EXPECT_NEAR(Eye(image.cam_from_world).z(), Eye(expected).z(), 0.01 * Eye(expected).z());
    if (&image == &first) continue;
    const double distance = (Eye(image.cam_from_world) - Eye(first.cam_from_world)).norm(),
                 true_distance = (Eye(expected) - Eye(first_truth)).norm();
    EXPECT_NEAR(distance, true_distance, 0.01 * true_distance);
    sum += std::log(distance / true_distance);
  }
  const double off = std::abs(sum / static_cast<double>(truth.size() - 1)),
               sigma = made["world_from_model"]["scale_sigma"].get<double>() /
                       made["world_from_model"]["scale"].get<double>();
  std::printf("scale off by %.2f %%, stated to %.2f %%\n", 100.0 * off, 100.0 * sigma);
  EXPECT_LT(off, 3.0 * sigma);
  EXPECT_LT(sigma, 0.01);

  // A disc of each plane, boxes drawn about them.
  const Outcome annotated = Import("--scene='" + WriteScene() + "'");
  ASSERT_EQ(annotated.exit_code, 0) << annotated.err;
  const nlohmann::json planes = Landmarks()["planes"];
  ASSERT_EQ(planes.size(), 2U) << annotated.out;
  EXPECT_EQ(planes[0]["id"], "floor");
  EXPECT_EQ(planes[1]["id"], "wall");
  EXPECT_NEAR(planes[1]["normal"][2], 0.0, 0.02);  // Upright.
  EXPECT_NEAR(planes[1]["circles"][0]["radius"], kWallRadius, 0.01 * kWallRadius);
}

TEST_F(ColmapImport, WhatDoesNotFitIsNamed) {
  std::filesystem::create_directory(folder_ / "sparse/0");
  Outcome run = Import(Photos());
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_CONTAINS(run.err, "no COLMAP model");
  folder_.Write("sparse/0/cameras.txt", "1 PINHOLE 640 480 600 600 320 240\n");
  folder_.Write("sparse/0/images.txt", "1 1 0 0 0 0 0 0 1 elsewhere.jpg\n\n");
  run = Import(Photos());
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_CONTAINS(run.err, "no photo is one of its 1 images");
  for (const std::string flag : {"--fov_deg=60", "--fix=k1", "--free=aspect", "--rigid=no"}) {
    run = Import(Photos() + flag);
    EXPECT_EQ(run.exit_code, 2) << flag;
    EXPECT_CONTAINS(run.err, "--import brings its own");
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

}  // namespace
}  // namespace circline::apps
