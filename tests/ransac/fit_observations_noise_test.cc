// FitObservations under noise, stated or not, errors that neighbours share, and clutter alone.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/random.h"
#include "circline/ransac/fit_observations.h"
#include "tests/basics.h"
#include "tests/ransac/stray_points_scene.h"
#include "tests/trials.h"

namespace circline {
namespace {

using stray_points_scene::FitProblems;
using stray_points_scene::Pixel;
using stray_points_scene::SquaredError;
using stray_points_scene::TestCamera;

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

TEST(FitObservationsNoise, MasksAndCovariancesAreRightAtAnyNoiseStatedOrNot) {
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

// Of scattered points some lie near some ellipse. Refused, or named where it has all of them.
TEST(FitObservationsNoise, FindsNoEllipseInClutter) {
  const int trials = Trials(50);
  for (const double stated_px : {0.0, 0.5}) {
    for (const double width_px : {30.0, 300.0}) {
      for (const int num_points : {12, 50, 200}) {
        int fits = 0, silent = 0;
        for (int trial = 0; trial < trials; ++trial) {
          Random random(static_cast<std::uint64_t>(trial));
          Observations observations;
          observations.camera = TestCamera();
          CircleObservation circle;
          circle.id = "clutter";
          circle.sigma_px = stated_px;
          for (int i = 0; i < num_points; ++i) {
            const double x = random.Uniform(), y = random.Uniform();
            circle.points.emplace_back(320.0 + width_px * x, 240.0 + 0.75 * width_px * y);
          }
          observations.circles.push_back(circle);
          const std::vector<std::string> problems = FitProblems(&observations);
          fits += observations.circles[0].fit.has_value() ? 1 : 0;
          silent += problems.empty() ? 1 : 0;
          for (const std::string& problem : problems) EXPECT_CONTAINS(problem, "'clutter'");
        }
        if (kSanitized) continue;
        EXPECT_LE(silent, 0.02 * trials) << stated_px << ' ' << width_px << ' ' << num_points;
        if (width_px > 100.0) {
          EXPECT_LE(fits, 0.04 * trials) << stated_px << ' ' << num_points;
        }
      }
    }
  }
}

// Few points of a contour, twice as noisy as is thought at first: an ellipse through five or six of
// them is not the last word once the lines have told the noise.
TEST(FitObservationsNoise, AContourOfFewNoisyPointsIsNotJudgedByAFewOfThem) {
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

// It is told from points that have no ellipse: by how much it is too small, and what to do.
TEST(FitObservationsNoise, AStatedNoiseThatIsFarTooSmallIsNamed) {
  for (const double stated_px : {0.01, 0.05, 0.5}) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      Random random(seed);
      Observations observations;
      observations.camera = TestCamera();
      CircleObservation circle;
      circle.id = "c0";
      circle.sigma_px = stated_px;
      for (int i = 0; i < 100; ++i) {
        const double t = 2.0 * kPi * i / 100;
        circle.points.push_back(Pixel(0.25 * std::cos(t), 0.2 * std::sin(t), &random, 0.5));
      }
      observations.circles.push_back(circle);
      const std::vector<std::string> problems = FitProblems(&observations);
      if (stated_px == 0.5) {
        EXPECT_TRUE(problems.empty()) << problems[0];
        continue;
      }
      ASSERT_FALSE(problems.empty()) << stated_px << ' ' << seed;
      EXPECT_CONTAINS(problems[0], "state none, or a larger one");
    }
  }
}

TEST(FitObservationsNoise, AStatedNoiseThatIsFarTooSmallForLinesIsNamed) {
  for (const double stated_px : {0.01, 0.05, 0.5}) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      Random random(seed);
      Observations observations;
      observations.camera = TestCamera();
      PencilObservation pencil;
      pencil.id = "L1";
      pencil.sigma_px = stated_px;
      for (int i = 0; i < 5; ++i) {
        LineObservation line;
        for (int k = 0; k < 50; ++k)
          line.points.push_back(Pixel(-0.3 + 0.012 * k, 0.1 * i - 0.15, &random, 0.5));
        pencil.lines.push_back(line);
      }
      observations.pencils.push_back(pencil);
      const std::vector<std::string> problems = FitProblems(&observations);
      const auto is_named =
          std::count_if(problems.begin(), problems.end(), [](const std::string& problem) {
            return problem.find("pencil 'L1': its points lie") == 0;
          });
      EXPECT_EQ(is_named, stated_px < 0.1 ? 1 : 0) << stated_px << ' ' << seed;
    }
  }
}

TEST(FitObservationsNoise, WithoutPointsNoStatedNoiseIsDoubted) {
  Observations observations;
  observations.camera = TestCamera();
  observations.circles.resize(1);
  observations.circles[0].sigma_px = 0.05;
  observations.pencils.resize(1);
  observations.pencils[0].sigma_px = 0.05;
  observations.pencils[0].lines.resize(2);
  const std::vector<std::string> problems = FitProblems(&observations);
  EXPECT_FALSE(problems.empty());  // That there is nothing to fit.
  for (const std::string& problem : problems)
    EXPECT_EQ(problem.find("stated as their noise"), std::string::npos) << problem;
}

// A manhole's rim and, over 40 % of it, that of its frame.
TEST(FitObservationsNoise, ASecondRimIsASecondReadingAndNamed) {
  Random random(5);
  Observations observations;
  observations.camera = TestCamera();
  CircleObservation circle;
  circle.id = "cover";
  for (int i = 0; i < 140; ++i) {
    const double t = 0.0628 * i, scale = i < 100 ? 1.0 : 1.15;
    circle.points.emplace_back(
        Pixel(0.05 + 0.15 * scale * std::cos(t), 0.09 * scale * std::sin(t)) +
        Noise2(0.5, &random));
  }
  observations.circles = {circle};
  const std::vector<std::string> problems = FitProblems(&observations);
  const CircleObservation& fitted = observations.circles[0];
  ASSERT_TRUE(fitted.fit && fitted.second);
  EXPECT_NEAR(static_cast<double>(std::count(fitted.inliers.begin(), fitted.inliers.end(), 1)),
              100.0, 2.0);
  const std::vector<std::uint8_t>& others = fitted.second->inliers;
  EXPECT_NEAR(static_cast<double>(std::count(others.begin() + 100, others.end(), 1)), 40.0, 2.0);
  EXPECT_LE(std::count(others.begin(), others.begin() + 100, 1), 2);
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_CONTAINS(problems[0], "circle 'cover': a second ellipse");
}

TEST(FitObservationsNoise, ACapIsKept) {
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

TEST(FitObservationsNoise, SharedErrorsAreInTheCovariances) {
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

// A robust fit tells how irregular a contour is as a direct one does.
TEST(FitObservationsNoise, AnIrregularContourIsToldFromARegularOne) {
  std::vector<double> irregularity;
  for (const double wave_px : {0.0, 0.4}) {
    Random random(5);
    Observations observations;
    observations.camera = TestCamera();
    observations.circles.resize(1);
    for (int i = 0; i < 400; ++i) {
      const double t = 2.0 * kPi * i / 400;
      const double r = 200.0 + wave_px * std::sin(9.0 * t) + 0.05 * random.Normal();
      observations.circles[0].points.emplace_back(320.0 + r * std::cos(t),
                                                  240.0 + 0.7 * r * std::sin(t));
    }
    Observations direct = observations;
    FitDirect(0.05, &direct, nullptr, FitOptions().noise_model);
    ASSERT_TRUE(FitObservations(FitOptions(), &observations).ok());
    irregularity.push_back(observations.circles[0].fit->irregularity);
    EXPECT_NEAR(irregularity.back(), direct.circles[0].fit->irregularity, 0.1) << wave_px;
  }
  EXPECT_GT(irregularity[1], 2.0 * irregularity[0]);
}

}  // namespace
}  // namespace circline
