#include "circline/ransac/direction_models.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "circline/estimators/random.h"
#include "circline/estimators/vanishing_point.h"
#include "circline/ransac/ransac.h"
#include "tests/ransac/segment_scene.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using segment_scene::AddSegment;
using segment_scene::RandomRotation;

// Twelve lines along each of three orthogonal directions, as they come.
class DirectionModels : public testing::Test {
 protected:
  DirectionModels() {
    Random random(8);
    R_ = RandomRotation(&random);
    for (int k = 0; k < 3; ++k) {
      const Vector3d v = R_.col(k);
      for (int i = 0; i < 12; ++i) AddSegment(&v, &random, &lines_);
    }
    for (int i = 0; i < 36; ++i) all_.push_back(i);
  }
  // Position in the model of line i.
  static int Position(const PencilModel& model, int i) {
    int position = 0;
    while (model.LineIndex(position) != i) ++position;
    return position;
  }

  Matrix3d R_;
  std::vector<LineFit> lines_;
  std::vector<int> all_;
};

TEST_F(DirectionModels, TripletFitsItsSample) {
  const PencilModel pencil(lines_, all_, 0.0);
  const OrthogonalTripletModel model(pencil);
  const std::array<int, 3> sample{Position(pencil, 0), Position(pencil, 7), Position(pencil, 15)};
  OrthogonalTripletModel::Value value;
  ASSERT_TRUE(model.Fit(sample.data(), &value));
  const Matrix3d R = Eigen::Map<const Matrix3d>(value.data());
  EXPECT_NEAR(R.determinant(), 1.0, 1e-12);
  EXPECT_LT((R.transpose() * R - Matrix3d::Identity()).norm(), 1e-12);
  EXPECT_NEAR(R.col(0).dot(pencil.Line(sample[0])), 0.0, 1e-12);
  EXPECT_NEAR(R.col(0).dot(pencil.Line(sample[1])), 0.0, 1e-12);
  EXPECT_NEAR(R.col(1).dot(pencil.Line(sample[2])), 0.0, 1e-12);
  const std::array<int, 3> same{sample[0], sample[0], sample[2]};
  EXPECT_FALSE(model.Fit(same.data(), &value));
}

TEST_F(DirectionModels, ResidualsAreThoseOfTheNearestDirection) {
  const PencilModel pencil(lines_, all_, 0.0);
  const OrthogonalTripletModel model(pencil);
  OrthogonalTripletModel::Value value;
  Eigen::Map<Matrix3d>(value.data()) = R_;
  std::array<float, kRansacBlock> r2;
  model.SquaredResiduals(value, 0, kRansacBlock, r2.data());
  for (int i = 0; i < kRansacBlock; ++i) {
    const LineFit& line = lines_[static_cast<std::size_t>(pencil.LineIndex(i))];
    double smallest = 1e300;
    for (int k = 0; k < 3; ++k) {
      smallest = std::min(smallest, std::abs(VanishingPointResidual(line, R_.col(k))));
    }
    EXPECT_NEAR(std::sqrt(static_cast<double>(r2[static_cast<std::size_t>(i)])), smallest,
                0.01 * (1.0 + smallest));
  }
}

TEST_F(DirectionModels, TripletRefinesToTheMinimum) {
  const PencilModel pencil(lines_, all_, 0.0);
  const OrthogonalTripletModel model(pencil);
  OrthogonalTripletModel::Value value;
  Eigen::Map<Matrix3d>(value.data()) =
      Eigen::AngleAxisd(0.01, Vector3d(1.0, 2.0, -1.0).normalized()) * R_;
  const std::vector<float> weights(lines_.size(), 1.0f);
  const auto cost = [&](const OrthogonalTripletModel::Value& v) {
    std::array<float, 36> r2;
    model.SquaredResiduals(v, 0, 32, r2.data());
    model.SquaredResiduals(v, 32, 36, r2.data() + 32);
    double sum = 0.0;
    for (const float r : r2) sum += static_cast<double>(r);
    return sum;
  };
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(model.Refine(weights.data(), &value));
  // Weights depend on the direction, so the step's fixed point is near the minimum, not on it.
  const double reached = cost(value);
  Random random(2);
  for (int trial = 0; trial < 30; ++trial) {
    const double x = random.Normal(), y = random.Normal(), z = random.Normal();
    OrthogonalTripletModel::Value moved;
    Eigen::Map<Matrix3d>(moved.data()) = Eigen::AngleAxisd(0.005, Vector3d(x, y, z).normalized()) *
                                         Matrix3d(Eigen::Map<Matrix3d>(value.data()));
    EXPECT_GT(cost(moved), reached);
  }
}

TEST_F(DirectionModels, AcceptAsksForTwoDirections) {
  // All lines along one direction.
  const std::vector<int> one(all_.begin(), all_.begin() + 12);
  const PencilModel pencil(lines_, one, 0.0);
  const OrthogonalTripletModel triplet(pencil);
  OrthogonalTripletModel::Value value;
  Eigen::Map<Matrix3d>(value.data()) = R_;
  EXPECT_FALSE(triplet.Accept(value, kInlierSigmas));
  const PencilModel every(lines_, all_, 0.0);
  EXPECT_TRUE(OrthogonalTripletModel(every).Accept(value, kInlierSigmas));
}

}  // namespace
}  // namespace circline
