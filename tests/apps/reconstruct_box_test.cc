// circline_reconstruct on a box: found in a photo, and marked in a scene file.
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <string>
#include <vector>

#include "tests/apps/board_set.h"
#include "tests/apps/painted_box.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

class ReconstructBox : public testing::Test {
 protected:
  void SetUp() override { box_.Paint(folder_ / "box.png"); }

  // `image`: what the scene file says of the photo.
  Outcome Run(const std::string& image, const std::string& flags = "") const {
    const std::string scene = folder_.Write(
        "scene.yaml", "%YAML:1.0\n---\n" + box_.CameraText() +
                          "images:\n  - { file: \"box.png\", camera: \"k\"" + image + " }\n");
    return RunProgram(CIRCLINE_RECONSTRUCT,
                      "--scene='" + scene + "' --output='" + folder_ / "out" + "' " + flags);
  }
  // The upper nearest corner and its three edges, and the far edges of the faces. The upper far
  // edge along x is marked by so much beside where it is.
  std::string Marked(const std::string& more, const Eigen::Vector2d& beside = {0.0, 0.0}) const {
    const auto edge = [](const char* along, const char* far, const Eigen::Vector2d& a,
                         const Eigen::Vector2d& b) {
      return std::string("{ along: \"") + along + "\", far: \"" + far +
             "\", points: " + Numbers({a, b}) + " }";
    };
    const auto c = [this](int x, int y, int z) { return box_.Corner(x, y, z); };
    return ", solids: [ { id: \"carton\", kind: \"box\", corner: " + Numbers({c(0, 0, 1)}) +
           ", x: " + Numbers({c(1, 0, 1)}) + ", y: " + Numbers({c(0, 1, 1)}) +
           ", z: " + Numbers({c(0, 0, 0)}) + ", edges: [ " +
           edge("x", "y", c(0, 1, 1) + beside, c(1, 1, 1) + beside) + ", " +
           edge("y", "x", c(1, 0, 1), c(1, 1, 1)) + ", " + edge("x", "z", c(0, 0, 0), c(1, 0, 0)) +
           ", " + edge("y", "z", c(0, 0, 0), c(0, 1, 0)) + " ]" + more + " } ]";
  }
  std::map<std::string, MeasuredRow> Measured() const {
    return ReadMeasurements(folder_ / "out/measurements.csv");
  }
  cv::Mat Texture(const std::string& patch) const {
    return cv::imread(folder_ / ("out/texture_" + patch + ".png"), cv::IMREAD_UNCHANGED);
  }
  tinygltf::Model ReadGlb() const {
    tinygltf::Model model;
    tinygltf::TinyGLTF reader;
    std::string error, warning;
    EXPECT_TRUE(reader.LoadBinaryFromFile(&model, &error, &warning, folder_ / "out/model.glb"));
    EXPECT_EQ(error + warning, "");
    return model;
  }
  static std::vector<Eigen::Vector3f> Points(const tinygltf::Model& model, std::size_t mesh) {
    const auto& accessor = model.accessors.at(
        static_cast<std::size_t>(model.meshes.at(mesh).primitives.at(0).attributes.at("POSITION")));
    const auto& view = model.bufferViews.at(static_cast<std::size_t>(accessor.bufferView));
    std::vector<Eigen::Vector3f> points(accessor.count);
    std::memcpy(points.at(0).data(), model.buffers.at(0).data.data() + view.byteOffset,
                accessor.count * sizeof(Eigen::Vector3f));
    return points;
  }

  const TestFolder folder_;
  const PaintedBox box_;
};

TEST_F(ReconstructBox, FindsTheBoxOfAPhoto) {
  const Outcome outcome =
      Run(", solids: [ { id: \"carton\", kind: \"box\", length: [0., 0.6, 0.], true_length: [0.9, "
          "0.6, 0.4] } ]");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::map<std::string, MeasuredRow> measured = Measured();
  for (const char* axis : {"x", "z"}) {
    const MeasuredRow& length = measured.at(std::string("length carton ") + axis);
    const double truth = axis[0] == 'x' ? 0.9 : 0.4;
    EXPECT_NEAR(length.value, truth, 0.01 * truth) << axis;
    EXPECT_LE(std::abs(length.value - truth), 3.0 * length.sigma) << axis;
    EXPECT_NEAR(length.relative_error, length.value / truth - 1.0, 1e-6) << axis;
  }
  // Only the faces that are seen, each with its own brightness in the middle.
  const std::map<std::string, int> brightness = {
      {"box_z1", PaintedBox::kTop}, {"box_y0", PaintedBox::kFaceY}, {"box_x0", PaintedBox::kFaceX}};
  const tinygltf::Model model = ReadGlb();
  ASSERT_EQ(model.meshes.size(), brightness.size());
  for (const auto& mesh : model.meshes) {
    ASSERT_EQ(brightness.count(mesh.name), 1U) << mesh.name;
    const cv::Mat texture = Texture(mesh.name);
    ASSERT_EQ(texture.channels(), 4) << mesh.name;
    const auto& middle = texture.at<cv::Vec4b>(texture.rows / 2, texture.cols / 2);
    EXPECT_EQ(middle[3], 255) << mesh.name;
    EXPECT_EQ(middle[0], brightness.at(mesh.name)) << mesh.name;
  }
}

TEST_F(ReconstructBox, ModelsWhatIsMarked) {
  const Outcome outcome = Run(Marked(", length: [0.9, 0., 0.], sigma_px: 0.1"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::map<std::string, MeasuredRow> measured = Measured();
  EXPECT_NEAR(measured.at("length carton y").value, 0.6, 1e-5);
  EXPECT_NEAR(measured.at("length carton z").value, 0.4, 1e-5);
  EXPECT_NEAR(measured.at("ratio carton x/y").value, 1.5, 1e-5);

  const tinygltf::Model model = ReadGlb();
  ASSERT_EQ(model.meshes.size(), 3U);
  ASSERT_EQ(model.cameras.size(), 1U);
  EXPECT_NEAR(model.cameras[0].perspective.yfov, 2.0 * std::atan(240.0 / 700.0), 1e-6);
  EXPECT_GT(model.cameras[0].perspective.zfar, model.cameras[0].perspective.znear);
  ASSERT_EQ(model.images.size(), 3U);
  for (const auto& image : model.images) EXPECT_GT(image.width, 50);
  // Each corner of the seven is the same, to the bit, in all faces that share it.
  std::set<std::array<float, 3>> corners;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::vector<Eigen::Vector3f> points = Points(model, k);
    ASSERT_EQ(points.size(), 4U);
    for (const Eigen::Vector3f& p : points) corners.insert({p.x(), p.y(), p.z()});
  }
  EXPECT_EQ(corners.size(), 7U);
  const cv::Mat views = cv::imread(folder_ / "out/views.png");
  EXPECT_GE(views.cols, 2 * PaintedBox::kWidth);
  for (const char* file : {"model.obj", "model.mtl", "texture_box_x0.png"})
    EXPECT_TRUE(std::filesystem::exists(folder_ / (std::string("out/") + file))) << file;
}

// The photo ends before the box does: what lies beyond its border is transparent, all else shown.
TEST_F(ReconstructBox, MeasuresTheEdgesThatAreMarked) {
  const Eigen::Vector2d beside(0.0, 1.5);
  std::map<std::string, double> error;  // By what the marks state.
  for (const char* stated : {"", ", sigma_px: 1."}) {
    const Outcome outcome = Run(Marked(std::string(", length: [0.9, 0., 0.]") + stated, beside));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    error[stated] = std::abs(Measured().at("length carton y").value / 0.6 - 1.0);
  }
  EXPECT_LT(error[""], 0.005);
  EXPECT_GT(error[", sigma_px: 1."], 0.01);  // They are taken at their word.
}

TEST_F(ReconstructBox, LeavesOutWhatThePhotoDoesNotShow) {
  const cv::Mat photo = cv::imread(folder_ / "box.png", cv::IMREAD_GRAYSCALE);
  const double right = std::floor(box_.Corner(1, 0, 1).x()) - 60.0;
  cv::imwrite(folder_ / "box.png", photo(cv::Rect(0, 0, static_cast<int>(right), photo.rows)));
  std::string marked = Marked(", length: [0.9, 0., 0.]");
  const std::string scene = folder_.Write(
      "scene.yaml", "%YAML:1.0\n---\ncameras:\n  - { id: \"k\", model: \"pinhole\", width: " +
                        std::to_string(static_cast<int>(right)) +
                        ", height: 480, camera_matrix: [700., 0., 319.5, 0., 700., 239.5, 0., 0., "
                        "1.] }\nimages:\n  - { file: \"box.png\", camera: \"k\"" +
                        marked + " }\n");
  const Outcome outcome = RunProgram(CIRCLINE_RECONSTRUCT,
                                     "--scene='" + scene + "' --output='" + folder_ / "out" + "'");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Eigen::Vector3d &size = box_.size, x(size.x(), 0.0, 0.0), y(0.0, size.y(), 0.0),
                        z(0.0, 0.0, size.z());
  const auto expect = [&](const char* face, const Eigen::Vector3d& corner, const Eigen::Vector3d& u,
                          const Eigen::Vector3d& v) {
    const cv::Mat texture = Texture(face);
    ASSERT_FALSE(texture.empty()) << face;
    int wrong = 0, beyond = 0;
    for (int row = 0; row < texture.rows; ++row) {
      for (int column = 0; column < texture.cols; ++column) {
        const double s = (column + 0.5) / texture.cols, t = 1.0 - (row + 0.5) / texture.rows;
        const double past = box_.Pixel(corner + s * u + t * v).x() - (std::floor(right) - 1.0);
        if (std::abs(past) < 0.1) continue;
        beyond += past > 0.0;
        wrong += (texture.at<cv::Vec4b>(row, column)[3] == 0) != (past > 0.0);
      }
    }
    EXPECT_EQ(wrong, 0) << face;
    EXPECT_EQ(beyond > 0, u.x() > 0.0) << face;  // Both faces along x are cut.
  };
  expect("box_z1", z, x, y);
  expect("box_y0", {0.0, 0.0, 0.0}, x, z);
  expect("box_x0", y, -y, z);
}

TEST_F(ReconstructBox, SaysWhatIsWrong) {
  const auto expect = [&](const std::string& image, int exit_code, const char* words,
                          const std::string& flags = "") {
    const Outcome outcome = Run(image, flags);
    EXPECT_EQ(outcome.exit_code, exit_code) << image;
    EXPECT_CONTAINS(outcome.err, words);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  };
  const auto solid = [](const std::string& keys) {
    return ", solids: [ { id: \"b\", kind: " + keys + " } ]";
  };
  expect(solid("\"cone\""), 2, "'cone' is not one of box, cylinder");
  expect(solid("\"box\", corner: [10., 10.], x: [10., 10.], y: [20., 10.], z: [10., 30.]"), 2,
         "the edge along x has no length");
  expect(solid("\"box\", corner: [10., 10.], x: [50., 10.], y: [20., 10.]"), 2, "z");
  expect(solid("\"box\", y: [20., 10.]"), 2, "there is no 'corner' that its edge is at");
  expect(solid("\"box\", top: [20., 10.]"), 2, "there is no 'base' that it is above");
  expect(solid("\"box\", length: [1., -2., 0.]"), 2,
         "must be three lengths, 0 where one is not known");
  expect(solid("\"box\", edges: [ { along: \"x\", far: \"x\", points: [0., 0., 9., 9.] } ]"), 2,
         "must name axes across the edge");
  expect(solid("\"box\", base: \"f\""), 2, "there is no face 'f' of four corners");
  expect(solid("\"cylinder\", base: \"c7\", top: [1., 1.]"), 2, "there is no circle 'c7'");
  const std::string corner =
      "\"box\", corner: [100., 100.], x: [200., 100.], y: [100., 200.], z: [90., 60.]";
  expect(solid(corner), 1, "edges at one end only");
  const std::string circle =
      ", circles: [ { id: \"c\", contour: [1., 0., 0., 1., -1., 0., 0., -1., 0.7, 0.7] } ]";
  expect(circle + ", solids: [ { id: \"b\", kind: " + corner +
             " }, { id: \"tin\", kind: \"cylinder\", base: \"c\", top: [1., 1.] } ]",
         2, "the box 'b' is modelled alone: leave out the cylinder 'tin'");
  expect(", faces: [ { id: \"f\", corners: [1., 1., 9., 1., 9., 9.] } ]" + solid(corner), 2,
         "leave out the face 'f', which is not its base");
  expect(solid(corner), 2, "--hypothesis: a marked box has one pose", "--hypothesis=1");
}

}  // namespace
}  // namespace circline::apps
