#include "circline/estimators/point_noise.h"

#include <gtest/gtest.h>

#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/estimators/random.h"
#include "tests/basics.h"
#include "tests/pinhole_camera.h"

namespace circline {
namespace {

Observations MakePhoto() {
  Observations photo;
  photo.camera = PinholeCamera();
  return photo;
}

void AddCircle(double sigma, int n, Random* random, Observations* photo) {
  CircleObservation circle;
  circle.id = "c" + std::to_string(photo->circles.size());
  for (int i = 0; i < n; ++i) {
    const double t = 2.0 * kPi * i / n;
    circle.points.push_back(Eigen::Vector2d(300.0 + 100.0 * std::cos(t), 200 + 60.0 * std::sin(t)) +
                            Noise2(sigma, random));
  }
  photo->circles.push_back(circle);
}

// Lines through (2000, 300), each from x = 100 to x = 500.
void AddPencil(double sigma, int num_lines, int n, Random* random, Observations* photo) {
  PencilObservation pencil;
  pencil.id = "p" + std::to_string(photo->pencils.size());
  for (int i = 0; i < num_lines; ++i) {
    LineObservation line;
    for (int k = 0; k < n; ++k) {
      const double share = k / (n - 1.0), y = 40.0 * i;
      const Eigen::Vector2d from(100.0, y), to(500.0, y + (300.0 - y) * 400.0 / 1900.0);
      line.points.push_back(from + share * (to - from) + Noise2(sigma, random));
    }
    pencil.lines.push_back(line);
  }
  photo->pencils.push_back(pencil);
}

// As robust fits leave them.
void AddMasks(Observations* photo) {
  for (CircleObservation& circle : photo->circles) circle.inliers.assign(circle.points.size(), 1);
  for (PencilObservation& pencil : photo->pencils) {
    for (LineObservation& line : pencil.lines) line.inliers.assign(line.points.size(), 1);
  }
}

PointNoise Measure(bool masks, Observations photo) {
  if (masks) AddMasks(&photo);
  FitDirect(1.0, &photo);
  return MeasurePointNoise(photo);
}

TEST(PointNoise, TellsCirclesOfDifferentNoiseApart) {
  for (const bool masks : {false, true}) {
    double good = 0.0, bad = 0.0;
    constexpr int kTrials = 200;
    for (int trial = 0; trial < kTrials; ++trial) {
      Random random(static_cast<std::uint64_t>(trial));
      Observations photo = MakePhoto();
      for (const double sigma : {0.2, 0.8, 0.8}) AddCircle(sigma, 100, &random, &photo);
      const PointNoise noise = Measure(masks, photo);
      good += noise.circles[0] / kTrials;
      bad += (noise.circles[1] + noise.circles[2]) / (2 * kTrials);
      EXPECT_LT(noise.circles[0], 0.5 * noise.circles[1]);
    }
    EXPECT_NEAR(good, 0.2, 0.03);
    EXPECT_NEAR(bad, 0.8, 0.03);
  }
}

TEST(PointNoise, IsUnbiased) {
  for (const bool masks : {false, true}) {
    for (const double sigma : {0.1, 0.5, 2.0}) {
      double conic = 0.0, line = 0.0, segment = 0.0;
      constexpr int kTrials = 200;
      for (int trial = 0; trial < kTrials; ++trial) {
        Random random(static_cast<std::uint64_t>(trial));
        Observations photo = MakePhoto();
        AddCircle(sigma, 100, &random, &photo);
        AddPencil(sigma, 4, 100, &random, &photo);
        const PointNoise noise = Measure(masks, photo);
        conic += noise.circles[0] / kTrials;
        line += noise.lines[0][1] / kTrials;
        photo.pencils.clear();
        AddPencil(sigma, 30, 2, &random, &photo);
        segment += Measure(masks, photo).lines[0][1] / kTrials;
      }
      EXPECT_NEAR(conic / sigma, 1.0, 0.04) << sigma;
      EXPECT_NEAR(line / sigma, 1.0, 0.05) << sigma;
      EXPECT_NEAR(segment / sigma, 1.0, 0.15) << sigma;  // 28 degrees of freedom, prior 0.4 px.
    }
  }
}

TEST(PointNoise, ManyShortLinesDoNotPullTheCommonNoiseDown) {
  double common = 0.0;
  constexpr int kTrials = 100;
  for (int trial = 0; trial < kTrials; ++trial) {
    Random random(static_cast<std::uint64_t>(trial));
    Observations photo = MakePhoto();
    AddPencil(0.5, 60, 3, &random, &photo);
    common += Measure(true, photo).line_px / kTrials;
  }
  EXPECT_NEAR(common, 0.5, 0.04);
}

// Seven points of a contour say little of its noise, hundreds of lines' points a lot.
TEST(PointNoise, LinesTellTheNoiseOfASmallContour) {
  constexpr int kTrials = 200;
  int right = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    Random random(static_cast<std::uint64_t>(trial));
    Observations photo = MakePhoto();
    AddCircle(2.0, 7, &random, &photo);
    AddPencil(2.0, 6, 50, &random, &photo);
    const double sigma = Measure(true, photo).circles[0];
    EXPECT_GT(sigma, 1.0);
    right += sigma < 3.0 ? 1 : 0;
  }
  EXPECT_GT(right, 0.93 * kTrials);
}

TEST(PointNoise, WhatIsStatedIsBelieved) {
  Random random(1);
  Observations photo = MakePhoto();
  AddCircle(0.5, 100, &random, &photo);
  photo.circles[0].sigma_px = 3.0;
  AddPencil(0.5, 3, 20, &random, &photo);
  photo.pencils[0].sigma_px = 2.0;
  photo.pencils[0].lines[1].sigma_px = 4.0;
  const PointNoise noise = Measure(true, photo);
  EXPECT_EQ(noise.circles[0], 3.0);
  EXPECT_EQ(noise.lines[0], (std::vector<double>{2.0, 4.0, 2.0}));
}

TEST(PointNoise, TakesTheDefaultWhereNothingIsRedundant) {
  Random random(1);
  Observations photo = MakePhoto();
  AddCircle(0.5, 5, &random, &photo);
  AddPencil(0.5, 2, 2, &random, &photo);
  const PointNoise noise = Measure(false, photo);
  EXPECT_EQ(noise.conic_px, 0.3);
  EXPECT_EQ(noise.circles[0], 0.3);
  EXPECT_EQ(noise.line_px, 0.4);
  EXPECT_EQ(noise.lines[0], (std::vector<double>{0.4, 0.4}));
  const PointNoise other =
      MeasurePointNoise(photo, NoiseModel::Exact(), 0.7, 0.6);  // No fits at all.
  EXPECT_EQ(other.circles[0], 0.7);
  EXPECT_EQ(other.lines[0][1], 0.6);
}

// Two segments meet somewhere, whatever their noise: they are taken to be as sharp as the contour.
TEST(PointNoise, ContoursTellTheNoiseOfSegments) {
  for (const double sigma : {0.1, 0.5, 2.0}) {
    Random random(1);
    Observations photo = MakePhoto();
    AddCircle(sigma, 100, &random, &photo);
    AddPencil(sigma, 2, 2, &random, &photo);
    const PointNoise noise = Measure(true, photo);
    EXPECT_EQ(noise.line_px, noise.conic_px);
    EXPECT_NEAR(noise.lines[0][1] / sigma, 1.0, 0.2);
  }
}

TEST(PointNoise, StrayPointsHardlyCount) {
  Random random(1);
  Observations photo = MakePhoto();
  AddCircle(0.5, 100, &random, &photo);
  FitDirect(1.0, &photo);
  const double clean = MeasurePointNoise(photo).circles[0];
  for (std::size_t i = 0; i < 100; i += 5) photo.circles[0].points[i].x() += 30.0;
  EXPECT_LT(MeasurePointNoise(photo).circles[0], 1.5 * clean);
}

}  // namespace
}  // namespace circline
