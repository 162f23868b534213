// Two pencils of parallel lines: the refined rotation against its Cramer-Rao bound, with the angle
// between them known exactly, roughly, or not at all; and that nothing diverges,
// corridors included. CIRCLINE_PENCIL_SCENES sets the number of scenes for the latter.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/random.h"
#include "circline/refine/estimate_pose.h"
#include "tests/pinhole_camera.h"
#include "tests/refine/simulated_options.h"
#include "tests/trials.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kNoisePx = 1.0;

enum class Angle { kHard, kSoft, kAbsent };

// Two pencils in a plane: segments with exact end points.
struct Scene {
  Camera camera;
  Matrix3d rotation;                             // cam_from_world.
  std::array<Vector3d, 2> directions;            // Camera frame; the first is X.
  std::array<std::vector<Segment>, 2> segments;  // Exact pixels, along X and along Y.
};

bool InPhoto(const Camera& camera, const Vector3d& X, Vector2d* pixel) {
  return CameraToPixel(camera, X, pixel) && pixel->x() >= 0.0 && pixel->y() >= 0.0 &&
         pixel->x() < camera.width && pixel->y() < camera.height;
}

// A segment of the given direction somewhere in the photo, 40 px long or more; `extent`: of the
// scene, in units of its distance.
Segment RandomSegment(const Camera& camera, const Matrix3d& R, const Vector3d& center,
                      const Vector3d& direction, double extent, Random* random) {
  for (;;) {
    const double x = random->Uniform(-extent, extent), y = random->Uniform(-extent, extent);
    const Vector3d from = center + R.col(0) * x + R.col(1) * y;
    const Vector3d to = from + random->Uniform(0.1, extent) * direction;
    Segment s;
    if (InPhoto(camera, from, &s[0]) && InPhoto(camera, to, &s[1]) && (s[1] - s[0]).norm() > 40.0) {
      return s;
    }
  }
}

// A tilted plane, or where `corridor` one that is seen nearly edge-on, along the X axis.
Scene RandomScene(int lines, double angle, bool corridor, Random* random) {
  Scene scene;
  scene.camera = PinholeCamera();
  const double tilt =
      (corridor ? random->Uniform(80.0, 87.0) : random->Uniform(20.0, 65.0)) * kDegree;
  const double spin =
      corridor ? random->Uniform(-5.0, 5.0) * kDegree : random->Uniform(0.0, 360.0) * kDegree;
  const double roll = random->Uniform(-0.3, 0.3);
  scene.rotation = ExpRotation({0.0, 0.0, roll}) * ExpRotation({tilt, 0.0, 0.0}) *
                   Vector3d(1.0, -1.0, -1.0).asDiagonal() *
                   ExpRotation({0.0, 0.0, spin + (corridor ? 90.0 * kDegree : 0.0)});
  scene.directions = {scene.rotation.col(0), std::cos(angle) * scene.rotation.col(0) +
                                                 std::sin(angle) * scene.rotation.col(1)};
  const Vector3d center{random->Uniform(-0.1, 0.1), random->Uniform(-0.1, 0.1), 1.0};
  for (std::size_t k = 0; k < 2; ++k) {
    for (int i = 0; i < lines; ++i) {
      scene.segments[k].push_back(
          RandomSegment(scene.camera, scene.rotation, center, scene.directions[k], 0.5, random));
    }
  }
  return scene;
}

Observations Observe(const Scene& scene, Angle angle, double angle_sigma, Random* random) {
  Observations observations;
  observations.camera = scene.camera;
  const char* const ids[] = {"L1", "L2"};
  for (std::size_t k = 0; k < 2; ++k) {
    PencilObservation pencil;
    pencil.id = ids[k];
    pencil.plane = "p0";
    pencil.sigma_px = kNoisePx;
    pencil.direction = k == 0                  ? PencilDirection::kX
                       : angle == Angle::kHard ? PencilDirection::kY
                                               : PencilDirection::kFree;
    for (const Segment& s : scene.segments[k]) {
      LineObservation line;
      for (const Vector2d& p : s) {
        const double dx = random->Normal(), dy = random->Normal();
        line.points.emplace_back(p + kNoisePx * Vector2d(dx, dy));
      }
      pencil.lines.push_back(line);
    }
    observations.pencils.push_back(pencil);
  }
  if (angle == Angle::kSoft) {
    observations.known_angles = {{{"L1", "L2"}, 90.0 * kDegree, angle_sigma}};
  }
  return observations;
}

// The exact interpretation planes and what end points say of them.
std::vector<LineFit> ExactLines(const Scene& scene, std::size_t pencil) {
  std::vector<LineFit> lines;
  for (const Segment& s : scene.segments[pencil]) {
    std::vector<CalibratedPoint> points;
    PixelsToCalibrated(scene.camera, {s[0], s[1]}, &points);
    LineFit fit;
    EXPECT_TRUE(FitLine(points, kNoisePx, &fit).ok());
    lines.push_back(fit);
  }
  return lines;
}

// Covariance of the rotation. A line with normal n along d says that n . d = 0, with the variance
// d^T Cov(n) d; its own angle about d is a nuisance that drops out. Unknown: the rotation, and the
// in-plane angle of the second pencil with the variance that is known of it beforehand.
Matrix3d Bound(const Scene& scene, Angle angle, double angle_sigma) {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  for (std::size_t k = 0; k < 2; ++k) {
    const Vector3d d = scene.directions[k];
    for (const LineFit& line : ExactLines(scene, k)) {
      Eigen::Vector4d j;
      j.head<3>() = d.cross(line.line);
      j[3] = k == 1 ? line.line.dot(scene.rotation.col(2).cross(d)) : 0.0;
      information += j * j.transpose() / d.dot(line.covariance * d);
    }
  }
  if (angle == Angle::kHard) return information.topLeftCorner<3, 3>().inverse();
  if (angle == Angle::kSoft) information(3, 3) += 1.0 / (angle_sigma * angle_sigma);
  return information.inverse().topLeftCorner<3, 3>();
}

// Lines alone do not tell the senses of the axes.
Vector3d RotationError(const Matrix3d& estimate, const Matrix3d& truth) {
  Vector3d best = Vector3d::Constant(10.0);
  for (const Vector3d& signs :
       {Vector3d(1, 1, 1), Vector3d(1, -1, -1), Vector3d(-1, 1, -1), Vector3d(-1, -1, 1)}) {
    const Vector3d error = LogRotation(truth * signs.asDiagonal() * estimate.transpose());
    if (error.norm() < best.norm()) best = error;
  }
  return best;
}

class PencilsTest : public ::testing::TestWithParam<std::tuple<int, Angle>> {};

TEST_P(PencilsTest, RotationSitsOnItsBound) {
  const auto [lines, angle] = GetParam();
  constexpr double kAngleSigma = 0.6 * kDegree;  // How far real buildings are off.
  constexpr int kTrials = Trials(1500);
  constexpr double kNearlyLinear = 3.0 * kDegree;  // Scenes whose bound is a bound.
  Random random(21);
  double square = 0.0, bound = 0.0, nees = 0.0;
  for (int i = 0; i < kTrials;) {
    const double off = angle == Angle::kHard ? 0.0 : kAngleSigma * random.Normal();
    const Scene scene = RandomScene(lines, 90.0 * kDegree + off, false, &random);
    const Matrix3d covariance = Bound(scene, angle, kAngleSigma);
    if (!(std::sqrt(covariance.trace()) < kNearlyLinear)) continue;
    const PoseHypothesis best =
        Best(EstimatePose(Observe(scene, angle, kAngleSigma, &random), LeastSquares()));
    const Vector3d error = RotationError(best.cam_from_world.rotation, scene.rotation);
    square += error.squaredNorm() / kTrials;
    bound += covariance.trace() / kTrials;
    nees += error.dot(best.Covariance().topLeftCorner<3, 3>().inverse() * error) / kTrials;
    ++i;
  }
  if (kSanitized) return;
  const char* const names[] = {"known", "known to 0.6 degrees", "unknown"};
  std::printf("2 x %2d lines, angle %s: rms %.3f degrees, bound %.3f, ratio %.3f, NEES %.2f\n",
              lines, names[static_cast<int>(angle)], std::sqrt(square) / kDegree,
              std::sqrt(bound) / kDegree, std::sqrt(square / bound), nees);
  EXPECT_LE(std::sqrt(square / bound), 1.05);
  EXPECT_NEAR(nees, 3.0, 0.3);
}

INSTANTIATE_TEST_SUITE_P(Cases, PencilsTest,
                         ::testing::Combine(::testing::Values(2, 4, 10),
                                            ::testing::Values(Angle::kHard, Angle::kSoft,
                                                              Angle::kAbsent)));

// However bad the bound: what fits best fits no worse than the truth, whichever hypothesis it is,
// or has the truth within its spread: of humps that overlap it has the likelier, not the best fit.
// Of 100 000 scenes 4 to 6 have a better minimum that no start leads to; two or more of 2000 are
// then a matter of one in 150, whatever else changes the draws.
TEST(PencilsTest, FitsNoWorseThanTheTruth) {
  Random random(22);
  int worse = 0;
  const int scenes = Trials("CIRCLINE_PENCIL_SCENES", 2000);
  for (int i = 0; i < scenes; ++i) {
    const Scene scene = RandomScene(2 + random.UniformInt(3), 90.0 * kDegree, i % 2 == 0, &random);
    const Observations observations = Observe(scene, Angle::kHard, 0.0, &random);
    const PoseEstimate estimate = EstimatePose(observations, LeastSquares());
    ASSERT_TRUE(estimate.status.ok()) << i << ": " << estimate.status.message;
    double best = std::numeric_limits<double>::infinity();
    bool is_within = false;
    for (const PoseHypothesis& hypothesis : estimate.hypotheses) {
      ASSERT_TRUE(hypothesis.cam_from_world.rotation.allFinite());
      best = std::min(best, hypothesis.cost);
      const Vector3d error = RotationError(hypothesis.cam_from_world.rotation, scene.rotation);
      const Matrix3d covariance = hypothesis.Covariance().topLeftCorner<3, 3>();
      constexpr double kThreeSigmas = 14.16;  // Of chi-square with three degrees of freedom.
      is_within = is_within || error.dot(covariance.inverse() * error) < kThreeSigmas;
    }
    // The cost of the truth, each line at its best angle about its direction.
    double cost = 0.0;
    for (std::size_t k = 0; k < 2; ++k) {
      for (const LineObservation& line : observations.pencils[k].lines) {
        std::vector<CalibratedPoint> points;
        PixelsToCalibrated(scene.camera, line.points, &points);
        LineFit fit;
        ASSERT_TRUE(FitLine(points, kNoisePx, &fit).ok());
        const double r = VanishingPointResidual(fit, scene.directions[k]);
        cost += 0.5 * r * r;
      }
    }
    // First-order residuals: a hundredth of the cost is theirs.
    if (!(best <= 1.01 * cost + 1e-6) && !is_within) ++worse;
  }
  std::printf(
      "%d scenes of two pencils of 2 to 4 lines, every other a corridor: %d fit worse than the "
      "truth\n",
      scenes, worse);
  EXPECT_LE(worse, 1 + scenes / 10000);
}

}  // namespace
}  // namespace circline
