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
#include "tests/trials.h"

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
  std::vector<std::string> problems;
  ASSERT_TRUE(FitObservations(FitOptions(), &observations, &problems).ok());
  ASSERT_EQ(problems.size(), 4u);
  EXPECT_NE(problems[0].find("circle 'corner'"), std::string::npos);
  EXPECT_EQ(observations.num_dropped_points, 60);
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

// A contour and a line of 100 points each, one stray point in ten within 40 px, and their inliers.
struct NoisyScene {
  Observations observations;
  std::vector<CalibratedPoint> exact_contour, exact_line;
  std::vector<std::uint8_t> is_good = std::vector<std::uint8_t>(100, 1);

  NoisyScene(std::uint64_t seed, double sigma) {
    Random random(seed);
    const double start = random.Uniform(0.0, 6.28);
    observations.camera = TestCamera();
    CircleObservation circle;
    LineObservation line;
    std::vector<Eigen::Vector2d> contour, points;
    for (std::size_t i = 0; i < 100; ++i) {
      const double t = 0.01 * static_cast<double>(i), a = start + 6.28 * t;
      is_good[i] = i % 10 == 3 ? 0 : 1;
      contour.push_back(Pixel(0.05 + 0.15 * std::cos(a), 0.09 * std::sin(a)));
      points.push_back(Pixel(0.6 * t - 0.3, 0.2 * t - 0.2));
      for (const auto& [exact, noisy] :
           {std::pair(contour.back(), &circle.points), std::pair(points.back(), &line.points)}) {
        const double x = random.Normal(), y = random.Normal();
        const double far_x = random.Uniform(-40.0, 40.0), far_y = random.Uniform(-40.0, 40.0);
        const Eigen::Vector2d stray(far_x, far_y), noise(sigma * x, sigma * y);
        noisy->push_back(exact + (is_good[i] != 0 ? noise : stray));
      }
    }
    PixelsToCalibrated(observations.camera, contour, &exact_contour);
    PixelsToCalibrated(observations.camera, points, &exact_line);
    observations.circles.push_back(circle);
    PencilObservation pencil;
    pencil.direction = PencilDirection::kX;
    pencil.lines.push_back(line);
    observations.pencils.push_back(pencil);
  }
};

// Squared error in standard deviations, in the `rank` directions of a covariance that has them.
double SquaredError(const Eigen::MatrixXd& covariance, const Eigen::VectorXd& error, int rank) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
  const Eigen::VectorXd along = eigen.eigenvectors().transpose() * error;
  return (along.array().square() / eigen.eigenvalues().array()).tail(rank).sum();
}

TEST(FitObservations, MasksAndCovariancesAreRightAtAnyNoiseStatedOrNot) {
  FitOptions options;
  options.noise_model = NoiseModel::Exact();
  const int trials = Trials(200);
  for (const bool stated : {true, false}) {
    for (const double sigma : {0.1, 0.5, 1.0, 2.0}) {
      int conics = 0, lines = 0, inliers = 0;
      double conic_rms = 0.0, line_rms = 0.0;
      for (int trial = 0; trial < trials; ++trial) {
        NoisyScene scene(static_cast<std::uint64_t>(trial), sigma);
        CircleObservation& circle = scene.observations.circles[0];
        PencilObservation& pencil = scene.observations.pencils[0];
        if (stated) circle.sigma_px = pencil.sigma_px = sigma;
        ASSERT_TRUE(FitObservations(options, &scene.observations).ok());
        ASSERT_TRUE(circle.fit && pencil.lines[0].fit);
        ConicFit conic;
        LineFit line;
        ASSERT_TRUE(FitConic(scene.exact_contour, 1.0, &conic).ok());
        ASSERT_TRUE(FitLine(scene.exact_line, 1.0, &line).ok());
        const Vector6d error = ConicToVector(circle.fit->conic) - ConicToVector(conic.conic);
        const Eigen::Vector3d found = pencil.lines[0].fit->line;
        const Eigen::Vector3d truth = found.dot(line.line) < 0.0 ? -line.line : line.line;
        conics += SquaredError(circle.fit->Covariance(), error, 5) < 11.07 ? 1 : 0;  // 95 %.
        lines += SquaredError(pencil.lines[0].fit->covariance, found - truth, 2) < 5.99 ? 1 : 0;
        conic_rms += circle.fit->rms_px / (trials * sigma);
        line_rms += pencil.lines[0].fit->rms_px / (trials * sigma);
        for (std::size_t i = 0; i < 100; ++i) {
          inliers += scene.is_good[i] & circle.inliers[i];
          inliers += scene.is_good[i] & pencil.lines[0].inliers[i];
        }
      }
      if (kSanitized) continue;
      EXPECT_GE(conics, 0.9 * trials) << sigma << stated;
      EXPECT_LE(conics, 0.99 * trials) << sigma << stated;
      EXPECT_GE(lines, 0.9 * trials) << sigma << stated;
      EXPECT_LE(lines, 0.99 * trials) << sigma << stated;
      EXPECT_NEAR(conic_rms, 0.97, 0.04) << sigma << stated;
      EXPECT_NEAR(line_rms, 0.98, 0.04) << sigma << stated;
      EXPECT_NEAR(inliers / (180.0 * trials), 0.998, 0.003) << sigma << stated;
    }
  }
}

// Few points of a contour, twice as noisy as is thought at first: an ellipse through five or six of
// them is not the last word once the lines have told the noise.
TEST(FitObservations, AContourOfFewNoisyPointsIsNotJudgedByAFewOfThem) {
  constexpr double kSigma = 2.0;
  constexpr int kPoints = 14, kLines = 4, kLinePoints = 40;
  const int trials = Trials(300);
  int few = 0;
  for (int trial = 0; trial < trials; ++trial) {
    Random random(static_cast<std::uint64_t>(trial));
    Observations observations;
    observations.camera = TestCamera();
    CircleObservation circle;
    circle.id = "c0";
    for (int i = 0; i < kPoints; ++i) {
      const double t = 3.5 * i / kPoints;  // 200 degrees of it.
      circle.points.push_back(Pixel(0.25 * std::cos(t), 0.2 * std::sin(t), &random, kSigma));
    }
    observations.circles.push_back(circle);
    PencilObservation pencil;
    pencil.id = "L1";
    for (int i = 0; i < kLines; ++i) {
      LineObservation line;
      for (int k = 0; k < kLinePoints; ++k)
        line.points.push_back(Pixel(-0.3 + 0.6 * k / kLinePoints, 0.1 * i - 0.15, &random, kSigma));
      pencil.lines.push_back(line);
    }
    observations.pencils.push_back(pencil);
    ASSERT_TRUE(FitObservations(FitOptions(), &observations).ok());
    const std::vector<std::uint8_t>& inliers = observations.circles[0].inliers;
    few += 2 * std::count(inliers.begin(), inliers.end(), 1) < kPoints ? 1 : 0;
  }
  if (kSanitized) return;
  EXPECT_LE(few, 0.01 * trials);
}

// A manhole's rim and, over 40 % of it, that of its frame.
TEST(FitObservations, ASecondRimIsASecondReadingAndNamed) {
  Random random(5);
  Observations observations;
  observations.camera = TestCamera();
  CircleObservation circle;
  circle.id = "cover";
  for (int i = 0; i < 140; ++i) {
    const double t = 0.0628 * i, scale = i < 100 ? 1.0 : 1.15;
    const double x = random.Normal(), y = random.Normal();
    circle.points.emplace_back(
        Pixel(0.05 + 0.15 * scale * std::cos(t), 0.09 * scale * std::sin(t)) +
        0.5 * Eigen::Vector2d(x, y));
  }
  observations.circles = {circle};
  std::vector<std::string> problems;
  ASSERT_TRUE(FitObservations(FitOptions(), &observations, &problems).ok());
  const CircleObservation& fitted = observations.circles[0];
  ASSERT_TRUE(fitted.fit && fitted.second);
  EXPECT_NEAR(static_cast<double>(std::count(fitted.inliers.begin(), fitted.inliers.end(), 1)),
              100.0, 2.0);
  const std::vector<std::uint8_t>& others = fitted.second->inliers;
  EXPECT_NEAR(static_cast<double>(std::count(others.begin() + 100, others.end(), 1)), 40.0, 2.0);
  EXPECT_LE(std::count(others.begin(), others.begin() + 100, 1), 2);
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_NE(problems[0].find("circle 'cover': a second ellipse"), std::string::npos) << problems[0];
}

TEST(FitObservations, ACapIsKept) {
  NoisyScene scene(1, 2.0);
  FitOptions options;
  options.inlier_threshold_px = 1.5;
  CircleObservation& circle = scene.observations.circles[0];
  circle.sigma_px = 2.0;
  ASSERT_TRUE(FitObservations(options, &scene.observations).ok());
  EXPECT_LT(std::count(circle.inliers.begin(), circle.inliers.end(), 1), 70);
  ASSERT_TRUE(FitObservations(FitOptions(), &scene.observations).ok());
  EXPECT_GT(std::count(circle.inliers.begin(), circle.inliers.end(), 1), 87);
}

TEST(FitObservations, SharedErrorsAreInTheCovariances) {
  NoisyScene exact(1, 0.3), photo(1, 0.3);
  for (NoisyScene* scene : {&exact, &photo}) {
    scene->observations.circles[0].sigma_px = scene->observations.pencils[0].sigma_px = 0.3;
  }
  FitOptions options;
  options.noise_model.contour_px = 0.2;
  options.noise_model.correlation_px = 100.0;
  ASSERT_TRUE(FitObservations(options, &photo.observations).ok());
  options.noise_model = NoiseModel::Exact();
  ASSERT_TRUE(FitObservations(options, &exact.observations).ok());
  // 90 points on 620 px: 14 that share 0.2 px, beside 0.3 px of each.
  EXPECT_NEAR(photo.observations.circles[0].fit->Covariance().trace() /
                  exact.observations.circles[0].fit->Covariance().trace(),
              1.0 + 90.0 / 6.2 * 0.04 / 0.09, 0.5);
  EXPECT_GT(photo.observations.pencils[0].lines[0].fit->covariance.trace(),
            exact.observations.pencils[0].lines[0].fit->covariance.trace());
  Observations direct = exact.observations;
  direct.circles[0].fit.reset();
  FitDirect(1.0, &direct, nullptr, options.noise_model);
  const double points_alone = direct.circles[0].fit->Covariance().trace();
  direct.circles[0].fit.reset();
  options.noise_model.contour_px = 0.2;
  FitDirect(1.0, &direct, nullptr, options.noise_model);
  EXPECT_GT(direct.circles[0].fit->Covariance().trace(), 2.0 * points_alone);
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
        std::vector<std::string> problems;
        ASSERT_TRUE(FitObservations(options, &observations, &problems).ok());
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
  std::vector<std::string> problems;
  ASSERT_TRUE(FitObservations(FitOptions(), &observations, &problems).ok());
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_NE(problems[0].find(observations.pencils[0].id), std::string::npos) << problems[0];
  EXPECT_FALSE(observations.pencils[0].fit.has_value());
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
