#include "circline/ransac/fit_observations.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "circline/estimators/conic.h"
#include "circline/estimators/random.h"

namespace circline {
namespace {

Camera TestCamera() {
  Camera camera;
  camera.id = "cam";
  camera.model = CameraModel::kOpenCV;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 800.0;
  camera.cx = 320.0;
  camera.cy = 240.0;
  camera.distortion = {-0.2, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  return camera;
}

Eigen::Vector2d Pixel(double x, double y, Random* noise = nullptr, double sigma = 0.0) {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  EXPECT_TRUE(CameraToPixel(TestCamera(), {x, y, 1.0}, &pixel));
  if (noise != nullptr) {
    const double nx = noise->Normal(), ny = noise->Normal();
    pixel += sigma * Eigen::Vector2d(nx, ny);
  }
  return pixel;
}

// A circle with one stray point in four and one pixel no camera sees, and a pencil of five lines,
// of which one is stray and one has a stray point.
Observations MakeObservations() {
  Observations observations;
  observations.camera = TestCamera();
  Random random(1);
  CircleObservation circle;
  circle.id = "c0";
  circle.sigma_px = 0.3;
  for (int i = 0; i < 60; ++i) {
    const double t = 0.1 * i;
    const bool stray = i % 4 == 3;
    circle.points.push_back(
        stray ? Pixel(random.Uniform(-0.2, 0.2), random.Uniform(-0.2, 0.2))
              : Pixel(0.05 + 0.1 * std::cos(t), 0.07 * std::sin(t), &random, 0.3));
  }
  circle.points.emplace_back(1e12, 1e12);
  observations.circles.push_back(circle);
  PencilObservation pencil;
  pencil.id = "L1";
  pencil.sigma_px = 0.3;
  const Eigen::Vector2d vanishing_point(0.9, 0.2);
  for (int i = 0; i < 5; ++i) {
    const Eigen::Vector2d from(-0.3, -0.2 + 0.1 * i);
    const Eigen::Vector2d to =
        i == 3 ? Eigen::Vector2d(0.1, -0.25) : Eigen::Vector2d(0.6 * from + 0.4 * vanishing_point);
    LineObservation line;
    for (int k = 0; k <= 6; ++k) {
      const Eigen::Vector2d x = from + (to - from) * k / 6.0;
      line.points.push_back(Pixel(x.x(), x.y(), &random, 0.3));
    }
    if (i == 1) line.points[3].y() += 20.0;
    if (i == 2) line.points = {line.points.front(), line.points.back()};
    pencil.lines.push_back(line);
  }
  observations.pencils.push_back(pencil);
  return observations;
}

TEST(FitObservations, FillsEveryFit) {
  Observations observations = MakeObservations();
  std::vector<std::string> problems;
  ASSERT_TRUE(FitObservations(FitOptions(), &observations, &problems).ok());

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
  std::vector<std::string> problems;
  ASSERT_TRUE(FitObservations(FitOptions(), &observations, &problems).ok());
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

TEST(FitObservations, ASingleLineAlongAnAxisIsNoProblem) {
  Observations observations = MakeObservations();
  PencilObservation& pencil = observations.pencils[0];
  pencil.lines.resize(1);
  std::vector<std::string> problems;
  ASSERT_TRUE(FitObservations(FitOptions(), &observations, &problems).ok());
  EXPECT_NE(problems.back().find("two lines"), std::string::npos);
  pencil.direction = PencilDirection::kX;
  const std::size_t before = problems.size();
  problems.clear();
  ASSERT_TRUE(FitObservations(FitOptions(), &observations, &problems).ok());
  EXPECT_EQ(problems.size(), before - 1);
  EXPECT_TRUE(pencil.lines[0].fit.has_value());
  EXPECT_FALSE(pencil.fit.has_value());
}

TEST(FitObservations, NamesBadOptionsAndBadInput) {
  struct Case {
    const char* field;
    void (*spoil)(FitOptions*);
  };
  const Case cases[] = {
      {"inlier_threshold_px", [](FitOptions* o) { o->inlier_threshold_px = 0.0; }},
      {"inlier_threshold_px", [](FitOptions* o) { o->inlier_threshold_px = std::nan(""); }},
      {"confidence", [](FitOptions* o) { o->confidence = 1.0; }},
      {"max_iterations", [](FitOptions* o) { o->max_iterations = 0; }},
      {"sigma_px", [](FitOptions* o) { o->sigma_px = -1.0; }},
      {"direction_sigma_rad", [](FitOptions* o) { o->direction_sigma_rad = 0.0; }},
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

TEST(FitObservations, NothingToFitIsOk) {
  Observations observations;
  observations.camera = TestCamera();
  std::vector<std::string> problems;
  EXPECT_TRUE(FitObservations(FitOptions(), &observations, &problems).ok());
  EXPECT_TRUE(problems.empty());
}

}  // namespace
}  // namespace circline
