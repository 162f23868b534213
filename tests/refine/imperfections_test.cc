// What is not exact beside the points: unknowns with priors, counted in the covariance by as much
// as they are worth; and the noise of points where nobody states it.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/pencil_lean.h"
#include "circline/refine/estimate_pose.h"
#include "tests/plane_scene.h"
#include "tests/refine/simulated_options.h"
#include "tests/trials.h"

namespace circline {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

void ExpectHonest(const char* what, double nees_per_dimension) {
  std::printf("%s: NEES a dimension %.2f\n", what, nees_per_dimension);
  EXPECT_GT(nees_per_dimension, 0.8);
  EXPECT_LT(nees_per_dimension, 1.25);
}

// A circle off its plane: tilted about X and Y, and raised by a share of its radius; and an oval.
CircleObservation OffPlane(PlaneScene* scene, const char* id, const Vector2d& center, double radius,
                           double tilt_sigma, double height_sigma, double shape_sigma = 0.0) {
  CircleObservation circle;
  circle.id = id;
  circle.plane = "p0";
  circle.sigma_px = scene->sigma();
  const double about_x = tilt_sigma * scene->random.Normal(),
               about_y = tilt_sigma * scene->random.Normal(),
               height = height_sigma * scene->random.Normal(),
               along = shape_sigma > 0.0 ? shape_sigma * scene->random.Normal() : 0.0,
               between = shape_sigma > 0.0 ? shape_sigma * scene->random.Normal() : 0.0;
  const Eigen::Matrix3d turn = ExpRotation({about_x, about_y, 0.0});
  constexpr int kPoints = 60;
  for (int i = 0; i < kPoints; ++i) {
    const double a = 2.0 * kPi * i / kPoints;
    const double r = radius * (1.0 + along * std::cos(2.0 * a) + between * std::sin(2.0 * a));
    const Vector3d on = Vector3d(center.x(), center.y(), height * radius) +
                        turn * (r * Vector3d(std::cos(a), std::sin(a), 0.0));
    circle.points.push_back(scene->Pixel(on.x(), on.y(), on.z()));
  }
  return circle;
}

TEST(ImperfectionsTest, CirclesOffTheirPlaneAreCountedHonestly) {
  constexpr int kTrials = Trials(300);
  NoiseModel model = NoiseModel::Exact();
  model.circle_tilt_rad = 0.015;
  model.circle_height = 0.01;
  double nees = 0.0, nees_exact = 0.0;
  int left_out = 0;
  for (int i = 0; i < kTrials; ++i) {
    PlaneScene scene(0.7, 0.2, static_cast<std::uint64_t>(i + 1));
    Observations observations = scene.Empty();
    const auto add = [&](const char* id, double x, double y, double radius) {
      observations.circles.push_back(
          OffPlane(&scene, id, {x, y}, radius, model.circle_tilt_rad, model.circle_height));
    };
    add("c0", -1.8, -0.8, 1.0);
    add("c1", 1.6, -0.5, 0.9);
    add("c2", 0.2, 1.6, 0.8);
    const PoseHypothesis best = Best(EstimatePose(observations, LeastSquares(model))),
                         exact = Best(EstimatePose(observations, LeastSquares()));
    left_out += best.left_out.empty() ? 0 : 1;
    nees += NormalErrors(best, scene.pose).Nees() / kTrials;
    nees_exact += NormalErrors(exact, scene.pose).Nees() / kTrials;
  }
  if (kSanitized) return;
  ExpectHonest("circles off their plane", 0.5 * nees);
  EXPECT_GT(nees_exact, 1.5 * nees);
  EXPECT_LE(left_out, 1);  // By chance one of 10 000 photos.
}

// One circle alone: how far it is out of round shows in nothing but its normal.
TEST(ImperfectionsTest, AnOvalIsCountedHonestly) {
  constexpr int kTrials = Trials(300);
  NoiseModel model = NoiseModel::Exact();
  model.circle_shape = 0.01;
  model.spread = 0.0;
  double nees = 0.0;
  for (int i = 0; i < kTrials; ++i) {
    PlaneScene scene(0.7, 0.2, static_cast<std::uint64_t>(i + 1));
    Observations observations = scene.Empty();
    observations.circles = {OffPlane(&scene, "c0", {0.2, -0.3}, 1.5, 0.0, 0.0, model.circle_shape)};
    const PoseEstimate estimate = Ok(EstimatePose(observations, LeastSquares(model)));
    double least = std::numeric_limits<double>::infinity();
    for (const PoseHypothesis& h : estimate.hypotheses)
      least = std::min(least, NormalErrors(h, scene.pose).Nees());
    nees += least / kTrials;
  }
  if (!kSanitized) ExpectHonest("an oval", 0.5 * nees);
}

// Walls lean: pencils off the axes that they are taken for.
TEST(ImperfectionsTest, PencilsOffTheirAxesAreCountedHonestly) {
  constexpr int kTrials = Trials(300);
  NoiseModel model = NoiseModel::Exact();
  model.pencil_axis_rad = 0.01;
  double nees = 0.0;
  for (int i = 0; i < kTrials; ++i) {
    PlaneScene scene(0.8, 0.1, static_cast<std::uint64_t>(i + 1));
    // As far as the walls that its lines lie on turn a pencil of this axis.
    const auto leaning = [&](PencilDirection along, const Vector3d& axis) {
      PlaneScene straight(0.8, 0.1, static_cast<std::uint64_t>(i + 1));
      Observations alone = straight.Empty();
      alone.pencils = {straight.Pencil("L", along, axis, 5, 9)};
      FitDirect(0.1, &alone);
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> shape(LeanShape(alone.pencils[0]));
      Vector3d lean;
      for (int k = 0; k < 3; ++k)
        lean[k] = std::sqrt(std::max(0.0, shape.eigenvalues()[k])) * scene.random.Normal();
      const Vector3d turn = scene.pose.rotation.transpose() * (shape.eigenvectors() * lean);
      return Vector3d((axis + model.pencil_axis_rad * turn).normalized());
    };
    Observations observations = scene.Empty();
    observations.pencils = {scene.Pencil("L1", PencilDirection::kX,
                                         leaning(PencilDirection::kX, Vector3d::UnitX()), 5, 9),
                            scene.Pencil("L2", PencilDirection::kY,
                                         leaning(PencilDirection::kY, Vector3d::UnitY()), 5, 9),
                            scene.Pencil("L3", PencilDirection::kZ,
                                         leaning(PencilDirection::kZ, Vector3d::UnitZ()), 5, 9)};
    for (PencilObservation& pencil : observations.pencils) pencil.plane.clear();
    observations.pencils[0].plane = observations.pencils[1].plane = "p0";
    const PoseHypothesis best = Best(EstimatePose(observations, LeastSquares(model)));
    nees += RotationNees(best, scene.pose) / kTrials;
  }
  if (kSanitized) return;
  ExpectHonest("pencils off their axes", nees / 3.0);
}

// The corner of an old street, 1.6 degrees off square, one side of which hardly converges: what its
// lines say of their direction counts for more than that corners are square, be they straight or
// crooked.
TEST(ImperfectionsTest, ACornerIsAsSquareAsItsSidesAreStraight) {
  constexpr int kTrials = 40, kLines = 12;
  const double kCorner = 1.6 * kDegree;
  for (const double crooked_rad : {0.0, 0.006}) {
    double misses = 0.0;
    for (int i = 0; i < kTrials; ++i) {
      PlaneScene scene(0.7, 0.2, static_cast<std::uint64_t>(i + 1));
      const auto side = [&](const char* id, PencilDirection along, double angle, double apart) {
        PencilObservation pencil = scene.Pencil(id, along, Vector3d::UnitX(), 0);
        const Vector3d middle(std::cos(angle), std::sin(angle), 0.0),
            across(-middle.y(), middle.x(), 0.0);
        for (int k = 0; k < kLines; ++k) {
          const Vector3d lean = crooked_rad * scene.random.Normal() * across;
          const Vector3d start = across * (apart * (k - 5.5)) - 1.5 * middle;
          pencil.lines.push_back(scene.Line(start, start + 3.0 * (middle + lean), 9));
        }
        return pencil;
      };
      Observations observations = scene.Empty();
      observations.pencils = {side("L1", PencilDirection::kX, 0.0, 0.4),
                              side("L2", PencilDirection::kY, 0.5 * kPi - kCorner, 0.2)};
      const PoseHypothesis best = Best(EstimatePose(observations, LeastSquares(NoiseModel())));
      const std::vector<PencilEstimate>& pencils = best.pencils;
      const double corner = std::acos(std::abs(pencils[0].direction.dot(pencils[1].direction)));
      misses += std::abs(corner - (0.5 * kPi - kCorner)) / kDegree / kTrials;
    }
    std::printf("crooked by %.3f: the corner is %.2f degrees off\n", crooked_rad, misses);
    EXPECT_LT(misses, 0.8);
  }
}

// All prints bleed alike: one offset for all contours.
TEST(ImperfectionsTest, ContoursThatShareAnOffsetAreCountedHonestly) {
  constexpr int kTrials = Trials(300);
  NoiseModel model = NoiseModel::Exact();
  model.contour_offset_px = 0.4;
  double nees = 0.0;
  for (int i = 0; i < kTrials; ++i) {
    PlaneScene scene(0.7, 0.1, static_cast<std::uint64_t>(i + 1));
    Observations observations = scene.Empty();
    const double offset = model.contour_offset_px * scene.random.Normal();
    for (int k = 0; k < 6; ++k) {
      const double x = 1.7 * (k % 3 - 1), y = 1.8 * (k / 3) - 0.9;
      CircleObservation circle = scene.Circle("c" + std::to_string(k), x, y, 0.4, 40);
      circle.radius = 0.4;
      // Outwards along the contour's normal, from the neighbours on it.
      const std::vector<Vector2d> exact = circle.points;
      const std::size_t n = exact.size();
      for (std::size_t j = 0; j < n; ++j) {
        const double a = 2.0 * kPi * static_cast<double>(j) / static_cast<double>(n);
        PlaneScene still(0.7, 0.0);
        const auto on = [&](double angle) -> Vector2d {
          Vector2d pixel;
          CameraToPixel(still.camera,
                        still.pose.rotation * Vector3d(x + 0.4 * std::cos(angle),
                                                       y + 0.4 * std::sin(angle), 0.0) +
                            still.pose.translation,
                        &pixel);
          return pixel;
        };
        const Vector2d along = (on(a + 1e-4) - on(a - 1e-4)).normalized();
        Vector2d out(along.y(), -along.x());
        if (out.dot(on(a) - on(a + kPi)) < 0.0) out = -out;
        circle.points[j] += offset * out;
      }
      observations.circles.push_back(circle);
    }
    const PoseHypothesis h = Best(EstimatePose(observations, LeastSquares(model)));
    EXPECT_TRUE(h.left_out.empty()) << i;
    nees += NormalErrors(h, scene.pose).Nees() / kTrials;
  }
  if (kSanitized) return;
  ExpectHonest("contours of one offset", 0.5 * nees);
}

// A camera that is known well is not estimated but counted; one that is known a hair less is
// estimated. Where the photo says nothing of it both give the same covariance.
TEST(ImperfectionsTest, ACameraCountedIsWorthACameraEstimated) {
  for (const double tilt : {0.4, 0.7, 1.0}) {
    PlaneScene scene(tilt, 0.3);
    Observations observations = scene.Empty();
    observations.circles = {scene.Circle("c0", 1.5, 0.8, 0.8)};
    observations.circles[0].radius = 0.8;
    observations.frame.origin_is_center = "c0";
    EstimationOptions counted = LeastSquares(NoiseModel::Exact()),
                      estimated = LeastSquares(NoiseModel::Exact());
    CameraSigma sigma;
    sigma.log_aspect = 0.002;
    sigma.principal_point_px = 4.0;
    sigma.k1 = 0.005;
    sigma.log_focal = 0.00999;  // On either side of where it is estimated.
    counted.camera_sigma = sigma;
    sigma.log_focal = 0.01;
    estimated.camera_sigma = sigma;
    const PoseEstimate a = EstimatePose(observations, counted),
                       b = EstimatePose(observations, estimated),
                       exact = EstimatePose(observations, LeastSquares(NoiseModel::Exact()));
    ASSERT_TRUE(a.status.ok() && b.status.ok() && exact.status.ok());
    ASSERT_EQ(a.hypotheses.size(), b.hypotheses.size());
    EXPECT_EQ(a.hypotheses[0].focal_sigma, 0.0);
    EXPECT_GT(b.hypotheses[0].focal_sigma, 0.0);
    for (std::size_t k = 0; k < a.hypotheses.size(); ++k) {
      const Eigen::VectorXd p = a.hypotheses[k].Covariance().diagonal().cwiseSqrt(),
                            q = b.hypotheses[k].Covariance().diagonal().cwiseSqrt();
      EXPECT_LT((p - q).cwiseQuotient(q).cwiseAbs().maxCoeff(), 0.03)
          << tilt << ", hypothesis " << k << ": " << p.transpose() << " and " << q.transpose();
      EXPECT_NEAR(a.hypotheses[k].probability, b.hypotheses[k].probability, 0.02);
    }
    EXPECT_GT(a.hypotheses[0].Covariance().trace(), 1.2 * exact.hypotheses[0].Covariance().trace());
  }
}

// A camera off by what its sigma says: the pose's covariance knows it.
TEST(ImperfectionsTest, ACameraThatIsALittleOffIsCountedHonestly) {
  constexpr int kTrials = Trials(300);
  CameraSigma sigma = CameraSigma::Exact();
  sigma.log_focal = 0.008;
  sigma.principal_point_px = 5.0;
  double nees = 0.0;
  for (int i = 0; i < kTrials; ++i) {
    PlaneScene scene(0.7, 0.2, static_cast<std::uint64_t>(i + 1));
    Observations observations = scene.Empty();
    observations.circles = {scene.Circle("c0", -1.0, 0.3, 1.2), scene.Circle("c1", 1.5, 0.5, 1.0)};
    Camera& camera = observations.camera;
    const double f = std::exp(sigma.log_focal * scene.random.Normal());
    camera.fx *= f;
    camera.fy *= f;
    camera.cx += sigma.principal_point_px * scene.random.Normal();
    camera.cy += sigma.principal_point_px * scene.random.Normal();
    EstimationOptions options = LeastSquares(NoiseModel::Exact());
    options.camera_sigma = sigma;
    const PoseHypothesis best = Best(EstimatePose(observations, options));
    nees += NormalErrors(best, scene.pose).Nees() / kTrials;
  }
  if (kSanitized) return;
  ExpectHonest("a camera a little off", 0.5 * nees);
}

// Three circles, two of which are four times as noisy: unstated, as good as with the right ones.
TEST(ImperfectionsTest, NoiseThatNobodyStatesIsThatOfEachFeature) {
  constexpr int kTrials = Trials(200);
  double rms = 0.0, rms_stated = 0.0, nees = 0.0;
  for (int i = 0; i < kTrials; ++i) {
    PlaneScene scene(0.7, 0.2, static_cast<std::uint64_t>(i + 1));
    Observations stated = scene.Empty();
    stated.circles = {scene.Circle("c0", -1.5, -0.3, 1.2, 100),
                      scene.Circle("c1", 1.6, -0.5, 0.9, 100),
                      scene.Circle("c2", 0.8, 1.4, 0.8, 100)};
    for (std::size_t k = 1; k < 3; ++k) {
      stated.circles[k].sigma_px = 0.8;
      for (Vector2d& p : stated.circles[k].points) {
        const double dx = scene.random.Normal(), dy = scene.random.Normal();
        p += std::sqrt(0.8 * 0.8 - 0.2 * 0.2) * Vector2d(dx, dy);
      }
    }
    Observations unstated = stated;
    for (CircleObservation& circle : unstated.circles) circle.sigma_px = 0.0;
    const EstimationOptions options = LeastSquares(NoiseModel::Exact());
    const PoseEstimate known = EstimatePose(stated, options),
                       found = EstimatePose(unstated, options);
    ASSERT_TRUE(known.status.ok() && found.status.ok());
    const NormalErrors errors(found.hypotheses[0], scene.pose);
    rms += errors.error.squaredNorm() / kTrials;
    rms_stated += NormalErrors(known.hypotheses[0], scene.pose).error.squaredNorm() / kTrials;
    nees += errors.Nees() / kTrials;
  }
  if (kSanitized) return;
  ExpectHonest("noise that nobody states", 0.5 * nees);
  EXPECT_LT(std::sqrt(rms / rms_stated), 1.05);
}

}  // namespace
}  // namespace circline
