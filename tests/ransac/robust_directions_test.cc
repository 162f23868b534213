#include "circline/ransac/robust_directions.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "circline/estimators/random.h"
#include "tests/ransac/segment_scene.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using segment_scene::AddSegment;
using segment_scene::AngleBetween;
using segment_scene::RandomRotation;

struct TripletScene {
  Matrix3d truth;
  std::vector<LineFit> lines;  // Those of column 0, 1, 2, then the clutter.
  double bound = 0.0;          // Mean squared angle.
};

TripletScene MakeTriplet(std::uint64_t seed, const std::array<int, 3>& counts, int clutter) {
  Random random(seed);
  TripletScene scene;
  scene.truth = RandomRotation(&random);
  Matrix3d information = Matrix3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const Vector3d v = scene.truth.col(k);
    for (int i = 0; i < counts[static_cast<std::size_t>(k)]; ++i) {
      AddSegment(&v, &random, &scene.lines);
      const LineFit& line = scene.lines.back();
      const Vector3d slope = v.cross(line.line);
      information += slope * slope.transpose() / v.dot(line.covariance * v);
    }
  }
  scene.bound = information.inverse().trace();
  for (int i = 0; i < clutter; ++i) AddSegment(nullptr, &random, &scene.lines);
  return scene;
}

PencilOptions ExactOptions() {
  PencilOptions options;
  options.model_sigma_rad = 0.0;
  return options;
}

// delta in estimate = exp([delta]x) truth, the columns taken as they fit best.
Vector3d RotationError(const Matrix3d& truth, const Matrix3d& estimate) {
  Vector3d smallest = Vector3d::Constant(10.0);
  std::array<int, 3> order = {0, 1, 2};
  do {
    Matrix3d matched;
    for (int k = 0; k < 3; ++k) {
      const Vector3d column = estimate.col(order[static_cast<std::size_t>(k)]);
      matched.col(k) = column.dot(truth.col(k)) < 0.0 ? Vector3d(-column) : column;
    }
    if (matched.determinant() < 0.0) continue;
    const Eigen::AngleAxisd turn(matched * truth.transpose());
    const Vector3d delta = turn.angle() * turn.axis();
    if (delta.norm() < smallest.norm()) smallest = delta;
  } while (std::next_permutation(order.begin(), order.end()));
  return smallest;
}

TEST(FitOrthogonalTriplet, IsNearTheBoundAmongFiftyPercentClutter) {
  constexpr int kTrials = 100;
  double squares = 0.0, bounds = 0.0;
  std::vector<double> nees;
  for (std::uint64_t trial = 0; trial < kTrials; ++trial) {
    const TripletScene scene = MakeTriplet(trial, {30, 30, 30}, 90);
    OrthogonalTripletFit fit;
    std::vector<int> membership;
    ASSERT_TRUE(FitOrthogonalTriplet(scene.lines, ExactOptions(), &fit, &membership).ok()) << trial;
    EXPECT_NEAR(fit.rotation.determinant(), 1.0, 1e-9);
    EXPECT_LT((fit.rotation.transpose() * fit.rotation - Matrix3d::Identity()).norm(), 1e-9);
    const Vector3d error = RotationError(scene.truth, fit.rotation);
    EXPECT_LT(error.squaredNorm(), 25.0 * scene.bound) << trial;
    squares += error.squaredNorm();
    bounds += scene.bound;
    nees.push_back(error.dot(fit.covariance.inverse() * error));
    ASSERT_EQ(membership.size(), scene.lines.size());
    int right = 0;
    for (std::size_t i = 0; i < 90; ++i) {
      if (membership[i] < 0) continue;
      right += AngleBetween(fit.rotation.col(membership[i]),
                            scene.truth.col(static_cast<int>(i / 30))) < 0.05;
    }
    EXPECT_GE(right, 80) << trial;
  }
  EXPECT_LT(std::sqrt(squares / bounds), 1.10);
  // The median of chi-square with three degrees of freedom is 2.37.
  std::sort(nees.begin(), nees.end());
  EXPECT_GT(nees[kTrials / 2], 1.7);
  EXPECT_LT(nees[kTrials / 2], 3.1);
}

TEST(FitOrthogonalTriplet, TheBestSupportedComesFirst) {
  const TripletScene scene = MakeTriplet(3, {10, 40, 20}, 30);
  OrthogonalTripletFit fit;
  std::vector<int> membership;
  ASSERT_TRUE(FitOrthogonalTriplet(scene.lines, PencilOptions(), &fit, &membership).ok());
  EXPECT_LT(AngleBetween(fit.rotation.col(0), scene.truth.col(1)), 0.02);
  EXPECT_LT(AngleBetween(fit.rotation.col(1), scene.truth.col(2)), 0.02);
  EXPECT_LT(AngleBetween(fit.rotation.col(2), scene.truth.col(0)), 0.02);
  EXPECT_GE(std::count(membership.begin() + 10, membership.begin() + 50, 0), 36);
  EXPECT_GE(std::count(membership.begin(), membership.begin() + 10, 2), 8);
}

TEST(FitOrthogonalTriplet, TheThirdDirectionNeedsNoLines) {
  const TripletScene scene = MakeTriplet(4, {20, 15, 0}, 20);
  OrthogonalTripletFit fit;
  ASSERT_TRUE(FitOrthogonalTriplet(scene.lines, PencilOptions(), &fit).ok());
  EXPECT_LT(RotationError(scene.truth, fit.rotation).norm(), 0.03);
}

TEST(FitOrthogonalTriplet, SameSeedSameBits) {
  const TripletScene scene = MakeTriplet(5, {30, 30, 30}, 90);
  OrthogonalTripletFit a, b;
  ASSERT_TRUE(FitOrthogonalTriplet(scene.lines, PencilOptions(), &a).ok());
  ASSERT_TRUE(FitOrthogonalTriplet(scene.lines, PencilOptions(), &b).ok());
  EXPECT_EQ(a.rotation, b.rotation);
  EXPECT_EQ(a.covariance, b.covariance);
}

TEST(FitOrthogonalTriplet, RefusesWhatFixesNoRotation) {
  OrthogonalTripletFit fit;
  fit.rotation.setConstant(7.0);
  std::vector<int> membership(2, 5);
  const auto refused = [&](const std::vector<LineFit>& lines) {
    const Status status = FitOrthogonalTriplet(lines, PencilOptions(), &fit, &membership);
    return status.code == StatusCode::kRefused && !status.message.empty();
  };
  EXPECT_TRUE(refused({}));
  EXPECT_TRUE(refused(std::vector<LineFit>(6)));  // Never fitted.
  const TripletScene scene = MakeTriplet(6, {8, 8, 0}, 0);
  EXPECT_TRUE(refused({scene.lines[0], scene.lines[1], scene.lines[8]}));
  EXPECT_TRUE(refused(std::vector<LineFit>(10, scene.lines[0])));
  EXPECT_EQ(fit.rotation, Matrix3d::Constant(7.0));
  EXPECT_EQ(membership, std::vector<int>(2, 5));
}

TEST(RobustDirections, ExactLinesGiveTheExactDirections) {
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    Random random(seed);
    const Matrix3d truth = RandomRotation(&random);
    std::vector<LineFit> lines(40);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const double x = random.Normal(), y = random.Normal(), z = random.Normal();
      const Vector3d point(x, y, z);
      lines[i].line = i < 30 ? truth.col(static_cast<int>(i / 10)).cross(point).normalized()
                             : point.normalized();
    }
    OrthogonalTripletFit triplet;
    std::vector<int> membership;
    ASSERT_TRUE(FitOrthogonalTriplet(lines, ExactOptions(), &triplet, &membership).ok()) << seed;
    EXPECT_LT(RotationError(truth, triplet.rotation).norm(), 1e-12);
    EXPECT_EQ(std::count(membership.begin(), membership.begin() + 30, -1), 0);
    EXPECT_EQ(std::count(membership.begin() + 30, membership.end(), -1), 10);
  }
}

TEST(FitOrthogonalTriplet, NamesBadOptions) {
  PencilOptions options;
  options.model_sigma_rad = -1.0;
  OrthogonalTripletFit fit;
  const Status status = FitOrthogonalTriplet({}, options, &fit);
  EXPECT_EQ(status.code, StatusCode::kInvalidArgument);
  EXPECT_NE(status.message.find("model_sigma_rad"), std::string::npos);
}

}  // namespace
}  // namespace circline
