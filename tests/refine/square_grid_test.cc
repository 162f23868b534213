// A chessboard's lines are told by themselves, and say more than their directions.
#include "circline/refine/many/square_grid.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "circline/refine/many/adjustment.h"
#include "tests/refine/simulated_options.h"
#include "tests/sheet_photos.h"
#include "tests/trials.h"

namespace circline {
namespace {

// A board of lines along X at each multiple of `rows`, and along Y of `columns`.
struct Board {
  double rows = 1.0, columns = 1.0;
  int num_rows = 6, num_columns = 8;
};

void AddLines(const Board& board, Photos* sheet) {
  for (int k = 0; k < board.num_rows; ++k) {
    const double y = board.rows * (k - 2.5);
    sheet->WithLine(PencilDirection::kX, {-3.5, y}, {3.5, y});
  }
  for (int k = 0; k < board.num_columns; ++k) {
    const double x = board.columns * (k - 3.5);
    sheet->WithLine(PencilDirection::kY, {x, -2.5}, {x, 2.5});
  }
}

Photos BoardPhotos(int count, std::uint64_t seed, const Board& board = {}) {
  Photos sheet(count, seed);
  AddLines(board, &sheet);
  return sheet;
}

std::optional<SquareGrid> GridOf(const Photos& sheet, std::size_t photo) {
  const EstimationOptions options = PoseOptions(PointNoiseOnly());
  return FindSquareGrid(Prepare(sheet.photos[photo], sheet.truth(), options),
                        sheet.poses[photo].rotation);
}

TEST(SquareGrid, IsFoundWithItsPose) {
  const Photos sheet = BoardPhotos(6, 3);
  for (std::size_t i = 0; i < sheet.photos.size(); ++i) {
    const std::optional<SquareGrid> grid = GridOf(sheet, i);
    ASSERT_TRUE(grid) << i;
    EXPECT_EQ(grid->places.size(), 14U);
    EXPECT_EQ(grid->width, 7);
    for (const auto& [at, place] : grid->places) EXPECT_EQ(place, static_cast<int>(at.second));
    // The origin is where the first lines meet.
    const CameraPose& truth = sheet.poses[i];
    const Eigen::Vector3d corner =
        truth.rotation * Eigen::Vector3d(-3.5, -2.5, 0.0) + truth.translation;
    EXPECT_LT((grid->cam_from_board.translation - corner).norm(), 0.05);
  }
}

TEST(SquareGrid, RimsAndOtherLinesAreNotOnIt) {
  Photos sheet = BoardPhotos(6, 4);
  sheet.WithLine(PencilDirection::kX, {-3.5, 2.87}, {3.5, 2.87})
      .WithLine(PencilDirection::kX, {-3.5, -2.81}, {3.5, -2.81})
      .WithLine(PencilDirection::kY, {3.83, -2.5}, {3.83, 2.5})
      .WithLine(PencilDirection::kY, {-1.27, -2.5}, {-1.27, 0.0});
  for (std::size_t i = 0; i < sheet.photos.size(); ++i) {
    const std::optional<SquareGrid> grid = GridOf(sheet, i);
    ASSERT_TRUE(grid) << i;
    EXPECT_EQ(grid->places.size(), 14U) << i;
  }
}

TEST(SquareGrid, IsNoneWhereSquaresAreOblongOrLinesLieAnyhow) {
  const Photos oblong = BoardPhotos(6, 5, {1.0, 1.23});
  for (std::size_t i = 0; i < oblong.photos.size(); ++i) EXPECT_FALSE(GridOf(oblong, i)) << i;
  Random random(6);
  Photos anyhow(30, 6);
  for (int k = 0; k < 16; ++k) {
    const double at = 3.0 * (2.0 * random.Uniform() - 1.0);
    if (k % 2 == 0) anyhow.WithLine(PencilDirection::kX, {-3.0, at}, {3.0, at});
    if (k % 2 == 1) anyhow.WithLine(PencilDirection::kY, {at, -3.0}, {at, 3.0});
  }
  for (std::size_t i = 0; i < anyhow.photos.size(); ++i) EXPECT_FALSE(GridOf(anyhow, i)) << i;
}

TEST(SquareGrid, TellsTheCameraWithinItsSigma) {
  const int trials = Trials(12);
  double with = 0.0, without = 0.0, nees = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    Photos sheet = BoardPhotos(6, static_cast<std::uint64_t>(20 + trial), {1.0, 1.0, 5, 5});
    for (Observations& photo : sheet.photos) {
      photo.camera.cx += 9.0;
      photo.camera.cy -= 7.0;
    }
    AdjustOptions options = PointNoiseOnly();
    const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, options));
    for (std::size_t i = 0; i < adjusted.photos.size(); ++i) {
      const AdjustedPhoto& photo = adjusted.photos[i];
      ASSERT_TRUE(photo.status.ok()) << photo.status.message;
      EXPECT_EQ(photo.num_grid_lines, 10);
      // Up to which corner is the origin, the board's distance is known.
      EXPECT_NEAR(photo.cam_from_world.rotation.col(2).dot(photo.cam_from_world.translation),
                  sheet.poses[i].rotation.col(2).dot(sheet.poses[i].translation), 0.3);
    }
    nees += CameraNees(adjusted.cameras[0], sheet.truth(), 3) / trials;
    with += adjusted.cameras[0].Sigma(0);
    options.square_grids = false;
    const AdjustedPhotos as_lines = AdjustPhotos(sheet.photos, options);
    EXPECT_EQ(as_lines.photos[0].num_grid_lines, 0);
    without += as_lines.cameras[0].Sigma(0);
  }
  EXPECT_LT(with, 0.6 * without);
  if (kSanitized) return;
  EXPECT_GT(nees, 0.5);
  EXPECT_LT(nees, 1.7);
}

// Small in the photo, too, where places told far better than pixels tell them would leave too few
// digits for the rest: the refinement would stop half-way and state too little.
TEST(SquareGrid, AnExactOneIsRefinedToTheEnd) {
  const int trials = Trials(12);
  double nees = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    const auto seed = static_cast<std::uint64_t>(50 + trial);
    Photos sheet(6, seed, 0.6, CameraModel::kFisheye);
    Random random(seed);
    for (CameraPose& pose : sheet.poses) {
      pose.rotation = pose.rotation * ExpRotation({0.0, 0.0, random.Uniform(-kPi, kPi)});
      pose.translation *= 3.5;
    }
    AddLines({1.0, 1.0, 5, 5}, &sheet);
    AdjustOptions options;
    options.noise_model = NoiseModel::Exact();
    const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, options));
    nees += CameraNees(adjusted.cameras[0], sheet.truth(), 3) / trials;
  }
  if (kSanitized) return;
  EXPECT_LT(nees, 1.7);
}

// A row that was made larger than the others counts for nothing, and spoils nothing.
TEST(SquareGrid, AnOddRowIsLeftOut) {
  Photos sheet = BoardPhotos(6, 40);
  sheet.WithLine(PencilDirection::kX, {-3.5, 3.54}, {3.5, 3.54});
  AdjustOptions options = PointNoiseOnly();
  options.noise_model.grid_line = NoiseModel().grid_line;
  const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, options));
  for (const AdjustedPhoto& photo : adjusted.photos) EXPECT_EQ(photo.num_grid_lines, 14);
  EXPECT_LT(CameraNees(adjusted.cameras[0], sheet.truth(), 3), 4.0);
}

}  // namespace
}  // namespace circline
