// Circles of a calibration sheet are told by themselves, and say more than their contours.
#include "circline/refine/many/square_lattice.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "circline/estimators/random.h"
#include "circline/refine/adjust_photos.h"
#include "tests/basics.h"
#include "tests/sheet_photos.h"
#include "tests/trials.h"

namespace circline {
namespace {

// Centres in squares of a sheet of 3 x 4 circles; oblong if `row` is not 1.
std::vector<Eigen::Vector2d> Centers(double row = 1.0) {
  std::vector<Eigen::Vector2d> centers;
  for (int k = 0; k < 12; ++k) centers.emplace_back(k % 4, row * (k / 4));
  return centers;
}

// Turned, scaled, and each off its place by this, in squares.
Layout LayoutOf(const std::vector<Eigen::Vector2d>& centers, double off = 0.0) {
  Random random(7);
  Layout layout;
  for (std::size_t k = 0; k < centers.size(); ++k) {
    const double x = centers[k].x() + off * random.Normal();
    const double y = centers[k].y() + off * random.Normal();
    layout["c" + std::to_string(k)] = {
        {5.0 + 90.0 * (0.8 * x - 0.6 * y), -3.0 + 90.0 * (0.6 * x + 0.8 * y)}, 35.0};
  }
  return layout;
}

TEST(SquareLattice, IsFoundWithItsFrame) {
  const Layout layout = LayoutOf(Centers(), 0.01);
  const SquareLattice lattice = FindSquareLattice(layout);
  EXPECT_EQ(lattice.circles.size(), 12U);
  EXPECT_EQ(lattice.Width(), 3);
  Eigen::Vector2d origin, side;
  ASSERT_TRUE(lattice.Fit(layout, &origin, &side));
  EXPECT_NEAR(side.norm(), 90.0, 1.0);
}

TEST(SquareLattice, IsFoundWhereEveryOtherPlaceIsEmpty) {
  std::vector<Eigen::Vector2d> centers;
  for (int k = 0; k < 44; ++k) centers.emplace_back(2.0 * (k % 4) + (k / 4) % 2, k / 4);
  EXPECT_EQ(FindSquareLattice(LayoutOf(centers, 0.005)).circles.size(), 44U);
}

TEST(SquareLattice, OfCirclesAboutOneCentreTheLargestIsOnIt) {
  Layout layout = LayoutOf(Centers());
  layout["hole"] = {layout["c5"].center, 10.0};
  layout["mark"] = {0.5 * (layout["c5"].center + layout["c6"].center), 10.0};
  const SquareLattice lattice = FindSquareLattice(layout);
  EXPECT_EQ(lattice.circles.size(), 12U);
  for (const auto& [place, id] : lattice.circles) EXPECT_EQ(id.front(), 'c');
}

TEST(SquareLattice, IsNoneWhereSquaresAreOblongOrCirclesLieAnyhow) {
  EXPECT_TRUE(FindSquareLattice(LayoutOf(Centers(1.23))).circles.empty());
  EXPECT_TRUE(FindSquareLattice(LayoutOf({{0, 0}, {1, 0}, {0, 1}, {1, 1}})).circles.empty());
  EXPECT_TRUE(FindSquareLattice({}).circles.empty());
  Random random(6);
  for (int trial = 0; trial < 100; ++trial) {
    std::vector<Eigen::Vector2d> centers;
    for (int k = 0; k < 12; ++k) {
      const double x = random.Uniform(0.0, 4.0);
      centers.emplace_back(x, random.Uniform(0.0, 3.0));
    }
    EXPECT_TRUE(FindSquareLattice(LayoutOf(centers)).circles.empty()) << trial;
  }
}

Photos SheetPhotos(int count, std::uint64_t seed) {
  Photos sheet(count, seed);
  for (std::size_t k = 0; k < 12; ++k)
    sheet.WithCircle("c" + std::to_string(k), 0.4, Centers()[k] - Eigen::Vector2d(1.5, 1.0));
  return sheet;
}

TEST(SquareLattice, TellsTheCameraWithinItsSigma) {
  const int trials = Trials(20);
  double with = 0.0, without = 0.0, nees = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    const Photos sheet = SheetPhotos(3, static_cast<std::uint64_t>(20 + trial));
    AdjustOptions options = PointNoiseOnly();
    const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, options));
    nees += CameraNees(adjusted.cameras[0], sheet.truth(), 3) / trials;
    with += adjusted.cameras[0].Sigma(2);
    options.square_grids = false;
    without += Ok(AdjustPhotos(sheet.photos, options)).cameras[0].Sigma(2);
  }
  EXPECT_LT(with, 0.7 * without);
  if (kSanitized) return;
  EXPECT_GT(nees, 0.5);
  EXPECT_LT(nees, 1.6);
}

// One that was made elsewhere counts for nothing but itself, and spoils nothing.
TEST(SquareLattice, AnOddCircleIsLeftOut) {
  Photos sheet = SheetPhotos(4, 40);
  sheet.WithCircle("odd", 0.4, {2.53, 0.01});
  AdjustOptions options = PointNoiseOnly();
  options.noise_model.grid_line = NoiseModel().grid_line;
  const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, options));
  EXPECT_LT(CameraNees(adjusted.cameras[0], sheet.truth(), 3), 4.0);
  EXPECT_NE(std::find_if(adjusted.notes.begin(), adjusted.notes.end(),
                         [](const std::string& note) {
                           return note.find("grid of equal squares") != std::string::npos;
                         }),
            adjusted.notes.end());
}

// Nor do sheets whose rows were printed 1 % longer than their columns count as squares.
TEST(SquareLattice, ANearlySquareSheetIsNone) {
  Photos sheet(4, 41);
  for (std::size_t k = 0; k < 12; ++k)
    sheet.WithCircle("c" + std::to_string(k), 0.4, Centers(1.01)[k] - Eigen::Vector2d(1.5, 1.0));
  AdjustOptions options = PointNoiseOnly();
  options.noise_model.grid_line = NoiseModel().grid_line;
  const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, options));
  EXPECT_LT(CameraNees(adjusted.cameras[0], sheet.truth(), 3), 4.0);
}

}  // namespace
}  // namespace circline
