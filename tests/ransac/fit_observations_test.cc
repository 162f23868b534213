#include "circline/ransac/fit_observations.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "circline/estimators/conic.h"
#include "circline/estimators/random.h"
#include "tests/ransac/stray_points_scene.h"
#include "tests/trials.h"

namespace circline {
namespace {

using stray_points_scene::FitProblems;
using stray_points_scene::MakeObservations;
using stray_points_scene::Pixel;
using stray_points_scene::SquaredError;
using stray_points_scene::TestCamera;

TEST(FitObservations, FillsEveryFit) {
  Observations observations = MakeObservations();
  const std::vector<std::string> problems = FitProblems(&observations);

  const CircleObservation& circle = observations.circles[0];
  ASSERT_TRUE(circle.fit.has_value());
  Ellipse ellipse;
  ASSERT_TRUE(ConicToEllipse(circle.fit->conic, &ellipse));
  EXPECT_NEAR(ellipse.center.x(), 0.05, 5e-4);
  EXPECT_NEAR(ellipse.a, 0.1, 5e-4);
  EXPECT_NEAR(ellipse.b, 0.07, 5e-4);
  ASSERT_EQ(circle.inliers.size(), 61u);
  for (std::size_t i = 0; i < 60; ++i) {
    if (i % 4 != 3) {
      EXPECT_EQ(circle.inliers[i], 1) << i;
    }
  }
  EXPECT_LE(std::count(circle.inliers.begin(), circle.inliers.end(), 1), 48);
  EXPECT_EQ(circle.inliers[60], 0);
  EXPECT_EQ(observations.num_dropped_points, 1);

  const PencilObservation& pencil = observations.pencils[0];
  for (const LineObservation& line : pencil.lines) {
    ASSERT_TRUE(line.fit.has_value());
    EXPECT_GT(line.fit->covariance.trace(), 0.0);
    EXPECT_EQ(line.inliers.size(), line.points.size());
  }
  EXPECT_EQ(pencil.lines[1].inliers[3], 0);
  EXPECT_EQ(pencil.lines[2].inliers, std::vector<std::uint8_t>(2, 1));
  ASSERT_TRUE(pencil.fit.has_value());
  const Eigen::Vector3d direction = Eigen::Vector3d(0.9, 0.2, 1.0).normalized();
  EXPECT_LT(direction.cross(pencil.fit->direction).norm(), 0.02);

  ASSERT_EQ(problems.size(), 1u);
  EXPECT_NE(problems[0].find("'L1', line 3"), std::string::npos) << problems[0];
}

TEST(FitObservations, TakesTheNormalsOfAContour) {
  Observations observations = MakeObservations();
  CircleObservation& circle = observations.circles[0];
  circle.normals.assign(circle.points.size(), Eigen::Vector2d::Zero());
  for (int i = 0; i < 60; ++i) {
    const double t = 0.1 * i;
    const Eigen::Vector2d along =
        Pixel(0.05 + 0.1 * std::cos(t + 1e-4), 0.07 * std::sin(t + 1e-4)) -
        Pixel(0.05 + 0.1 * std::cos(t), 0.07 * std::sin(t));
    circle.normals[static_cast<std::size_t>(i)] = {-along.y(), along.x()};
  }
  // The pixel that no camera sees comes first: normals must stay with their points.
  std::rotate(circle.points.rbegin(), circle.points.rbegin() + 1, circle.points.rend());
  std::rotate(circle.normals.rbegin(), circle.normals.rbegin() + 1, circle.normals.rend());
  std::swap(circle.normals[1].x(), circle.normals[1].y());
  circle.normals[1].x() *= -1.0;  // Along the contour, not across.
  ASSERT_TRUE(FitObservations(FitOptions(), &observations).ok());
  ASSERT_TRUE(circle.fit.has_value());
  EXPECT_EQ(circle.inliers[0], 0);
  EXPECT_EQ(circle.inliers[1], 0);
  int contour = 0;
  for (std::size_t i = 1; i < 60; ++i) contour += i % 4 != 3 && circle.inliers[i + 1] == 1 ? 1 : 0;
  EXPECT_GE(contour, 43);  // One in 500 of a Gaussian's points lies outside.

  circle.normals.pop_back();
  const Status status = FitObservations(FitOptions(), &observations);
  EXPECT_EQ(status.code, StatusCode::kInvalidArgument);
  EXPECT_NE(status.message.find("normals"), std::string::npos);
}

TEST(FitObservations, IsRepeatableAndOverwrites) {
  Observations a = MakeObservations(), b = MakeObservations();
  ASSERT_TRUE(FitObservations(FitOptions(), &a).ok());
  ASSERT_TRUE(FitObservations(FitOptions(), &b).ok());
  ASSERT_TRUE(FitObservations(FitOptions(), &b).ok());  // Fits again what was fitted.
  EXPECT_EQ(a.circles[0].fit->conic, b.circles[0].fit->conic);
  EXPECT_EQ(a.circles[0].inliers, b.circles[0].inliers);
  EXPECT_EQ(a.pencils[0].fit->direction, b.pencils[0].fit->direction);
  EXPECT_EQ(a.num_dropped_points, b.num_dropped_points);
}

TEST(FitObservations, NamesWhatCannotBeFitted) {
  Observations observations;
  observations.camera = TestCamera();
  CircleObservation few, collinear;
  few.id = "few";
  few.points = {{1.0, 2.0}, {3.0, 4.0}, {5.0, 9.0}};
  collinear.id = "collinear";
  for (int i = 0; i < 20; ++i) collinear.points.emplace_back(200.0 + 10.0 * i, 240.0);
  observations.circles = {few, collinear};
  PencilObservation pencil;
  pencil.id = "P";
  pencil.lines.resize(2);
  pencil.lines[0].points = {{100.0, 100.0}, {100.0, 100.0}};
  pencil.lines[1].points = {{100.0, 100.0}, {200.0, 120.0}};
  observations.pencils = {pencil};
  const std::vector<std::string> problems = FitProblems(&observations);
  ASSERT_EQ(problems.size(), 4u);
  EXPECT_NE(problems[0].find("circle 'few'"), std::string::npos);
  EXPECT_NE(problems[1].find("circle 'collinear'"), std::string::npos);
  EXPECT_NE(problems[2].find("pencil 'P', line 0"), std::string::npos);
  EXPECT_NE(problems[3].find("pencil 'P'"), std::string::npos);
  EXPECT_FALSE(observations.circles[0].fit.has_value());
  EXPECT_FALSE(observations.circles[1].fit.has_value());
  EXPECT_FALSE(observations.pencils[0].lines[0].fit.has_value());
  EXPECT_TRUE(observations.pencils[0].lines[1].fit.has_value());
  EXPECT_FALSE(observations.pencils[0].fit.has_value());
}

// A barrel distortion ends somewhere, and with a focal length guessed too short that is within the
// photo: features out there lose all of their points.
TEST(FitObservations, NamesWhatTheLensLeavesNoPointOf) {
  Observations observations;
  observations.camera = TestCamera();
  observations.camera.fx = observations.camera.fy = 300.0;
  observations.camera.distortion[0] = -0.5;
  CircleObservation circle;
  circle.id = "corner";
  PencilObservation pencil;
  pencil.id = "P";
  pencil.lines.resize(2);
  for (int i = 0; i < 20; ++i) {
    circle.points.emplace_back(600.0 + 20.0 * std::cos(0.3 * i), 440.0 + 20.0 * std::sin(0.3 * i));
    pencil.lines[0].points.emplace_back(600.0 + i, 440.0);
    pencil.lines[1].points.emplace_back(600.0 + i, 450.0);
  }
  observations.circles = {circle};
  observations.pencils = {pencil};
  const std::vector<std::string> problems = FitProblems(&observations);
  ASSERT_EQ(problems.size(), 4u);
  EXPECT_NE(problems[0].find("circle 'corner'"), std::string::npos);
  EXPECT_EQ(observations.num_dropped_points, 60);
}

TEST(FitObservations, ASingleLineAlongAnAxisIsNoProblem) {
  Observations observations = MakeObservations();
  PencilObservation& pencil = observations.pencils[0];
  pencil.lines.resize(1);
  const std::vector<std::string> before = FitProblems(&observations);
  EXPECT_NE(before.back().find("two lines"), std::string::npos);
  pencil.direction = PencilDirection::kX;
  EXPECT_EQ(FitProblems(&observations).size(), before.size() - 1);
  EXPECT_TRUE(pencil.lines[0].fit.has_value());
  EXPECT_FALSE(pencil.fit.has_value());
}

TEST(FitObservations, NamesBadOptionsAndBadInput) {
  struct Case {
    const char* field;
    void (*spoil)(FitOptions*);
  };
  const Case cases[] = {
      {"inlier_threshold_px", [](FitOptions* o) { o->inlier_threshold_px = -1.0; }},
      {"inlier_threshold_px", [](FitOptions* o) { o->inlier_threshold_px = std::nan(""); }},
      {"confidence", [](FitOptions* o) { o->confidence = 1.0; }},
      {"max_iterations", [](FitOptions* o) { o->max_iterations = 0; }},
      {"sigma_px", [](FitOptions* o) { o->sigma_px = -1.0; }},
      {"direction_sigma_rad", [](FitOptions* o) { o->direction_sigma_rad = 0.0; }},
      {"line_px", [](FitOptions* o) { o->noise_model.line_px = -0.1; }},
  };
  Observations observations = MakeObservations();
  for (const Case& c : cases) {
    FitOptions options;
    c.spoil(&options);
    const Status status = FitObservations(options, &observations);
    EXPECT_EQ(status.code, StatusCode::kInvalidArgument) << c.field;
    EXPECT_NE(status.message.find(c.field), std::string::npos) << status.message;
    EXPECT_FALSE(observations.circles[0].fit.has_value());
  }
  observations.camera.fx = 0.0;
  EXPECT_EQ(FitObservations(FitOptions(), &observations).code, StatusCode::kInvalidArgument);
  observations = MakeObservations();
  observations.circles[0].points[0].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(FitObservations(FitOptions(), &observations).code, StatusCode::kInvalidArgument);
}

// Kerbs: lines towards (1100, -200) side by side; some, the first ones of the result, are turned
// about their middles, each by 12 to 20 standard deviations of its direction.
Observations MakeKerbs(std::uint64_t seed, int num_lines, int num_odd, int points, double sigma) {
  Random random(seed);
  Observations observations;
  observations.camera = TestCamera();
  observations.camera.distortion = {};
  PencilObservation pencil;
  pencil.id = "kerbs";
  // Inside the fan: of few lines, one at its edge and one at the other may both be the odd one.
  const int first_odd = 1 + random.UniformInt(num_lines - num_odd - 1);
  for (int i = 0; i < num_lines; ++i) {
    const bool is_odd = first_odd <= i && i < first_odd + num_odd;
    const double x = random.Uniform(80.0, 400.0), y = 60.0 + 360.0 * i / (num_lines - 1.0);
    const double half = random.Uniform(60.0, 120.0), turn = random.Uniform(12.0, 20.0);
    const double sense = random.Uniform() < 0.5 ? -1.0 : 1.0;
    const Eigen::Vector2d middle(x, y);
    Eigen::Vector2d along = (Eigen::Vector2d(1100.0, -200.0) - middle).normalized();
    // Of the direction of points that are evenly spread: sigma / (sqrt(n) their deviation).
    const double deviation = half * std::sqrt((points + 1.0) / (3.0 * (points - 1.0)));
    const double sigma_rad = sigma / (deviation * std::sqrt(static_cast<double>(points)));
    if (is_odd) along = Eigen::Rotation2Dd(sense * turn * sigma_rad) * along;
    LineObservation line;
    for (int k = 0; k < points; ++k) {
      const double nx = random.Normal(), ny = random.Normal();
      line.points.push_back(middle + (2.0 * k / (points - 1.0) - 1.0) * half * along +
                            sigma * Eigen::Vector2d(nx, ny));
    }
    pencil.lines.push_back(line);
  }
  std::rotate(pencil.lines.begin(), pencil.lines.begin() + first_odd, pencil.lines.end());
  observations.pencils.push_back(pencil);
  return observations;
}

TEST(FitObservations, LinesThatAreNotParallelAreOutliers) {
  struct Case {
    int num_lines, num_odd, points;
    bool stated;
  };
  // Segments of two points that state no noise tell an odd one from noise if there are many.
  const Case cases[] = {{5, 1, 2, true},   {5, 1, 20, true},  {5, 1, 20, false}, {10, 3, 2, true},
                        {10, 3, 20, true}, {10, 3, 2, false}, {10, 3, 20, false}};
  FitOptions options;
  options.noise_model = NoiseModel::Exact();
  const int trials = Trials(200);
  for (const Case& c : cases) {
    for (const double sigma : {0.2, 1.0}) {
      double odd = 0.0, good = 0.0;
      for (int trial = 0; trial < trials; ++trial) {
        Observations observations =
            MakeKerbs(static_cast<std::uint64_t>(trial), c.num_lines, c.num_odd, c.points, sigma);
        PencilObservation& pencil = observations.pencils[0];
        if (c.stated) pencil.sigma_px = sigma;
        const std::vector<std::string> problems = FitProblems(&observations, options);
        ASSERT_TRUE(pencil.fit);
        std::size_t flagged = 0;
        for (std::size_t i = 0; i < pencil.lines.size(); ++i) {
          if (pencil.lines[i].is_parallel) continue;
          ++flagged;
          (static_cast<int>(i) < c.num_odd ? odd : good) += 1.0 / trials;
        }
        EXPECT_EQ(problems.size(), flagged);
      }
      if (kSanitized) continue;
      EXPECT_GE(odd, 0.99 * c.num_odd) << c.num_lines << ' ' << c.points << c.stated << sigma;
      EXPECT_LE(good, 0.02 * (c.num_lines - c.num_odd)) << c.points << c.stated << sigma;
    }
  }
}

TEST(FitObservations, SegmentsTellTheirNoise) {
  FitOptions options;
  options.noise_model = NoiseModel::Exact();
  const int trials = Trials(200);
  for (const double sigma : {0.1, 0.5, 1.0, 2.0}) {
    int covered = 0;
    for (int trial = 0; trial < trials; ++trial) {
      Observations observations = MakeKerbs(static_cast<std::uint64_t>(trial), 12, 0, 2, sigma);
      ASSERT_TRUE(FitObservations(options, &observations).ok());
      const VanishingPointFit& fit = *observations.pencils[0].fit;
      CalibratedPoint truth;
      ASSERT_TRUE(PixelToCalibrated(observations.camera, {1100.0, -200.0}, &truth));
      Eigen::Vector3d direction = truth.Homogeneous().normalized();
      if (direction.dot(fit.direction) < 0.0) direction = -direction;
      covered += SquaredError(fit.covariance, fit.direction - direction, 2) < 5.99 ? 1 : 0;
    }
    if (kSanitized) continue;
    EXPECT_GE(covered, 0.88 * trials) << sigma;
    EXPECT_LE(covered, 0.995 * trials) << sigma;
  }
}

TEST(FitObservations, APencilWithoutLinesIsNamed) {
  Observations observations = MakeObservations();
  observations.pencils[0].lines.clear();
  const std::vector<std::string> problems = FitProblems(&observations);
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_NE(problems[0].find(observations.pencils[0].id), std::string::npos) << problems[0];
  EXPECT_FALSE(observations.pencils[0].fit.has_value());
}

TEST(FitObservations, NothingToFitIsOk) {
  Observations observations;
  observations.camera = TestCamera();
  EXPECT_TRUE(FitProblems(&observations).empty());
}

}  // namespace
}  // namespace circline
