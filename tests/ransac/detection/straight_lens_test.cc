#include "circline/ransac/detection/structure/straight_lens.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/basics.h"
#include "tests/ransac/detection/detected_line_scene.h"
#include "tests/ransac/detection/detection_test_util.h"
#include "tests/ransac/detection/observations_test_util.h"

namespace circline {
namespace {

using detection_test::LookAt;
using detection_test::TestCamera;

constexpr double kLenses[] = {-0.4, -0.2, 0.0, 0.1};

Camera Lens(double k1, double focal_factor = 1.0) {
  Camera camera = TestCamera();
  camera.model = CameraModel::kOpenCV;
  camera.distortion[0] = k1;
  SetFocal(std::log(focal_factor), CameraSigma(), &camera);
  return camera;
}

NoiseModel NothingKnown() {
  NoiseModel noise;
  noise.camera.log_focal = 0.5;
  noise.camera.k1 = 0.3;
  return noise;
}

// The k1 of the same bends at the true focal length.
double AtTrueFocal(double k1, const Camera& camera) {
  return k1 * std::pow(TestCamera().fx / camera.fx, 2.0);
}

// What a detection through `guess` makes of a curve through the scene, `bend` of its length away
// from straight.
DetectedLine CurveSeen(const Camera& lens, const Camera& guess, double bend, Random* random) {
  const Eigen::Vector2d pixel{random->Uniform(90.0, 390.0), random->Uniform(70.0, 290.0)};
  CalibratedPoint middle;
  EXPECT_TRUE(PixelToCalibrated(lens, pixel, &middle));
  const double angle = random->Uniform(0.0, kPi);
  const Eigen::Vector2d along(std::cos(angle), std::sin(angle)), across(-along.y(), along.x());
  DetectedLine line;
  for (int k = -10; k <= 10; ++k) {
    const double u = 0.1 * k, half = 0.16;
    const Eigen::Vector2d x = middle.x + half * (u * along + 2.0 * bend * (1.0 - u * u) * across);
    Eigen::Vector2d seen;
    EXPECT_TRUE(CameraToPixel(lens, x.homogeneous(), &seen));
    line.points.push_back(seen + Noise2(0.1, random));
  }
  line.ends = {line.points.front(), line.points.back()};
  line.length_px = (line.ends[1] - line.ends[0]).norm();
  line.sigma_px = 0.1;
  std::vector<CalibratedPoint> points;
  PixelsToCalibrated(guess, line.points, &points);
  EXPECT_TRUE(FitLine(points, line.sigma_px, &line.fit).ok());
  return line;
}

// Whatever the guess of the focal length, with as many curves as lines.
TEST(LikeliestLens, LinesAreStraightThroughIt) {
  for (const double k1 : kLenses) {
    for (const double factor : {0.7, 1.0, 1.4}) {
      Camera guess = Lens(0.0, factor);
      Random random(5);
      PhotoEvidence evidence;
      for (int k = 0; k < 120; ++k) {
        const double bend = k % 2 == 0 ? 0.0 : random.Uniform(-0.008, 0.008);
        evidence.lines.push_back(CurveSeen(Lens(k1), guess, bend, &random));
      }
      LikelyLens likeliest;
      for (int look = 0; look < 3; ++look) {
        likeliest = LikeliestLens(evidence, guess, NothingKnown(), 0.0);
        guess.distortion[0] = likeliest.k1;
      }
      EXPECT_NEAR(AtTrueFocal(likeliest.k1, guess), k1, 0.03) << k1 << " " << factor;
      if (k1 < 0.0) {
        EXPECT_GT(likeliest.gain, 3.0) << k1 << " " << factor;
      }
    }
  }
}

TEST(LikeliestLens, NothingLeavesThePrior) {
  const LikelyLens likeliest = LikeliestLens(PhotoEvidence(), Lens(-0.1), NothingKnown(), 0.02);
  EXPECT_EQ(likeliest.k1, 0.02);
  EXPECT_EQ(likeliest.gain, 0.0);
}

TEST(SetFocal, AnOpenLensBendsWhatItBends) {
  Camera open = Lens(-0.2), known = Lens(-0.2);
  SetFocal(std::log(1.5), NothingKnown().camera, &open);
  SetFocal(std::log(1.5), CameraSigma(), &known);
  EXPECT_NEAR(open.distortion[0], -0.45, 1e-12);
  EXPECT_EQ(known.distortion[0], -0.2);
  EXPECT_NEAR(open.fx, 1.5 * TestCamera().fx, 1e-9);
}

// A chessboard, all of a photo: the lens that bends it and the focal length, of neither of which
// anything is known.
TEST(DetectObservations, FindsTheLensOfAChessboard) {
  const CameraPose pose = LookAt(35.0, 25.0, 10.0, 9.0);
  const auto squares = [](double x, double y) {
    const bool is_board = std::abs(x) < 2.5 && std::abs(y) < 2.0;
    const int parity = static_cast<int>(std::floor(2.0 * x) + std::floor(2.0 * y));
    return is_board && parity % 2 == 0 ? 30.0 : 220.0;
  };
  for (const double k1 : kLenses) {
    const Camera lens = Lens(k1);
    const cv::Mat image =
        detection_test::Develop(detection_test::RenderPlane(lens, pose, 220.0, squares), 0.7, 2.0);
    DetectionOptions options;
    options.noise_model = NothingKnown();
    const Camera guess = Lens(0.0, 1.3);
    const Observations found = detection_test::Detect(image, guess, options);
    // That of 0.1 moves the corners by 4 %: for the estimate to find.
    const double expected = k1 == 0.1 ? 0.0 : k1;
    EXPECT_NEAR(AtTrueFocal(found.camera.distortion[0], found.camera), expected, 0.04) << k1;
    EXPECT_EQ(found.found_k1, found.camera.distortion[0]) << k1;
    EXPECT_NEAR(std::log(found.camera.fx / lens.fx), 0.0, 0.1) << k1;
    Eigen::Vector3d x, y;
    ASSERT_TRUE(detection_test::Axes(found, &x, &y)) << k1;
    // What is known of a lens stays.
    options.noise_model.camera.k1 = 0.001;
    const Observations known = detection_test::Detect(image, lens, options);
    EXPECT_EQ(known.camera.distortion, lens.distortion) << k1;
    EXPECT_EQ(known.found_k1, 0.0) << k1;
  }
}

}  // namespace
}  // namespace circline
