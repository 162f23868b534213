// What holds of every valid scene: the true pose is among the hypotheses, exact to rounding. A
// million scenes, or CIRCLINE_PROPERTY_SCENES of them.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/circular_points.h"
#include "circline/estimators/line_pose.h"
#include "circline/estimators/random.h"
#include "circline/estimators/statistics.h"
#include "tests/trials.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// A plane with a circle in it, all of which is in front of the camera; the plane's frame; two
// directions of the plane.
struct CircleScene {
  Matrix3d rotation;                // cam_from_world; +Z faces the camera.
  CirclePose circle;                // Lengths in units of its radius.
  Vector3d origin;                  // Of the frame, camera frame.
  double tilt, half_angle;          // Of the circle's normal and of its cone, radians.
  std::array<double, 2> direction;  // Angles in the plane, radians.

  Vector3d InPlane(double angle) const {
    return std::cos(angle) * rotation.col(0) + std::sin(angle) * rotation.col(1);
  }
};

CircleScene RandomScene(Random* random) {
  for (;;) {
    CircleScene s;
    // Distances of 1.5 to 300 radii, the near ones as likely as the far ones; any direction within
    // 60 degrees of the optical axis.
    const double distance = 1.5 * std::pow(200.0, random->Uniform());
    const double off = std::tan(60.0 * kDegree);
    const Vector3d sight =
        Vector3d{random->Uniform(-off, off), random->Uniform(-off, off), 1.0}.normalized();
    s.circle.center = distance * sight;
    s.tilt = random->Uniform(0.0, 89.0 * kDegree);
    const Vector3d a = sight.unitOrthogonal(), b = sight.cross(a);
    const double spin = random->Uniform(0.0, 2.0 * kPi);
    s.circle.normal =
        -std::cos(s.tilt) * sight + std::sin(s.tilt) * (std::cos(spin) * a + std::sin(spin) * b);
    s.half_angle = std::atan(1.0 / distance);
    const double lowest =
        s.circle.center.z() - std::sqrt(std::max(0.0, 1.0 - std::pow(s.circle.normal.z(), 2)));
    if (lowest < 0.05 * distance) continue;  // Reaches behind the camera: no ellipse.
    const Vector3d x = s.circle.normal.unitOrthogonal();
    s.rotation.col(2) = s.circle.normal;
    const double turn = random->Uniform(0.0, 2.0 * kPi);
    s.rotation.col(0) = std::cos(turn) * x + std::sin(turn) * s.circle.normal.cross(x);
    s.rotation.col(1) = s.circle.normal.cross(s.rotation.col(0));
    const double u = random->Uniform(-2.0, 2.0), v = random->Uniform(-2.0, 2.0);
    s.origin = s.circle.center + u * s.rotation.col(0) + v * s.rotation.col(1);
    s.direction = {random->Uniform(0.0, kPi), random->Uniform(0.0, kPi)};
    return s;
  }
}

// Angle between rotations, to rounding where it is small; the least over the senses of the axes.
double RotationError(const Matrix3d& estimate, const Matrix3d& truth) {
  double best = 4.0;
  for (const Matrix3d& choice : SignChoices(estimate)) {
    best = std::min(best, (choice - truth).norm() / std::sqrt(2.0));
  }
  return best;
}

// Errors of one method over all scenes: those that are near-degenerate for it apart.
struct MethodErrors {
  std::vector<double> regular, near_degenerate;
  int regular_failures = 0, near_degenerate_failures = 0;

  void Add(bool degenerate, bool solved, double error) {
    if (solved) {
      (degenerate ? near_degenerate : regular).push_back(error);
    } else {
      ++(degenerate ? near_degenerate_failures : regular_failures);
    }
  }
  void Check(const char* name) {
    ASSERT_FALSE(regular.empty());
    const double median = Median(regular);
    const double worst = *std::max_element(regular.begin(), regular.end());
    std::printf("%-18s %8zu scenes  failures %d  median %.1e  max %.1e rad", name, regular.size(),
                regular_failures, median, worst);
    if (!near_degenerate.empty()) {
      std::printf("   near-degenerate %7zu  failures %d  median %.1e  max %.1e",
                  near_degenerate.size(), near_degenerate_failures, Median(near_degenerate),
                  *std::max_element(near_degenerate.begin(), near_degenerate.end()));
    }
    std::printf("\n");
    EXPECT_EQ(regular_failures, 0) << name;
    EXPECT_LE(median, 1e-12) << name;
    EXPECT_LE(worst, 1e-6) << name;
  }
};

// The hypothesis nearest to the truth: a single circle knows its normal only.
bool SolveCircle(const CircleScene& s, const Matrix3d& conic, double* error) {
  std::array<CirclePose, 2> poses;
  const int count = CirclePoses(conic, &poses);
  *error = 4.0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    *error = std::min(*error, (poses[i].normal - s.circle.normal).norm());
  }
  return count > 0;
}

// Proposition 3: the centre decides, an axis line fixes the rotation.
bool SolveCircleCenter(const CircleScene& s, const Matrix3d& conic, double* error) {
  std::array<CirclePose, 2> poses;
  const int count = CirclePoses(conic, &poses);
  if (count == 0) return false;
  const Vector3d center = s.circle.center.normalized();
  const auto miss = [&center](const CirclePose& p) {
    return p.center.normalized().cross(center).norm();
  };
  const CirclePose& pose = count == 2 && miss(poses[1]) < miss(poses[0]) ? poses[1] : poses[0];
  CircularPoints icp;
  Matrix3d R;
  if (!CircularPointsOfPlane(pose.normal, &icp) ||
      !RotationFromCircularPoints(icp, s.origin.cross(s.rotation.col(0)), &R)) {
    return false;
  }
  *error = RotationError(R, s.rotation);
  return true;
}

// Proposition 4. Where both candidates pass the test, both are hypotheses.
bool SolveCircleFrame(const CircleScene& s, const Matrix3d& conic, double* error) {
  std::array<FrameRotation, 2> found;
  const int count = RotationsFromCircleAndFrame(conic, s.origin.cross(s.rotation.col(0)),
                                                s.origin.cross(s.rotation.col(1)), &found);
  if (count == 0) return false;
  *error = RotationError(found[0].rotation, s.rotation);
  constexpr double kTie = 1e-9;
  if (count == 2 && found[1].deviation < kTie) {
    *error = std::min(*error, RotationError(found[1].rotation, s.rotation));
  }
  return true;
}

// Proposition 5: two pairs of parallel lines of any directions, the first along X.
bool SolveLinePairs(const CircleScene& s, double* error) {
  const auto vanishing_point = [&s](double angle) -> Vector3d {
    const Vector3d d = s.InPlane(angle), across = s.InPlane(angle + 0.5 * kPi);
    return s.origin.cross(s.origin + d).cross((s.origin + across).cross(s.origin + across + d));
  };
  Matrix3d R, truth;
  truth << s.InPlane(s.direction[0]), s.InPlane(s.direction[0] + 0.5 * kPi), s.rotation.col(2);
  if (!RotationFromDirections(vanishing_point(s.direction[0]), vanishing_point(s.direction[1]),
                              &R)) {
    return false;
  }
  *error = RotationError(R, truth);
  return true;
}

TEST(PropertyTest, TheTruthIsAmongTheHypotheses) {
  Random random(2024);
  MethodErrors circle, circle_center, circle_frame, line_pairs;
  const int scenes = Trials("CIRCLINE_PROPERTY_SCENES", 1000000);
  for (int i = 0; i < scenes; ++i) {
    const CircleScene s = RandomScene(&random);
    const Matrix3d conic = ProjectCircle(s.circle);
    const bool degenerate =
        s.tilt < 1.0 * kDegree || s.tilt > 85.0 * kDegree || s.half_angle < 0.5 * kDegree;
    double error = 4.0;
    bool solved = SolveCircle(s, conic, &error);
    circle.Add(degenerate, solved, error);
    solved = SolveCircleCenter(s, conic, &error);
    circle_center.Add(degenerate, solved, error);
    solved = SolveCircleFrame(s, conic, &error);
    circle_frame.Add(degenerate, solved, error);
    solved = SolveLinePairs(s, &error);
    const double sine = std::abs(std::sin(s.direction[1] - s.direction[0]));
    line_pairs.Add(sine < std::sin(2.0 * kDegree) || degenerate, solved, error);
  }
  circle.Check("one circle");
  circle_center.Check("circle and centre");
  circle_frame.Check("circle and frame");
  line_pairs.Check("two line pairs");
}

}  // namespace
}  // namespace circline
