// The scene file and the draft that the studio keeps, beside what other hands write into them.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/imgcodecs.hpp>

#include "apps/common/document.h"
#include "apps/studio/answer.h"
#include "apps/studio/studio.h"
#include "tests/apps/studio_disc.h"
#include "tests/apps/test_files.h"
#include "tests/pinhole_camera.h"

namespace circline::apps {
namespace {

namespace fs = std::filesystem;

constexpr char kCameraText[] =
    "{ id: 0, model: pinhole, width: 320, height: 240, "
    "camera_matrix: [317.5, 0., 160., 0., 317.5, 120., 0., 0., 1.] }";

Camera CameraOf(double focal_px) {
  Camera camera = PinholeCamera(focal_px, 320, 240);
  camera.id = "camera";
  return camera;
}

// A folder with two photos of a disc: 0, a.png, and 1, b.png.
class StudioSceneTest : public testing::Test {
 protected:
  StudioSceneTest() {
    for (const char* name : {"a.png", "b.png"}) cv::imwrite(folder_ / name, DiscPhoto(320, 240));
  }

  std::unique_ptr<Studio> Open(const Camera* camera) { return OpenStudio(folder_.path(), camera); }
  std::vector<SceneImage> Saved() {
    std::vector<SceneImage> images;
    const Status status = ReadScene(folder_ / "scene.json", {}, &images);
    EXPECT_TRUE(status.ok()) << status.message;
    return images;
  }
  // As somebody's editor does, a second after all else.
  void WriteByHand(const std::string& name, const std::string& text) {
    using Clock = fs::file_time_type::clock;
    fs::last_write_time(folder_.Write(name, text), Clock::now() + std::chrono::seconds(++edits_));
  }

  TestFolder folder_;
  int edits_ = 0;
};

std::string ErrorOf(const std::function<void()>& work) {
  try {
    work();
  } catch (const RequestError& error) {
    return error.what();
  }
  return "";
}

TEST_F(StudioSceneTest, LeavesTheCamerasOfOtherPhotos) {
  const Camera cameras[] = {CameraOf(300.0), CameraOf(400.0)};
  for (const int n : {0, 1, 0}) {
    const auto studio = Open(&cameras[n]);
    const Json scene = SceneOfDisc(studio->Detect({{"image", n}}));
    studio->Save({{"image", n}, {"scene", scene}});
    studio->Save({{"image", n}, {"scene", scene}});
  }
  const std::vector<SceneImage> saved = Saved();
  ASSERT_EQ(saved.size(), 2U);
  EXPECT_EQ(saved[0].observations.camera.fx, 300.0);
  EXPECT_EQ(saved[1].observations.camera.fx, 400.0);
  Json scene;
  ASSERT_TRUE(ReadSceneJson(folder_ / "scene.json", &scene).ok());
  EXPECT_EQ(scene["cameras"].size(), 2U);
}

TEST_F(StudioSceneTest, TakesTheOnlyCameraAndNumbersAsNames) {
  WriteByHand("scene.json", std::string("cameras:\n  - ") + kCameraText +
                                "\nimages:\n  - { file: a.png }\n  - { file: b.png, camera: 0, "
                                "pencils: [ { id: 7, plane: 1, segments: [1,2,30,40] } ] }\n");
  const auto studio = Open(nullptr);
  EXPECT_EQ(studio->Images()["images"][0]["saved"], true);
  const Json pencil = studio->Session(1)["saved"]["pencils"][0];
  EXPECT_EQ(pencil["id"], "7");
  EXPECT_EQ(pencil["plane"], "1");
  EXPECT_EQ(pencil["segments"], Json({1, 2, 30, 40}));
  const Json scene = SceneOfDisc(studio->Detect({{"image", 0}}));
  for (const int n : {0, 1}) {
    const Json estimate = studio->Estimate({{"image", n}, {"scene", scene}});
    EXPECT_EQ(estimate["camera"]["camera_matrix"][0], 317.5);
    studio->Save({{"image", n}, {"scene", scene}});
  }
  for (const SceneImage& image : Saved()) EXPECT_EQ(image.observations.camera.fx, 317.5);
}

// However the scene file writes its path; the first of several entries, which is the one shown.
TEST_F(StudioSceneTest, SavesTheEntryThatItShows) {
  WriteByHand("scene.json", std::string("cameras:\n  - ") + kCameraText +
                                "\nimages:\n  - { file: ./a.png, pencils: [ { id: first, "
                                "segments: [1,2,30,40] } ] }\n  - { file: a.png }\n");
  const auto studio = Open(nullptr);
  EXPECT_EQ(studio->Images()["images"][0]["saved"], true);
  EXPECT_EQ(studio->Session(0)["saved"]["pencils"][0]["id"], "first");
  const Json scene = SceneOfDisc(studio->Detect({{"image", 0}}));
  studio->Save({{"image", 0}, {"scene", scene}});
  const std::vector<SceneImage> saved = Saved();
  ASSERT_EQ(saved.size(), 2U);
  EXPECT_EQ(saved[0].observations.circles.size(), 1U);
  EXPECT_TRUE(saved[1].detect_everything);
}

TEST_F(StudioSceneTest, KeepsWhatAnotherHandWroteMeanwhile) {
  const auto studio = Open(nullptr);
  const Json scene = SceneOfDisc(studio->Detect({{"image", 0}}));
  studio->Save({{"image", 0}, {"scene", scene}});
  Json whole;
  ASSERT_TRUE(ReadSceneJson(folder_ / "scene.json", &whole).ok());
  Json other = whole["images"][0];
  other["file"] = "b.png";
  whole["images"].push_back(other);
  WriteByHand("scene.json", DocumentText(whole));
  studio->Save({{"image", 0}, {"scene", Json::object()}});
  std::vector<SceneImage> saved = Saved();
  ASSERT_EQ(saved.size(), 2U);
  EXPECT_TRUE(saved[0].detect_everything);
  EXPECT_EQ(saved[1].observations.circles.size(), 1U);

  WriteByHand("scene.json", "{ \"pictures\": [] }");
  EXPECT_CONTAINS(ErrorOf([&] { studio->Save({{"image", 0}, {"scene", scene}}); }), "pictures");
  EXPECT_EQ(ReadAll(folder_ / "scene.json"), "{ \"pictures\": [] }");
  WriteByHand("scene.json", DocumentText(whole));
  EXPECT_EQ(ErrorOf([&] { studio->Save({{"image", 0}, {"scene", scene}}); }), "");
}

TEST_F(StudioSceneTest, DoesNotWriteOverADraftThatItCannotRead) {
  WriteByHand("scene.draft.json", "{ \"a.png\": ");
  const auto studio = Open(nullptr);
  EXPECT_CONTAINS(studio->Images()["problem"].get<std::string>(), "scene.draft.json");
  EXPECT_CONTAINS(ErrorOf([&] {
                    studio->Draft({{"image", 0}, {"state", Json::object()}});
                  }),
                  "is not written over");
  EXPECT_EQ(ReadAll(folder_ / "scene.draft.json"), "{ \"a.png\": ");
}

TEST_F(StudioSceneTest, SaysHowManyMeasurementsCannotBeHad) {
  const Camera camera = CameraOf(300.0);  // Through an unknown lens neither might be seen.
  const auto studio = Open(&camera);
  Json request = {{"image", 0}, {"format", "csv"}};
  request["scene"] = SceneOfDisc(studio->Detect({{"image", 0}}));
  // Far up and far down: one of the two is beyond the plane's horizon.
  for (const double v : {5e3, -5e3}) {
    request["measure"].push_back({{"kind", "length"}, {"points", {160, 120, 160, v}}});
  }
  EXPECT_CONTAINS(studio->Export(request)["note"].get<std::string>(), "1 of 2 measurements");
  request["measure"] = 7;
  EXPECT_CONTAINS(ErrorOf([&] { studio->Export(request); }), "'measure' must be a list");
}

TEST(StudioAnswer, AnglesOfLinesAreAcute) {
  PoseHypothesis hypothesis;
  hypothesis.cam_from_world.translation = {0.0, 0.0, 1.0};
  for (const double v : {40.0, -40.0}) {
    const Json asked = {{"kind", "angle"},
                        {"points", {160, 120, 200, 120, 160, 120, 120, 120 + v}}};
    EXPECT_NEAR(Measured(asked, hypothesis, CameraOf(300.0))["value"].get<double>(), 45.0, 1e-9);
  }
}

}  // namespace
}  // namespace circline::apps
