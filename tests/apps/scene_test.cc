#include "apps/common/scene.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "circline/estimators/basics.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

const char kCamera[] =
    "cameras:\n"
    "  - { id: \"cam0\", model: \"opencv\", width: 640, height: 480,\n"
    "      camera_matrix: [500, 0, 320., 0., 510.5, 240, 0, 0, 1], distortion: [-0.1, 0.01, 0, 0., "
    "0] }\n";

std::string Scene(const std::string& images) {
  return std::string("%YAML:1.0\n---\n") + kCamera + "images:\n" + images;
}

// The message of a scene that must be refused.
std::string ErrorOfScene(const std::string& content) {
  const TestFolder folder;
  std::vector<SceneImage> images;
  const Status status = ReadScene(folder.Write("scene.yaml", content), {}, &images);
  EXPECT_FALSE(status.ok());
  EXPECT_EQ(status.code, StatusCode::kInvalidArgument);
  EXPECT_TRUE(images.empty());
  EXPECT_CONTAINS(status.message, "scene.yaml: ");
  EXPECT_EQ(status.message.find('\n'), std::string::npos) << status.message;
  return status.message;
}

std::string ErrorOfImage(const std::string& rest) {
  return ErrorOfScene(Scene("  - { file: \"a.jpg\", camera: \"cam0\", " + rest + " }\n"));
}

std::vector<SceneImage> ImagesOf(const std::string& content) {
  const TestFolder folder;
  std::vector<SceneImage> images;
  const Status status = ReadScene(folder.Write("scene.yaml", content), {}, &images);
  EXPECT_TRUE(status.ok()) << status.message;
  return images;
}

TEST(Scene, ReadsHowWellThingsAreKnown) {
  const std::string contour = "contour: [1,2, 3,4.5, 5,6, 7,8, 9,10]";
  const std::string circle =
      "circles: [ { id: \"c0\", radius: 0.03, radius_sigma: 0.02, " + contour +
      " } ], known: { length: [ { points: [0,0,1,1], value: 2., sigma: 0.1 } ] }";
  const std::string camera =
      "cameras: [ { id: \"cam0\", model: \"pinhole\", camera_matrix: [500, 0, 320., 0., 500., 240, "
      "0, 0, 1], focal_sigma: 0.05, k1_sigma: 0 } ]\n";
  const std::vector<SceneImage> images =
      ImagesOf("%YAML:1.0\n---\n" + camera + "images:\n  - { file: \"a.jpg\", " + circle + " }\n");
  ASSERT_EQ(images.size(), 1u);
  EXPECT_EQ(images[0].observations.circles[0].radius_sigma, 0.02);
  EXPECT_EQ(images[0].observations.known_lengths[0].sigma, 0.1);
  EXPECT_TRUE(images[0].camera_sigma.IsAny());
  const CameraSigma sigma = images[0].camera_sigma.Over({0.3, 0.4, 5.0, 0.6});
  EXPECT_EQ(sigma.log_focal, 0.05);
  EXPECT_EQ(sigma.log_aspect, 0.4);
  EXPECT_EQ(sigma.principal_point_px, 5.0);
  EXPECT_EQ(sigma.k1, 0.0);
  EXPECT_CONTAINS(ErrorOfImage("circles: [ { id: \"c\", radius_sigma: 0.1, " + contour + " } ]"),
                  "radius_sigma: there is no radius");
  EXPECT_CONTAINS(
      ErrorOfScene(
          "cameras: [ { id: \"a\", model: \"pinhole\", camera_matrix: [5,0,3,0,5,2,0,0,1], "
          "principal_point_sigma_px: -1 } ]\nimages: [ { file: \"a.jpg\" } ]\n"),
      "principal_point_sigma_px: must be 0");
}

TEST(Scene, ReadsEverything) {
  const TestFolder folder;
  const std::string path = folder.Write("set/scene.yaml", Scene(R"(
  - file: "photos/a.jpg"
    camera: "cam0"
    circles:
      - { id: "c0", contour: [1,2, 3,4.5, 5,6, 7,8, 9,10], center: [5, 6], radius: 0.03, plane: "p0",
          concentric: "g0", radius_group: "dots", sigma_px: 0.2, diameters: [0,0,10,10, 0,10,10,0] }
      - { id: 1, roi: [10, 20.5, 30, 40], plane: "p0" }
    pencils:
      - { id: "L1", segments: [0,0,100,0, 0,50,100,50], direction: "x", plane: "p0", sigma_px: 1 }
      - { id: "L2", segments: [0,0,0,100] }
    frame: { plane: "p0", origin: [5, 6], x_axis: [0,0,100,0], y_axis: [0,0,0,100], origin_is_center: "c0" }
    known: { angle_deg: [ { pencils: ["L1", "L2"], value: 90, sigma: 0.5 } ],
             length: [ { points: [0,0,100,0], plane: "p0", value: 0.1 } ] }
    truth: { rotation: [1,0,0, 0,0,-1, 0,1,0], translation: [1, 2, 3], symmetry: "D2",
             directions: [ { pencil: "L1", value: [2, 0, 0] } ] }
  - file: "/data/b.png"
)"));
  std::vector<SceneImage> images;
  const Status status = ReadScene(path, {}, &images);
  ASSERT_TRUE(status.ok()) << status.message;
  ASSERT_EQ(images.size(), 2U);

  const SceneImage& a = images[0];
  EXPECT_EQ(a.name, "photos/a.jpg");
  EXPECT_EQ(std::filesystem::path(a.path),
            std::filesystem::path(folder / "set/photos/a.jpg").lexically_normal());
  EXPECT_FALSE(a.detect_everything);
  const Observations& o = a.observations;
  EXPECT_EQ(o.camera.id, "cam0");
  EXPECT_EQ(o.camera.model, CameraModel::kOpenCV);
  EXPECT_EQ(o.camera.fx, 500.0);
  EXPECT_EQ(o.camera.fy, 510.5);
  EXPECT_EQ(o.camera.distortion[0], -0.1);
  ASSERT_EQ(o.circles.size(), 2U);
  ASSERT_EQ(o.circles[0].points.size(), 5U);
  EXPECT_EQ(o.circles[0].points[1], Eigen::Vector2d(3.0, 4.5));
  EXPECT_EQ(*o.circles[0].center, Eigen::Vector2d(5.0, 6.0));
  EXPECT_EQ(o.circles[0].radius, 0.03);
  EXPECT_EQ(o.circles[0].concentric, "g0");
  EXPECT_EQ(o.circles[0].radius_group, "dots");
  EXPECT_EQ(o.circles[0].sigma_px, 0.2);
  EXPECT_EQ(o.circles[0].diameters.size(), 2U);
  EXPECT_EQ(o.circles[1].id, "1");
  EXPECT_TRUE(o.circles[1].points.empty());
  ASSERT_EQ(a.rois.size(), 1U);
  EXPECT_EQ(a.rois[0].circle, 1U);
  EXPECT_EQ(a.rois[0].rectangle, (std::array<int, 4>{10, 20, 30, 41}));  // Whole pixels around it.
  ASSERT_EQ(o.pencils.size(), 2U);
  EXPECT_EQ(o.pencils[0].lines.size(), 2U);
  EXPECT_EQ(o.pencils[0].lines[1].points[1], Eigen::Vector2d(100.0, 50.0));
  EXPECT_EQ(o.pencils[0].direction, PencilDirection::kX);
  EXPECT_EQ(o.pencils[1].direction, PencilDirection::kFree);
  EXPECT_EQ(o.frame.plane, "p0");
  EXPECT_EQ((*o.frame.y_axis)[1], Eigen::Vector2d(0.0, 100.0));
  EXPECT_EQ(o.frame.origin_is_center, "c0");
  ASSERT_EQ(o.known_angles.size(), 1U);
  EXPECT_NEAR(o.known_angles[0].value, 1.5707963267948966, 1e-15);
  EXPECT_NEAR(o.known_angles[0].sigma, 0.5 * kDegree, 1e-15);
  ASSERT_EQ(o.known_lengths.size(), 1U);
  EXPECT_EQ(o.known_lengths[0].value, 0.1);
  ASSERT_TRUE(a.truth.has_value());
  EXPECT_EQ(a.truth->symmetry, Symmetry::kD2);
  EXPECT_NEAR((a.truth->rotation->col(1) - Eigen::Vector3d::UnitZ()).norm(), 0.0, 1e-12);
  EXPECT_EQ(*a.truth->translation, Eigen::Vector3d(1.0, 2.0, 3.0));
  ASSERT_EQ(a.truth->directions.size(), 1U);
  EXPECT_EQ(a.truth->directions[0].direction, Eigen::Vector3d::UnitX());

  const SceneImage& b = images[1];
  EXPECT_EQ(b.path, "/data/b.png");
  EXPECT_TRUE(b.detect_everything);
  EXPECT_EQ(b.observations.camera.id, "cam0");  // The only one.
  EXPECT_FALSE(b.truth.has_value());
}

TEST(Scene, ReadsJsonAndYamlWithoutHeader) {
  const std::string json =
      R"({ "cameras": [ { "id": "k", "model": "pinhole", "width": 64, "height": 48,
      "camera_matrix": [50, 0, 32, 0, 50, 24, 0, 0, 1] } ],
    "images": [ { "file": "a.png", "camera": "k" } ] })";
  EXPECT_EQ(ImagesOf(json).size(), 1U);
  EXPECT_EQ(ImagesOf(std::string(kCamera) + "images:\n  - { file: \"a.png\" }\n").size(), 1U);
  EXPECT_EQ(ImagesOf("\xEF\xBB\xBF" + Scene("  - { file: \"a.png\" }\n")).size(), 1U);
}

TEST(Scene, CameraMatrixMayBeAnOpenCvMatrix) {
  const std::vector<SceneImage> images = ImagesOf(R"(%YAML:1.0
---
cameras:
  - id: "m"
    model: "fisheye"
    camera_matrix: !!opencv-matrix
       rows: 3
       cols: 3
       dt: d
       data: [ 300., 0., 100., 0., 301., 90., 0., 0., 1. ]
    distortion: [0.1, 0.2, 0.3, 0.4]
images:
  - { file: "a.png", camera: "m" }
)");
  ASSERT_EQ(images.size(), 1U);
  EXPECT_EQ(images[0].observations.camera.fy, 301.0);
  EXPECT_EQ(images[0].observations.camera.distortion[3], 0.4);
}

TEST(Scene, TakesCamerasFromElsewhere) {
  const TestFolder folder;
  Camera camera;
  camera.id = "given";
  camera.fx = camera.fy = 100.0;
  std::vector<SceneImage> images;
  const std::string path = folder.Write("s.yaml", "images:\n  - { file: \"a.png\" }\n");
  ASSERT_TRUE(ReadScene(path, {camera}, &images).ok());
  EXPECT_EQ(images[0].observations.camera.id, "given");
  EXPECT_CONTAINS(ReadScene(path, {}, &images).message, "there is no camera");
  const std::string own =
      folder.Write("own.yaml", Scene("  - { file: \"a.jpg\", camera: \"cam0\" }\n"));
  EXPECT_TRUE(ReadScene(own, {}, &images).ok());
  EXPECT_CONTAINS(ReadScene(own, {camera}, &images).message, "own.yaml has cameras of its own");
}

TEST(Scene, NamesUnknownKeysAndTheirPlace) {
  EXPECT_CONTAINS(ErrorOfScene(Scene("  - { file: \"a.jpg\", camera: \"cam0\", cirlces: [] }\n")),
                  "images[0] (\"a.jpg\"): unknown key 'cirlces'; did you mean 'circles'?");
  EXPECT_CONTAINS(ErrorOfScene(Scene("  - { file: \"a.jpg\", camera: \"cam0\" }\n") + "extra: 1\n"),
                  "unknown key 'extra'");
  EXPECT_CONTAINS(ErrorOfImage("circles: [ { id: \"c\", contuor: [1,2,3,4,5,6,7,8,9,10] } ]"),
                  "images[0] (\"a.jpg\").circles[0]: unknown key 'contuor'");
  EXPECT_CONTAINS(ErrorOfImage("pencils: [ { id: \"l\", segments: [0,0,1,1], dir: \"x\" } ]"),
                  "pencils[0]: unknown key 'dir'");
  EXPECT_CONTAINS(ErrorOfImage("frame: { orign: [1,2] }"), "frame: unknown key 'orign'");
  EXPECT_CONTAINS(ErrorOfImage("known: { angles: [] }"), "known: unknown key 'angles'");
  EXPECT_CONTAINS(ErrorOfImage("truth: { R: [1,0,0,0,1,0,0,0,1] }"), "truth: unknown key 'R'");
  EXPECT_CONTAINS(
      ErrorOfScene("cameras:\n  - { id: \"c\", model: \"pinhole\", focal: 3 }\nimages:\n  - "
                   "{ file: \"a\" }\n"),
      "cameras[0]: unknown key 'focal'");
}

TEST(Scene, NamesWrongTypesAndCounts) {
  EXPECT_CONTAINS(ErrorOfImage("circles: 3"), "circles: must be a list");
  EXPECT_CONTAINS(ErrorOfImage("circles: [ { id: \"c\", contour: \"x\" } ]"),
                  "contour: must be a list of numbers");
  EXPECT_CONTAINS(ErrorOfImage("circles: [ { id: \"c\", contour: [1,2,3,\"4\",5,6,7,8,9,10] } ]"),
                  "contour[3]: must be a number");
  EXPECT_CONTAINS(ErrorOfImage("circles: [ { id: \"c\", contour: [1,2,3,4,5,6,7,8,9] } ]"),
                  "must have 2 numbers for each entry, has 9");
  EXPECT_CONTAINS(ErrorOfImage("circles: [ { id: \"c\", contour: [] } ]"),
                  "contour: is empty: must have 2 numbers for each entry");
  EXPECT_CONTAINS(ErrorOfImage("circles: [ { id: \"c\", contour: [1,2,3,4,5,6,7,8] } ]"),
                  "must have 5 points or more, has 4");
  EXPECT_CONTAINS(ErrorOfImage("circles: [ { id: \"c\", contour: [1,2,3,.nan,5,6,7,8,9,10] } ]"),
                  "must be a finite number");
  EXPECT_CONTAINS(ErrorOfImage("circles: [ { id: \"c\", roi: [1,2,0,4] } ]"),
                  "width and height must be positive");
  EXPECT_CONTAINS(ErrorOfImage("circles: [ { id: \"c\" } ]"), "give 'contour', or 'roi'");
  EXPECT_CONTAINS(ErrorOfImage("circles: [ { id: \"c\", roi: [1,2,3,4], radius: -1 } ]"),
                  "circles[0].radius: must be positive");
  EXPECT_CONTAINS(ErrorOfImage("pencils: [ { id: \"l\", segments: [0,0,1,1,2,2] } ]"),
                  "segments: must have 4 numbers for each entry, has 6");
  EXPECT_CONTAINS(ErrorOfImage("pencils: [ { id: \"l\", segments: [0,0,1,1,2,2,2,2] } ]"),
                  "segment 1 has no length");
  EXPECT_CONTAINS(ErrorOfImage("pencils: [ { id: \"l\", segments: [0,0,1,1], direction: \"w\" } ]"),
                  "direction: 'w' is not one of x, y, z, free");
  EXPECT_CONTAINS(ErrorOfImage("frame: { origin: [1,2,3] }"),
                  "frame.origin: must have 2 numbers, has 3");
  EXPECT_CONTAINS(ErrorOfImage("truth: { rotation: [1,0,0,0,1,0,0,0,2] }"),
                  "is not a rotation matrix");
  EXPECT_CONTAINS(ErrorOfImage("truth: { rotation: [1,0,0,0,1,0,0,0,-1] }"),
                  "is not a rotation matrix");
  EXPECT_CONTAINS(ErrorOfImage("truth: { symmetry: \"D3\" }"),
                  "'D3' is not one of none, D2, D4, axis");
}

TEST(Scene, NamesMissingAndDanglingIds) {
  EXPECT_CONTAINS(ErrorOfImage("circles: [ { roi: [1,2,3,4] } ]"), "circles[0]: 'id' is missing");
  EXPECT_CONTAINS(
      ErrorOfImage("circles: [ { id: \"c\", roi: [1,2,3,4] }, { id: \"c\", roi: [1,2,3,4] } ]"),
      "circles[1]: id 'c' is used twice");
  EXPECT_CONTAINS(ErrorOfImage("pencils: [ { id: \"l\" } ]"), "'segments' is missing");
  EXPECT_CONTAINS(
      ErrorOfImage(
          "circles: [ { id: \"c\", roi: [1,2,3,4] } ], frame: { origin_is_center: \"d\" }"),
      "frame.origin_is_center: there is no circle 'd'");
  EXPECT_CONTAINS(
      ErrorOfImage("circles: [ { id: \"c\", roi: [1,2,3,4] } ], frame: { plane: \"q\" }"),
      "names the plane 'q'");
  const std::string pencil = "pencils: [ { id: \"l\", segments: [0,0,1,1] } ], ";
  EXPECT_CONTAINS(
      ErrorOfImage(pencil + "known: { angle_deg: [ { pencils: [\"l\",\"m\"], value: 90 } ] }"),
      "known.angle_deg[0].pencils[1]: there is no pencil 'm'");
  EXPECT_CONTAINS(
      ErrorOfImage(
          "pencils: [ { id: \"l\", segments: [0,0,1,1] }, { id: \"m\", segments: "
          "[0,0,1,2] } ], known: { angle_deg: [ { pencils: [\"l\",\"m\"], value: 450 } ] }"),
      "known.angle_deg[0].value: must be within 360 degrees");
  EXPECT_CONTAINS(
      ErrorOfImage(pencil + "truth: { directions: [ { pencil: \"m\", value: [1,0,0] } ] }"),
      "there is no pencil 'm'");
  EXPECT_CONTAINS(ErrorOfScene(Scene("  - { file: \"a.jpg\", camera: \"cam1\" }\n")),
                  "camera: there is no camera 'cam1'; did you mean 'cam0'?");
  EXPECT_CONTAINS(ErrorOfScene(Scene("  - { camera: \"cam0\" }\n")),
                  "images[0]: 'file' is missing");
  EXPECT_CONTAINS(ErrorOfScene(std::string(kCamera)), "'images' is missing");
}

TEST(Scene, NamesBadCameras) {
  const std::string image = "images:\n  - { file: \"a\", camera: \"c\" }\n";
  EXPECT_CONTAINS(
      ErrorOfScene("cameras:\n  - { id: \"c\", model: \"pinhole\", width: 4, height: 4 }\n" +
                   image),
      "cameras[0] (\"c\"): 'camera_matrix' is missing: a camera needs its focal length");
  const auto with_matrix = [&](const std::string& matrix, const std::string& rest) {
    return "cameras:\n  - { id: \"c\", model: " + rest + ", camera_matrix: [" + matrix + "] }\n" +
           image;
  };
  EXPECT_CONTAINS(ErrorOfScene(with_matrix("0,0,3,0,5,3,0,0,1", "\"pinhole\"")),
                  "must be positive");
  EXPECT_CONTAINS(ErrorOfScene(with_matrix("5,1,3,0,5,3,0,0,1", "\"pinhole\"")), "skew");
  EXPECT_CONTAINS(ErrorOfScene(with_matrix("5,0,0,0,5,0,3,3,1", "\"pinhole\"")), "row by row");
  EXPECT_CONTAINS(ErrorOfScene(with_matrix("5,0,3,0,5,3,0,0,1", "\"fish\"")),
                  "'fish' is not one of");
  EXPECT_CONTAINS(
      ErrorOfScene(with_matrix("5,0,3,0,5,3,0,0,1", "\"opencv\", distortion: [0.1, 0.2]")),
      "4, 5 or 8 coefficients");
  EXPECT_CONTAINS(
      ErrorOfScene(with_matrix("5,0,3,0,5,3,0,0,1", "\"pinhole\", distortion: [0.1, 0, 0, 0]")),
      "a pinhole camera has no distortion");
}

TEST(Scene, NamesMalformedFiles) {
  EXPECT_CONTAINS(ErrorOfScene("images:\n  - { file: \"01.jpg }\n"), "line 3: ");
  EXPECT_CONTAINS(ErrorOfScene("%YAML:1.0\n---\ncameras: [ { id: \"c\"\nimages: x\n"),
                  "not valid YAML, JSON or XML");
  EXPECT_CONTAINS(ErrorOfScene("{ \"images\": [ }"), "not valid YAML, JSON or XML");
  EXPECT_CONTAINS(ErrorOfScene(""), "is empty");
  EXPECT_CONTAINS(ErrorOfScene("just words"), "scene.yaml: ");
  EXPECT_CONTAINS(ErrorOfScene(std::string(300, '\0')), "scene.yaml: ");
  std::vector<SceneImage> images;
  EXPECT_CONTAINS(ReadScene("/nonexistent/scene.yaml", {}, &images).message,
                  "/nonexistent/scene.yaml: cannot be opened");
}

}  // namespace
}  // namespace circline::apps
