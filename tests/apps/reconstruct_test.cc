// circline_reconstruct on a painted box: its top is the world's plane, two of its sides are seen.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "circline/estimators/basics.h"
#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

constexpr double kRadius = 0.3, kHalfX = 1.0, kHalfY = 0.6, kDepth = 0.8;
constexpr int kTop = 200, kLeftOfTop = 160, kDisc = 30, kFront = 90, kRight = 120, kAround = 10;

// Coordinates of the world: the top is Z = 0, the box hangs below it, as Z faces the camera.
class Box {
 public:
  Box() {
    rotation_ = Eigen::AngleAxisd(kPi - 0.9, Eigen::Vector3d::UnitX()) *
                Eigen::AngleAxisd(-0.6, Eigen::Vector3d::UnitZ());
    translation_ = Eigen::Vector3d(0.0, -0.2, 4.5);
  }
  Eigen::Vector3d Center() const { return -(rotation_.transpose() * translation_); }
  Eigen::Vector2d Pixel(const Eigen::Vector3d& x) const {
    const Eigen::Vector3d p = rotation_ * x + translation_;
    return {kFocal * p.x() / p.z() + (kWidth - 1) / 2.0,
            kFocal * p.y() / p.z() + (kHeight - 1) / 2.0};
  }
  int Brightness(double u, double v) const {
    const Eigen::Vector3d from = Center();
    const Eigen::Vector3d ray =
        rotation_.transpose() *
        Eigen::Vector3d((u - (kWidth - 1) / 2.0) / kFocal, (v - (kHeight - 1) / 2.0) / kFocal, 1.0);
    const auto hit = [&](int axis, double at) {
      return (from + (at - from[axis]) / ray[axis] * ray).eval();
    };
    const Eigen::Vector3d top = hit(2, 0.0), front = hit(1, -kHalfY), right = hit(0, kHalfX);
    if (std::abs(top.x()) < kHalfX && std::abs(top.y()) < kHalfY) {
      return top.norm() < kRadius ? kDisc : top.x() < 0.0 ? kLeftOfTop : kTop;
    }
    if (std::abs(front.x()) < kHalfX && front.z() < 0.0 && front.z() > -kDepth) return kFront;
    if (std::abs(right.y()) < kHalfY && right.z() < 0.0 && right.z() > -kDepth) return kRight;
    return kAround;
  }
  void Paint(const std::string& path) const {
    PaintPhoto(path, kWidth, kHeight, 1, [this](double u, double v) { return Brightness(u, v); });
  }
  // An image of a scene file: all that is seen of the box, exact.
  std::string Scene(const std::string& file) const {
    std::vector<Eigen::Vector2d> contour;
    for (int i = 0; i < 40; ++i) {
      const double t = 2.0 * kPi * i / 40;
      contour.push_back(Pixel({kRadius * std::cos(t), kRadius * std::sin(t), 0.0}));
    }
    const auto top = [this](int x, int y) { return Pixel({x * kHalfX, y * kHalfY, 0.0}); };
    const auto low = [this](int x, int y) { return Pixel({x * kHalfX, y * kHalfY, -kDepth}); };
    const auto pencil = [](const std::string& id, const std::string& more,
                           const std::vector<Eigen::Vector2d>& ends) {
      return "      - { id: \"" + id + "\", segments: " + Numbers(ends) + ", direction: \"" + id +
             "\"" + more + " }\n";
    };
    const std::string in_plane = ", plane: \"top\"";
    return "  - file: \"" + file + "\"\n    camera: \"k\"\n    circles:\n      - { id: \"disc\"" +
           in_plane + ", radius: 0.3, contour: " + Numbers(contour) + " }\n    pencils:\n" +
           pencil("x", in_plane, {top(-1, -1), top(1, -1), top(-1, 1), top(1, 1)}) +
           pencil("y", in_plane, {top(-1, -1), top(-1, 1), top(1, -1), top(1, 1)}) +
           pencil("z", "",
                  {top(-1, -1), low(-1, -1), low(1, -1), top(1, -1), top(1, 1), low(1, 1)}) +
           "    frame: { plane: \"top\", origin_is_center: \"disc\", x_axis: " +
           Numbers({Pixel({0, 0, 0}), Pixel({1, 0, 0})}) +
           ", y_axis: " + Numbers({Pixel({0, 0, 0}), Pixel({0, 0.6, 0})}) + " }\n";
  }

 private:
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d translation_;
};

struct ObjObject {
  std::vector<Eigen::Vector3d> vertices;
  int faces = 0, lines = 0;
};

std::map<std::string, ObjObject> ReadObj(const std::string& path) {
  std::map<std::string, ObjObject> objects;
  std::istringstream text(ReadAll(path));
  std::string name;
  for (std::string line; std::getline(text, line);) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    Eigen::Vector3d x;
    if (key == "o") words >> name;
    if (key == "v" && words >> x.x() >> x.y() >> x.z()) objects[name].vertices.push_back(x);
    if (key == "f") ++objects[name].faces;
    if (key == "l") ++objects[name].lines;
  }
  return objects;
}

class Reconstruct : public testing::Test {
 protected:
  void SetUp() override {
    box_.Paint(folder_ / "box.png");
    scene_ = folder_.Write("scene.yaml", "%YAML:1.0\n---\n" + BoardCamera() + "images:\n" +
                                             box_.Scene("box.png") +
                                             "  - { file: \"box.png\", camera: \"k\", circles: [ { "
                                             "id: \"none\", roi: [0, 0, 20, 20] } ] }\n");
  }
  Outcome Run(const std::string& flags) const {
    return RunProgram(CIRCLINE_RECONSTRUCT,
                      "--scene='" + scene_ + "' --output='" + folder_ / "out" + "' " + flags);
  }
  int Brightness(const std::string& texture, double s, double t) const {
    const cv::Mat picture = cv::imread(folder_ / "out/" + texture, cv::IMREAD_GRAYSCALE);
    return picture.empty() ? -1
                           : picture.at<std::uint8_t>(static_cast<int>((1.0 - t) * picture.rows),
                                                      static_cast<int>(s * picture.cols));
  }
  const TestFolder folder_;
  const Box box_;
  std::string scene_;
};

TEST_F(Reconstruct, MeasuresTheBox) {
  ASSERT_EQ(Run("--image=box.png").exit_code, 0);
  const std::map<std::string, MeasuredRow> measured =
      ReadMeasurements(folder_ / "out/measurements.csv");
  const std::map<std::string, double> truth = {
      {"length x_0", 2 * kHalfX}, {"length x_1", 2 * kHalfX},
      {"length y_0", 2 * kHalfY}, {"length y_1", 2 * kHalfY},
      {"height z_0", -kDepth},    {"height z_1", -kDepth},
      {"height z_2", -kDepth},    {"radius disc", kRadius},
      {"angle x y", 90.0},        {"angle x z", 90.0},
      {"angle y z", 90.0},        {"distance camera", box_.Center().z()}};
  ASSERT_EQ(measured.size(), truth.size());
  for (const auto& [key, value] : truth) {
    ASSERT_EQ(measured.count(key), 1U) << key;
    const MeasuredRow& row = measured.at(key);
    EXPECT_NEAR(row.value, value, 1e-4 * std::abs(value)) << key;
    EXPECT_GT(row.sigma, 0.0) << key;
    EXPECT_LT(row.sigma, 0.1 * std::abs(value)) << key;
    EXPECT_EQ(row.unit, key.rfind("angle", 0) == 0 ? "deg" : "world") << key;
  }
}

TEST_F(Reconstruct, ModelsTheBox) {
  ASSERT_EQ(Run("--image=box.png --margin=0").exit_code, 0);
  const std::map<std::string, ObjObject> objects = ReadObj(folder_ / "out/model.obj");
  std::set<std::string> names;
  for (const auto& [name, object] : objects) names.insert(name);
  EXPECT_EQ(names,
            (std::set<std::string>{"camera", "circle_disc", "face_x_0", "face_y_1", "plane"}));
  const auto expect = [&](const std::string& name, const std::vector<Eigen::Vector3d>& corners) {
    const ObjObject& object = objects.at(name);
    ASSERT_EQ(object.vertices.size(), corners.size());
    for (std::size_t i = 0; i < corners.size(); ++i) {
      EXPECT_LT((object.vertices[i] - corners[i]).norm(), 1e-3) << name << " " << i;
    }
    EXPECT_EQ(object.faces, 1);
  };
  const double x = kHalfX, y = kHalfY, z = -kDepth;
  expect("plane", {{-x, -y, 0}, {x, -y, 0}, {x, y, 0}, {-x, y, 0}});
  // Counterclockwise from outside, and upright.
  expect("face_x_0", {{-x, -y, z}, {x, -y, z}, {x, -y, 0}, {-x, -y, 0}});
  expect("face_y_1", {{x, -y, z}, {x, y, z}, {x, y, 0}, {x, -y, 0}});
  for (const Eigen::Vector3d& v : objects.at("circle_disc").vertices) {
    EXPECT_NEAR(v.head<2>().norm(), kRadius, 1e-4);
    EXPECT_NEAR(v.z(), 0.0, 0.01);
    EXPECT_GT(v.z(), 0.0);  // Before the plane.
  }
  EXPECT_LT((objects.at("camera").vertices.at(0) - box_.Center()).norm(), 1e-3);
  EXPECT_EQ(objects.at("camera").lines, 8);
  // The base of the camera's pyramid is seen at the corners of the photo.
  EXPECT_LT((box_.Pixel(objects.at("camera").vertices.at(1)) - Eigen::Vector2d(-0.5, -0.5)).norm(),
            0.1);
}

TEST_F(Reconstruct, TakesTexturesFromThePhoto) {
  ASSERT_EQ(Run("--image=box.png --margin=0 --texture_px=400").exit_code, 0);
  EXPECT_EQ(Brightness("texture.png", 0.5, 0.5), kDisc);
  EXPECT_EQ(Brightness("texture.png", 0.2, 0.2), kLeftOfTop);
  EXPECT_EQ(Brightness("texture.png", 0.8, 0.8), kTop);
  EXPECT_EQ(Brightness("texture_circle_disc.png", 0.5, 0.5), kDisc);
  EXPECT_EQ(Brightness("texture_face_x_0.png", 0.5, 0.5), kFront);
  EXPECT_EQ(Brightness("texture_face_y_1.png", 0.5, 0.5), kRight);
  EXPECT_EQ(cv::imread(folder_ / "out/texture.png").cols, 400);
  const std::string materials = ReadAll(folder_ / "out/model.mtl");
  for (const char* name : {"texture.png", "texture_circle_disc.png", "texture_face_x_0.png"}) {
    EXPECT_CONTAINS(materials, std::string("map_Kd ") + name + "\n");
  }
  const cv::Mat views = cv::imread(folder_ / "out/views.png");
  EXPECT_GT(views.cols, views.rows);
}

TEST_F(Reconstruct, SaysWhatItCannotDo) {
  const auto expect = [&](const std::string& flags, int exit_code, const char* words) {
    const Outcome outcome = Run(flags);
    EXPECT_EQ(outcome.exit_code, exit_code) << flags;
    EXPECT_CONTAINS(outcome.err, words);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  };
  expect("", 2, "--image is missing: which of the 2 images");
  expect("--image=bax.png", 2, "there is no image 'bax.png'; did you mean 'box.png'?");
  expect("--image=box.png --texture_px=1", 2, "--texture_px must be");
  expect("--image=box.png --margin=nan", 2, "--margin must be");
  expect("--image=box.png --hypothesis=9", 1, "--hypothesis=9: there are");
  for (const char* flag : {"--export_as=colmap", "--save_options=best.flags", "--resume",
                           "--merge=a,b", "--list_solvers", "--overlays=false"})
    expect(std::string("--image=box.png ") + flag, 2, "is not a flag of circline_reconstruct");
  for (const char* flag : {"--robust_loss=huber,cauchy", "--loss_scale_px=1,2"})
    expect(std::string("--image=box.png ") + flag, 2, "only circline_compare takes a list");
  expect("--image=box.png --bogus", 2, "unknown flag --bogus");
  std::filesystem::remove(folder_ / "box.png");
  expect("--image=box.png", 1, "the file does not exist");
}

}  // namespace
}  // namespace circline::apps
