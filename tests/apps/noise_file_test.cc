#include "apps/common/noise_file.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

TEST(NoiseFile, ReplacesWhatItNames) {
  const TestFolder folder;
  NoiseModel model = NoiseModel::Exact();
  const std::string yaml =
      "contour_px: 0.1\nline_px: 0.2\ncorrelation_px: 30\ncontour_offset_px: 0.3\n"
      "circle_tilt_rad: 0.01\ncircle_height: 0.02\ncircle_shape: 0.015\nline_direction_rad: 0.03\n"
      "pencil_axis_rad: 0.04\ngrid_line: 0.002\nradius: 0.05\n"
      "camera: { log_focal: 0.06, log_aspect: 0.07, principal_point_px: 2, k1: 0.08 }\n";
  ASSERT_TRUE(ReadNoiseModel(folder.Write("noise.yml", yaml), &model).ok());
  EXPECT_EQ(model.contour_px, 0.1);
  EXPECT_EQ(model.line_px, 0.2);
  EXPECT_EQ(model.correlation_px, 30.0);
  EXPECT_EQ(model.contour_offset_px, 0.3);
  EXPECT_EQ(model.circle_tilt_rad, 0.01);
  EXPECT_EQ(model.circle_height, 0.02);
  EXPECT_EQ(model.circle_shape, 0.015);
  EXPECT_EQ(model.line_direction_rad, 0.03);
  EXPECT_EQ(model.pencil_axis_rad, 0.04);
  EXPECT_EQ(model.grid_line, 0.002);
  EXPECT_EQ(model.radius, 0.05);
  EXPECT_EQ(model.length, 0.0);  // As it was.
  EXPECT_EQ(model.camera.log_focal, 0.06);
  EXPECT_EQ(model.camera.log_aspect, 0.07);
  EXPECT_EQ(model.camera.principal_point_px, 2.0);
  EXPECT_EQ(model.camera.k1, 0.08);
  const std::string json = "{ \"length\": 0.5, \"camera\": { \"k1\": 0 } }";
  ASSERT_TRUE(ReadNoiseModel(folder.Write("noise.json", json), &model).ok());
  EXPECT_EQ(model.length, 0.5);
  EXPECT_EQ(model.camera.k1, 0.0);
  EXPECT_EQ(model.camera.log_focal, 0.06);
}

TEST(NoiseFile, NamesWhatIsWrong) {
  const TestFolder folder;
  const auto error_of = [&](const std::string& content) {
    NoiseModel model;
    model.line_px = 7.0;
    const Status status = ReadNoiseModel(folder.Write("noise.yml", content), &model);
    EXPECT_EQ(status.code, StatusCode::kInvalidArgument) << content;
    EXPECT_CONTAINS(status.message, "noise.yml: ");
    EXPECT_EQ(model.line_px, 7.0);
    return status.message;
  };
  EXPECT_CONTAINS(error_of("line_px: 1\ncontour: 0.1\n"), "unknown key 'contour'");
  EXPECT_CONTAINS(error_of("line_px: 1\ncamera: { focal: 0.1 }\n"), "camera: unknown key 'focal'");
  EXPECT_CONTAINS(error_of("line_px: -1\n"), "line_px must be 0 or more");
  EXPECT_CONTAINS(error_of("line_px: wide\n"), "line_px: must be");
  EXPECT_CONTAINS(error_of("correlation_px: 0\n"), "correlation_px must be positive");
  EXPECT_CONTAINS(error_of("camera: { k1: -0.1 }\n"), "camera.k1 must be 0 or more");
  NoiseModel model;
  EXPECT_CONTAINS(ReadNoiseModel("/nonexistent.yml", &model).message, "cannot be opened");
}

}  // namespace
}  // namespace circline::apps
