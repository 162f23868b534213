// circline_reconstruct on a painted tin that stands on a plane, and on a face marked beside it.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <filesystem>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "circline/estimators/basics.h"
#include "tests/apps/board_set.h"
#include "tests/apps/painted_box.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

constexpr double kTinRadius = 0.3, kTinHeight = 0.4;
constexpr int kLid = 220, kSide = 90, kGround = 150, kLabel = 50;

// About the axis x = 0.45, y = 0.3; a dark label lies on the plane.
class ReconstructCylinder : public testing::Test {
 protected:
  void SetUp() override {
    PaintPhoto(folder_ / "tin.png", PaintedBox::kWidth, PaintedBox::kHeight, 4,
               [this](double u, double v) { return Brightness(u, v); });
  }
  int Brightness(double u, double v) const {
    const Eigen::Vector3d ray = camera_.Ray(u, v), eye = camera_.Eye() - axis_;
    const auto at = [&](double z) { return (eye + (z - eye.z()) / ray.z() * ray).eval(); };
    if (at(kTinHeight).head<2>().norm() < kTinRadius) return kLid;
    const Eigen::Vector2d e = eye.head<2>(), r = ray.head<2>();
    const double b = e.dot(r),
                 root = b * b - r.squaredNorm() * (e.squaredNorm() - kTinRadius * kTinRadius);
    const double z =
        root > 0.0 ? eye.z() - (b + std::sqrt(root)) / r.squaredNorm() * ray.z() : -1.0;
    if (z > 0.0 && z < kTinHeight) return kSide;
    const Eigen::Vector3d ground = at(0.0);
    return ground.x() < -0.35 && ground.x() > -0.65 && std::abs(ground.y()) < 0.2 ? kLabel
                                                                                  : kGround;
  }
  // Coordinates about the tin's axis.
  Eigen::Vector2d Pixel(double x, double y, double z) const {
    return camera_.Pixel(axis_ + Eigen::Vector3d(x, y, z));
  }
  std::vector<Eigen::Vector2d> Ring(double z) const {
    std::vector<Eigen::Vector2d> ring;
    for (int i = 0; i < 60; ++i) {
      const double t = 2.0 * kPi * i / 60;
      ring.push_back(Pixel(kTinRadius * std::cos(t), kTinRadius * std::sin(t), z));
    }
    return ring;
  }
  // The base and four lines about it are the plane's evidence, exact; `more`: keys of the image.
  Outcome Run(const std::string& more) const {
    const auto p = [this](double x, double y) { return Pixel(x, y, 0.0); };
    const auto pencil = [](const char* id, const std::vector<Eigen::Vector2d>& ends) {
      return std::string("{ id: \"") + id + "\", direction: \"" + id +
             "\", plane: \"ground\", segments: " + Numbers(ends) + " }";
    };
    const std::string scene = folder_.Write(
        "scene.yaml",
        "%YAML:1.0\n---\n" + camera_.CameraText() +
            "images:\n  - { file: \"tin.png\", camera: \"k\", frame: { plane: \"ground\", "
            "origin_is_center: \"base\", x_axis: " +
            Numbers({p(0, 0), p(1, 0)}) + ", y_axis: " + Numbers({p(0, 0), p(0, 1)}) +
            " }, circles: [ { id: \"base\", plane: \"ground\", radius: 0.3, contour: " +
            Numbers(Ring(0.0)) + " }, { id: \"rim\", plane: \"lid\", contour: " +
            Numbers(Ring(kTinHeight)) + " }, { id: \"leaning\", plane: \"wall\", contour: " +
            Numbers({{300, 90}, {300, 110}, {250, 100}, {350, 100}, {265, 107.1}, {335, 107.1}}) +
            " } ], pencils: [ " + pencil("x", {p(-.6, -.5), p(.6, -.5), p(-.6, .5), p(.6, .5)}) +
            ", " + pencil("y", {p(-.6, -.5), p(-.6, .5), p(.6, -.5), p(.6, .5)}) + " ]" + more +
            " }\n");
    return RunProgram(CIRCLINE_RECONSTRUCT,
                      "--scene='" + scene + "' --output='" + folder_ / "out" + "'");
  }
  static std::string Tin(const std::string& keys) {
    return ", solids: [ { id: \"tin\", kind: \"cylinder\", base: \"base\", true_height: 0.5, " +
           keys + " } ]";
  }
  cv::Vec4b Middle(const std::string& patch) const {
    const cv::Mat texture =
        cv::imread(folder_ / ("out/texture_" + patch + ".png"), cv::IMREAD_UNCHANGED);
    if (texture.channels() != 4) return {};
    return texture.at<cv::Vec4b>(texture.rows / 2, texture.cols / 2);
  }

  const TestFolder folder_;
  const PaintedBox camera_;
  const Eigen::Vector3d axis_{0.45, 0.3, 0.0};
};

// By the image of the upper centre, and by the upper rim.
TEST_F(ReconstructCylinder, MeasuresAndModelsATin) {
  for (const std::string& keys :
       {"top: " + Numbers({Pixel(0.0, 0.0, kTinHeight)}), std::string("rim: \"rim\"")}) {
    const Outcome outcome = Run(Tin(keys));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const std::map<std::string, MeasuredRow> measured =
        ReadMeasurements(folder_ / "out/measurements.csv");
    ASSERT_EQ(measured.count("height tin"), 1U) << keys;
    const MeasuredRow& height = measured.at("height tin");
    EXPECT_NEAR(height.value, kTinHeight, 1e-3 * kTinHeight) << keys;
    EXPECT_GT(height.sigma, 0.0) << keys;
    EXPECT_LT(height.sigma, 0.02 * kTinHeight) << keys;
    EXPECT_EQ(height.unit, "world");
    EXPECT_DOUBLE_EQ(height.truth, 0.5);
    EXPECT_NEAR(height.relative_error, height.value / 0.5 - 1.0, 1e-6);
    EXPECT_EQ(Middle("cylinder_tin_top"), cv::Vec4b(kLid, kLid, kLid, 255)) << keys;
    EXPECT_EQ(Middle("cylinder_tin_side"), cv::Vec4b(kSide, kSide, kSide, 255)) << keys;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out/texture_circle_base.png"));
  }
}

TEST_F(ReconstructCylinder, ModelsAFace) {
  const std::string corners =
      Numbers({Pixel(-.65, -.2, 0), Pixel(-.35, -.2, 0), Pixel(-.35, .2, 0), Pixel(-.65, .2, 0)});
  const auto face = [&](const char* plane) {
    return ", faces: [ { id: \"label\", corners: " + corners + ", plane: \"" + plane + "\" } ]";
  };
  const Outcome outcome = Run(face("ground"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(Middle("face_label"), cv::Vec4b(kLabel, kLabel, kLabel, 255));
  std::filesystem::remove_all(folder_ / "out");
  const Outcome elsewhere = Run(face("lid"));
  EXPECT_EQ(elsewhere.exit_code, 2);
  EXPECT_CONTAINS(elsewhere.err,
                  "the face 'label' lies in the plane 'lid'; only faces of the world's plane, "
                  "'ground', can be modelled");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

// Ids that differ in what no file name has, or in the case of letters.
TEST_F(ReconstructCylinder, EachPatchHasFilesOfItsOwn) {
  const std::string here =
      Numbers({Pixel(-.6, -.15, 0), Pixel(-.4, -.15, 0), Pixel(-.4, .15, 0), Pixel(-.6, .15, 0)});
  const std::string beside =
      Numbers({Pixel(-1, -.15, 0), Pixel(-.8, -.15, 0), Pixel(-.8, .15, 0), Pixel(-1, .15, 0)});
  const auto face = [](const std::string& id, const std::string& corners) {
    return "{ id: \"" + id + "\", corners: " + corners + ", plane: \"ground\" }";
  };
  const Outcome outcome =
      Run(", faces: [ " + face("a label", here) + ", " + face("a/label", beside) + ", " +
          face("A.1", here) + ", " + face("a.1", beside) + " ]");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const cv::Vec4b label(kLabel, kLabel, kLabel, 255), ground(kGround, kGround, kGround, 255);
  EXPECT_EQ(Middle("face_a_label"), label);
  EXPECT_EQ(Middle("face_a_label_2"), ground);
  EXPECT_EQ(Middle("face_A.1"), label);
  EXPECT_EQ(Middle("face_a.1_2"), ground);
  EXPECT_CONTAINS(ReadAll(folder_ / "out/model.obj"), "usemtl face_a_label_2\n");
}

TEST_F(ReconstructCylinder, SaysWhatIsWrong) {
  const Outcome outcome = Run(Tin("rim: \"leaning\""));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_CONTAINS(outcome.err,
                  "the cylinder 'tin': its rim 'leaning' does not lie in a plane parallel to its "
                  "base");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

}  // namespace
}  // namespace circline::apps
