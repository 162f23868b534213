#include "circline/refine/quadratic_models.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <vector>

#include "circline/estimators/pose.h"
#include "circline/estimators/random.h"

namespace circline {
namespace {

// A model as a function of its local variables; `x` holds delta first where there is a rotation.
using Model = std::function<double(const std::vector<double>& x, QuadraticModel* model)>;

// Largest difference of the gradient from central differences, relative to the largest entry.
double GradientError(const Model& model, std::vector<double> x) {
  QuadraticModel at;
  const double cost = model(x, &at);
  EXPECT_EQ(at.cost, cost);
  EXPECT_NEAR(model(x, nullptr), cost, 1e-12 * (1.0 + cost));
  double largest = 1e-12, error = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    constexpr double kStep = 1e-6;
    const double value = x[k];
    x[k] = value + kStep;
    const double plus = model(x, nullptr);
    x[k] = value - kStep;
    const double minus = model(x, nullptr);
    x[k] = value;
    const double numeric = (plus - minus) / (2.0 * kStep);
    largest = std::max(largest, std::abs(numeric));
    error = std::max(error, std::abs(numeric - at.gradient[static_cast<Eigen::Index>(k)]));
  }
  return error / largest;
}

// At residuals of zero the model's Hessian is exact: against differences of the gradient.
double HessianError(const Model& model, std::vector<double> x) {
  QuadraticModel at, plus, minus;
  model(x, &at);
  double error = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    constexpr double kStep = 1e-6;
    const double value = x[k];
    x[k] = value + kStep;
    model(x, &plus);
    x[k] = value - kStep;
    model(x, &minus);
    x[k] = value;
    const Vector6d numeric = (plus.gradient - minus.gradient) / (2.0 * kStep);
    error = std::max(
        error, (numeric - at.hessian.col(static_cast<Eigen::Index>(k))).lpNorm<Eigen::Infinity>());
  }
  return error / at.hessian.lpNorm<Eigen::Infinity>();
}

Camera DistortedCamera() {
  Camera camera;
  camera.model = CameraModel::kOpenCV;
  camera.fx = 500.0;
  camera.fy = 520.0;
  camera.cx = 320.0;
  camera.cy = 240.0;
  camera.distortion = {-0.3, 0.1, 1e-3, -1e-3, 0.02};
  return camera;
}

// Points about the middle of a distorted photo, a few pixels off any curve.
PointSet RandomPoints(LossType loss, Random* random) {
  PointSet set;
  set.loss = loss;
  set.sigma_px = 3.0;
  set.weight = 0.7;
  while (set.points.size() < 20) {
    CalibratedPoint p;
    const double u = random->Uniform(0.0, 640.0), v = random->Uniform(0.0, 480.0);
    if (PixelToCalibrated(DistortedCamera(), {u, v}, &p)) set.points.push_back(p);
  }
  return set;
}

Eigen::Matrix3d Turned(const Eigen::Matrix3d& base, const std::vector<double>& x) {
  return base * ExpRotation({x[0], x[1], x[2]});
}

class QuadraticModelsTest : public ::testing::TestWithParam<LossType> {
 protected:
  Random random_{3};
  PointSet set_ = RandomPoints(GetParam(), &random_);
  SetWeighing weighing_{20.0, false};
  Eigen::Matrix3d base_ = ExpRotation({0.3, -0.2, 2.5});
};

TEST_P(QuadraticModelsTest, CircleGradient) {
  PointSet normalized = set_, orthogonal = set_;
  normalized.Normalize();
  orthogonal.distance = ConicDistanceType::kOrthogonal;
  for (const PointSet& set : {set_, normalized, orthogonal}) {
    for (const double facing : {-1.0, 1.0}) {
      const Model model = [&](const std::vector<double>& x, QuadraticModel* out) {
        return EvaluateCircle(set, weighing_, Turned(base_, x), facing, x[3], x[4], x[5], out);
      };
      EXPECT_LT(GradientError(model, {0, 0, 0, 0.1, -0.2, 0.4}), 1e-6);
    }
  }
}

TEST_P(QuadraticModelsTest, NormalizedPointsHaveTheSameModel) {
  for (const auto distance : {ConicDistanceType::kSampson, ConicDistanceType::kOrthogonal}) {
    set_.distance = distance;
    PointSet normalized = set_;
    normalized.Normalize();
    QuadraticModel a, b;
    EvaluateCircle(set_, weighing_, base_, -1.0, 0.1, -0.2, 0.4, &a);
    EvaluateCircle(normalized, weighing_, base_, -1.0, 0.1, -0.2, 0.4, &b);
    EXPECT_NEAR(a.cost, b.cost, 1e-10 * a.cost);
    EXPECT_LT((a.gradient - b.gradient).norm(), 1e-9 * a.gradient.norm());
    EXPECT_LT((a.hessian - b.hessian).norm(), 1e-9 * a.hessian.norm());
  }
}

TEST_P(QuadraticModelsTest, LineGradient) {
  const auto m = [](double s, double t) { return Eigen::Vector3d(s, t, s * t + 0.3); };
  const Model model = [&](const std::vector<double>& x, QuadraticModel* out) {
    Eigen::Matrix3d dm = Eigen::Matrix3d::Zero();
    dm.col(0) = Eigen::Vector3d(1.0, 0.0, x[4]);
    dm.col(1) = Eigen::Vector3d(0.0, 1.0, x[3]);
    return EvaluateLine(set_, weighing_, Turned(base_, x), m(x[3], x[4]), dm, out);
  };
  EXPECT_LT(GradientError(model, {0, 0, 0, 0.7, -0.4}), 1e-6);
}

TEST_P(QuadraticModelsTest, PointGradient) {
  MeasuredPoint measured;
  measured.x.x = {0.1, 0.2};
  measured.x.x_from_pixel = {2e-3, 1e-4, -1e-4, 2.2e-3};
  measured.sigma_px = 5.0;
  measured.loss = GetParam();
  // facing 1 and a rotation near the identity: the plane Z = 1 is in front of the camera.
  const Eigen::Matrix3d near_identity = ExpRotation({0.1, 0.2, 0.3});
  const Model model = [&](const std::vector<double>& x, QuadraticModel* out) {
    return EvaluatePoint(measured, weighing_, Turned(near_identity, x), 1.0, x[3], x[4], out);
  };
  EXPECT_LT(GradientError(model, {0, 0, 0, 0.3, -0.2}), 1e-6);
}

// On exact points of a circle and of a line the residuals are zero.
TEST_P(QuadraticModelsTest, HessianIsExactWhereTheEvidenceFits) {
  const Camera camera = DistortedCamera();
  const Eigen::Matrix3d near_identity = ExpRotation({0.1, 0.2, 0.3});
  PointSet circle, line;
  circle.loss = line.loss = GetParam();
  for (int i = 0; i < 20; ++i) {
    const double a = 0.3 * i;
    const auto add = [&](double X, double Y, PointSet* set) {
      Eigen::Vector2d pixel;
      CalibratedPoint p;
      ASSERT_TRUE(CameraToPixel(camera, near_identity * Eigen::Vector3d(X, Y, 1.0), &pixel));
      ASSERT_TRUE(PixelToCalibrated(camera, pixel, &p));
      set->points.push_back(p);
    };
    add(0.1 + 0.2 * std::cos(a), -0.1 + 0.2 * std::sin(a), &circle);
    add(0.02 * i, 0.1, &line);
  }
  circle.Normalize();
  const Model circle_model = [&](const std::vector<double>& x, QuadraticModel* out) {
    return EvaluateCircle(circle, {}, Turned(near_identity, x), 1.0, x[3], x[4], x[5], out);
  };
  for (const auto distance : {ConicDistanceType::kSampson, ConicDistanceType::kOrthogonal}) {
    circle.distance = distance;
    EXPECT_LT(HessianError(circle_model, {0, 0, 0, 0.1, -0.1, 0.2}), 1e-4);
  }
  const Model line_model = [&](const std::vector<double>& x, QuadraticModel* out) {
    Eigen::Matrix3d dm = Eigen::Matrix3d::Zero();
    dm(2, 0) = -1.0;
    return EvaluateLine(line, {}, Turned(near_identity, x), {0.0, 1.0, -x[3]}, dm, out);
  };
  EXPECT_LT(HessianError(line_model, {0, 0, 0, 0.1}), 1e-4);
}

INSTANTIATE_TEST_SUITE_P(Losses, QuadraticModelsTest,
                         ::testing::Values(LossType::kTrivial, LossType::kHuber,
                                           LossType::kSoftLOne, LossType::kCauchy,
                                           LossType::kArctan, LossType::kTukey,
                                           LossType::kGemanMcClure));

// Points at the same distance all around a circle of 20 px seen from the front, where the distance
// is known, and around a tilted one, through a distorting lens.
class ConicDistanceTest : public ::testing::Test {
 protected:
  // Around the image of the circle of radius 0.2 about (cx, cy) of the plane Z = 1: inside and
  // outside of it by `offset` pixels.
  PointSet Around(const Camera& camera, const Eigen::Matrix3d& R, double offset) const {
    PointSet set;
    for (int i = 0; i < 24; ++i) {
      Eigen::Vector2d at, ahead;
      CameraToPixel(camera, Place(R, 0.26 * i), &at);
      CameraToPixel(camera, Place(R, 0.26 * i + 1e-6), &ahead);
      const Eigen::Vector2d along = (ahead - at).normalized();
      const Eigen::Vector2d across(along.y(), -along.x());
      CalibratedPoint p;
      EXPECT_TRUE(PixelToCalibrated(camera, at + (i % 2 == 0 ? offset : -offset) * across, &p));
      set.points.push_back(p);
    }
    return set;
  }

  std::vector<double> Distances(PointSet set, const Eigen::Matrix3d& R,
                                ConicDistanceType type) const {
    set.distance = type;
    set.Normalize();
    std::vector<double> distances;
    ConicDistances(set, ImageOfPlaneCircle(R, 1.0, kCx, kCy, kRadius), &distances);
    return distances;
  }

  static Eigen::Vector3d Place(const Eigen::Matrix3d& R, double angle) {
    return R *
           Eigen::Vector3d(kCx + kRadius * std::cos(angle), kCy + kRadius * std::sin(angle), 1.0);
  }

  static constexpr double kCx = 0.1, kCy = -0.1, kRadius = 0.2;
};

TEST_F(ConicDistanceTest, OrthogonalDistancesAreThoseThatAre) {
  Camera camera = DistortedCamera();
  camera.model = CameraModel::kPinhole;
  camera.distortion = {};
  const Eigen::Matrix3d tilted = ExpRotation({0.4, 0.3, 0.1});
  for (const double offset : {0.01, 1.0, 15.0, -5.0}) {
    const std::vector<double> found =
        Distances(Around(camera, tilted, offset), tilted, ConicDistanceType::kOrthogonal);
    for (std::size_t i = 0; i < found.size(); ++i)
      EXPECT_NEAR(std::abs(found[i]), std::abs(offset), 1e-6) << i;
  }
}

TEST_F(ConicDistanceTest, SampsonAndOrthogonalAgreeToSecondOrder) {
  const Eigen::Matrix3d tilted = ExpRotation({0.4, 0.3, 0.1});
  std::vector<double> logs, offsets;
  for (const double offset : {0.03, 0.1, 0.3, 1.0, 3.0}) {
    const PointSet set = Around(DistortedCamera(), tilted, offset);
    const std::vector<double> a = Distances(set, tilted, ConicDistanceType::kSampson),
                              b = Distances(set, tilted, ConicDistanceType::kOrthogonal);
    double largest = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      EXPECT_GT(a[i] * b[i], 0.0);
      largest = std::max(largest, std::abs(a[i] - b[i]));
    }
    // 100 px are the image's radius: half the square of the distance over it, and they are apart.
    EXPECT_LT(largest, 0.02 * offset * offset);
    EXPECT_GT(largest, 0.002 * offset * offset);
    offsets.push_back(std::log(offset));
    logs.push_back(std::log(largest));
  }
  for (std::size_t i = 1; i < logs.size(); ++i) {
    const double slope = (logs[i] - logs[i - 1]) / (offsets[i] - offsets[i - 1]);
    EXPECT_NEAR(slope, 2.0, 0.1) << "from " << std::exp(offsets[i - 1]) << " px";
  }
}

// A circle that reaches behind the camera has no ellipse for an image: Sampson's distance stands
// in.
TEST_F(ConicDistanceTest, BeyondEllipsesItIsSampson) {
  const Eigen::Matrix3d R = ExpRotation({1.3, 0.0, 0.0});
  Random random(4);
  PointSet set = RandomPoints(LossType::kTrivial, &random);
  const double sampson = EvaluateCircle(set, {}, R, 1.0, 0.0, 0.0, 2.0, nullptr);
  set.distance = ConicDistanceType::kOrthogonal;
  EXPECT_EQ(EvaluateCircle(set, {}, R, 1.0, 0.0, 0.0, 2.0, nullptr), sampson);
}

TEST(InliersOnlyTest, PointsBeyondTheGateDoNotCount) {
  Random random(3);
  PointSet set = RandomPoints(LossType::kTukey, &random);
  set.sigma_px = 30.0;
  const Eigen::Vector3d m(0.1, 1.0, 0.05);
  PointSet within = set;
  std::vector<double> distances;
  LineDistances(set, m, &distances);
  within.points.clear();
  for (std::size_t i = 0; i < distances.size(); ++i) {
    if (std::abs(distances[i]) <= kInlierSigmas * set.sigma_px)
      within.points.push_back(set.points[i]);
  }
  ASSERT_GT(within.points.size(), 0U);
  ASSERT_LT(within.points.size(), set.points.size());
  within.loss = LossType::kTrivial;
  QuadraticModel a, b;
  const Eigen::Matrix3d R = Eigen::Matrix3d::Identity(), dm = Eigen::Matrix3d::Zero();
  EvaluateLine(set, SetWeighing{1.0, true}, R, m, dm, &a);
  EvaluateLine(within, SetWeighing(), R, m, dm, &b);
  EXPECT_NEAR(a.cost, b.cost, 1e-12 * b.cost);
  EXPECT_LT((a.hessian - b.hessian).norm(), 1e-12 * b.hessian.norm());
}

// Without loss and lens the points' scatter says the same as the points.
TEST(ScatterTest, IsExactWithoutLossAndLens) {
  Camera camera = DistortedCamera();
  camera.model = CameraModel::kPinhole;
  Random random(3);
  PointSet set;
  set.sigma_px = 3.0;
  set.weight = 0.7;
  for (int i = 0; i < 20; ++i) {
    CalibratedPoint p;
    ASSERT_TRUE(PixelToCalibrated(
        camera, {random.Uniform(0.0, 640.0), 200.0 + random.Uniform(-9.0, 9.0)}, &p));
    set.points.push_back(p);
  }
  PointSet robust = set, distorted = set;
  robust.loss = LossType::kCauchy;
  distorted.points[3].x_from_pixel[0] *= 1.01;
  for (PointSet* s : {&set, &robust, &distorted}) s->Compress();
  EXPECT_FALSE(robust.scatter);
  EXPECT_FALSE(distorted.scatter);
  ASSERT_TRUE(set.scatter);
  PointSet plain = set;
  plain.scatter.reset();
  const Eigen::Matrix3d R = ExpRotation({0.01, 0.02, 0.03});
  const Eigen::Vector3d m(0.02, 1.0, 0.09);
  const Eigen::Matrix3d dm = Eigen::Vector3d(0.5, 0.1, 1.0).asDiagonal();
  for (const SetWeighing& weighing :
       {SetWeighing{1.0, false}, SetWeighing{7.0, false}, SetWeighing{1.0, true}}) {
    QuadraticModel a, b;
    EvaluateLine(set, weighing, R, m, dm, &a);
    EvaluateLine(plain, weighing, R, m, dm, &b);
    ASSERT_GT(b.cost, 0.0);
    EXPECT_NEAR(a.cost, b.cost, 1e-11 * b.cost);
    EXPECT_NEAR(EvaluateLine(set, weighing, R, m, dm, nullptr), a.cost, 1e-11 * a.cost);
    EXPECT_LT((a.gradient - b.gradient).norm(), 1e-10 * b.gradient.norm());
    EXPECT_LT((a.hessian - b.hessian).norm(), 1e-10 * b.hessian.norm());
  }
}

TEST(AngleModelTest, GradientAndSenseDoesNotMatter) {
  const Model model = [](const std::vector<double>& x, QuadraticModel* out) {
    return EvaluateAngle(1.5, 0.01, x.data(), out);
  };
  EXPECT_LT(GradientError(model, {0.1, 1.7}), 1e-6);
  constexpr double kPi = 3.14159265358979;
  for (const double theta : {1.5, -1.5, 1.5 + kPi, 1.5 - kPi}) {
    EXPECT_NEAR(model({0.0, theta}, nullptr), 0.0, 1e-9);
  }
}

TEST(LengthModelTest, Gradient) {
  const Model model = [](const std::vector<double>& x, QuadraticModel* out) {
    return EvaluateLength(2.0, x.data(), x.data() + 2, x[4], out);
  };
  EXPECT_LT(GradientError(model, {0.1, 0.2, 0.9, -0.4, 0.7}), 1e-6);
}

}  // namespace
}  // namespace circline
