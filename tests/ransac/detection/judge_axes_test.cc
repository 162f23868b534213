#include "circline/ransac/detection/structure/judge_axes.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/estimators/pose.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// A pencil known to 0.1 degrees, of eight segments on the photo side by side.
PlacedPencil Pencil(const Vector3d& direction, const Vector2d& from, const Vector2d& along,
                    const Vector2d& across) {
  DetectedPencil pencil;
  VanishingPointFit fit;
  fit.direction = direction;
  fit.covariance =
      std::pow(0.1 * kDegree, 2.0) * (Matrix3d::Identity() - direction * direction.transpose());
  pencil.observation.fit = fit;
  for (int k = 0; k < 8; ++k)
    pencil.ends.push_back({Vector2d(from + k * across), Vector2d(from + k * across + along)});
  pencil.support_px = 8.0 * along.norm();
  return PlacedPencil(std::move(pencil));
}

// Rows from (100, 100), and columns that cross them, or do so elsewhere on the photo.
struct AxisPencils {
  PlacedPencil x, y, z;

  explicit AxisPencils(const Matrix3d& R, const Vector2d& columns = {100.0, 100.0})
      : x(Pencil(R.col(0), {100.0, 100.0}, {140.0, 0.0}, {0.0, 20.0})),
        y(Pencil(R.col(1), columns, {0.0, 140.0}, {20.0, 0.0})),
        z(Pencil(R.col(2), {400.0, 100.0}, {50.0, 50.0}, {20.0, 0.0})) {}
};

AssemblyOptions Guessed() {
  AssemblyOptions options;
  options.camera.log_focal = 0.1;
  options.focal_sigma = 0.5;
  return options;
}

const Matrix3d kTurned = ExpRotation(Vector3d(0.5, -0.6, 0.4));

TEST(JudgeAxes, RowsAndColumnsAreOfOneThing) {
  AxisPencils axes(kTurned);
  JudgeAxes(Guessed(), axes.x, &axes.y, nullptr);
  EXPECT_GT(axes.y.observation.axis_probability, 0.95);
  EXPECT_LT(axes.y.observation.axis_probability, 1.0);  // Rhombs may look so, too.
}

TEST(JudgeAxes, LinesThatDoNotMeetAreDoubted) {
  AxisPencils axes(kTurned, {400.0, 300.0});
  JudgeAxes(Guessed(), axes.x, &axes.y, nullptr);
  EXPECT_LT(axes.y.observation.axis_probability, 0.1);
}

// The lines of diamond tiles meet as those of square ones do. What focal length makes them square
// is any: where it is three times the guess, that tiles are no squares is likelier.
TEST(JudgeAxes, WhatOnlyAnUnlikelyFocalLengthMakesSquareIsDoubted) {
  const auto probability_at = [](double focal_ratio) {
    Matrix3d R = Vector3d(focal_ratio, focal_ratio, 1.0).asDiagonal() * kTurned;
    R.colwise().normalize();
    AxisPencils axes(R);
    JudgeAxes(Guessed(), axes.x, &axes.y, nullptr);
    return axes.y.observation.axis_probability;
  };
  EXPECT_GT(probability_at(1.0), 0.95);
  for (const double unlikely : {1.0 / 3.0, 3.0}) {
    EXPECT_LT(probability_at(unlikely), 0.95) << unlikely;
    EXPECT_GT(probability_at(unlikely), 0.05) << unlikely;
  }
}

// Of a pencil in the plane of X, `y_deg` from it, beside another one, `skew_deg` from it.
double ProbabilityOfSquare(double y_deg, double skew_deg) {
  const auto at = [](double degrees) {
    const double a = degrees * kDegree;
    return Vector3d(kTurned * Vector3d(std::cos(a), std::sin(a), 0.0));
  };
  AxisPencils axes(kTurned);
  PlacedPencil y = Pencil(at(y_deg), {100.0, 100.0}, {0.0, 140.0}, {20.0, 0.0});
  const PlacedPencil skew = Pencil(at(skew_deg), {100.0, 100.0}, {100.0, 100.0}, {20.0, 0.0});
  JudgeAxes(Guessed(), axes.x, &y, nullptr, &skew);
  return y.observation.axis_probability;
}

// At some focal length any two of the directions of triangles and hexagons are square.
TEST(JudgeAxes, TriangularLatticesAreNoSquares) {
  EXPECT_LT(ProbabilityOfSquare(60.0, 120.0), 0.2);
  EXPECT_LT(ProbabilityOfSquare(120.0, 60.0), 0.2);
}

TEST(JudgeAxes, SquaresMayHaveBraces) {
  for (const double brace_deg : {20.0, 30.0, 45.0, 70.0, 135.0, 150.0})
    EXPECT_GT(ProbabilityOfSquare(90.0, brace_deg), 0.95) << brace_deg;
}

// Whichever way a level camera sees the corner of a house, some focal length makes it square: one
// that looks down as well has only one that makes it square to the uprights, too.
TEST(JudgeAxes, AThirdDirectionIsConfirmedByTheSecond) {
  const Matrix3d level = ExpRotation(Vector3d(0.0, 0.7, 0.0));
  AxisPencils seen_level(level), seen_from_above(kTurned);
  JudgeAxes(Guessed(), seen_level.x, &seen_level.y, &seen_level.z);
  JudgeAxes(Guessed(), seen_from_above.x, &seen_from_above.y, &seen_from_above.z);
  EXPECT_LT(seen_level.z.observation.axis_probability, 0.9);
  EXPECT_GT(seen_level.z.observation.axis_probability, 0.5);
  EXPECT_GT(seen_from_above.z.observation.axis_probability, 0.95);
  EXPECT_GT(seen_from_above.y.observation.axis_probability, 0.95);
}

// Lines that were looked for at right angles, at the guess, are there by accident the likelier the
// less they say; then they do not confirm the second direction either.
TEST(JudgeAxes, WhatWasLookedForIsDoubtedAsItMayBeThereByAccident) {
  double last = 1.0, last_y = 1.0;
  for (const double ratio : {1e6, 100.0, 5.0}) {
    AxisPencils axes(kTurned, {240.0, 100.0});
    JudgeAxes(Guessed(), axes.x, &axes.y, &axes.z, nullptr, ratio);
    EXPECT_LE(axes.z.observation.axis_probability, last) << ratio;
    EXPECT_LE(axes.y.observation.axis_probability, last_y) << ratio;
    last = axes.z.observation.axis_probability;
    last_y = axes.y.observation.axis_probability;
    if (ratio > 1e5) {
      EXPECT_GT(last, 0.95);
    }
  }
  EXPECT_LT(last, 0.95);
  EXPECT_GT(last, 0.05);
}

}  // namespace
}  // namespace circline
