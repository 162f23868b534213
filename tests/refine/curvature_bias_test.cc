#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/random.h"
#include "circline/refine/image_points.h"
#include "tests/trials.h"

namespace circline {
namespace {

// Noise of both coordinates leads out of an ellipse where it bends; what is moved back lies on it,
// on average.
TEST(CurvatureBiasTest, PointsLieOnTheEllipseOnAverage) {
  Camera camera;
  camera.fx = camera.fy = 1000.0;
  constexpr double kLong = 25.0, kShort = 15.0, kSigma = 2.0;  // Pixels.
  const double a = kLong / camera.fx, b = kShort / camera.fy;
  const Eigen::Matrix3d conic = Eigen::Vector3d(1.0 / (a * a), 1.0 / (b * b), -1.0).asDiagonal();
  Random random(1);
  for (const double angle : {0.0, 0.4, kPi / 2.0, 2.5}) {
    const double c = std::cos(angle), s = std::sin(angle);
    std::vector<Eigen::Vector2d> pixels;
    for (int i = 0; i < Trials(40000); ++i) {
      const double dx = random.Normal(), dy = random.Normal();
      pixels.emplace_back(kLong * c + kSigma * dx, kShort * s + kSigma * dy);
    }
    ImagePoints::Options options;
    options.distance = ConicDistanceType::kOrthogonal;
    ImagePoints points(camera, pixels, {}, options);
    const auto mean = [&] {
      std::vector<double> distances;
      points.ConicDistances(conic, 0.0, nullptr, &distances);
      double sum = 0.0;
      for (const double d : distances) sum += d;
      return sum / static_cast<double>(distances.size());
    };
    const double speed = std::hypot(kLong * s, kShort * c);
    const double bias = 0.5 * kSigma * kSigma * kLong * kShort / (speed * speed * speed);
    const double before = mean();
    points.RemoveCurvatureBias(conic, kSigma);
    const double after = mean();
    if (kSanitized) continue;
    constexpr double kMeanError = 0.03;  // Three standard deviations of a mean.
    EXPECT_NEAR(before, bias, 0.1 * bias + kMeanError) << angle;
    EXPECT_NEAR(after, 0.0, 0.1 * bias + kMeanError) << angle;
  }
}

}  // namespace
}  // namespace circline
