// Closed forms state the covariance of their errors.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <string>

#include "circline/estimators/pencil_lean.h"
#include "tests/estimators/closed_form_call.h"
#include "tests/trials.h"

namespace circline {
namespace {

// The covariance that the closed forms report is that of their errors.
TEST(ClosedFormCovarianceTest, CovarianceIsHonest) {
  constexpr int kTrials = Trials(400);
  for (const char* name : {"circle_frame", "line_pairs", "orthogonal_vanishing_points"}) {
    PlaneScene scene(0.7, 0.3, 11);
    double nees = 0.0;
    for (int i = 0; i < kTrials; ++i) {
      Observations observations = scene.Empty();
      observations.circles = {scene.Circle("c0", 0.5, 0.2, 1.5)};
      observations.pencils = {AlongX(&scene), AlongY(&scene)};
      for (PencilObservation& pencil : observations.pencils) {
        const auto& line = pencil.lines[1].points;  // Through the origin.
        (pencil.id == "L1" ? observations.frame.x_axis : observations.frame.y_axis) =
            Segment{line[0], line[1]};
      }
      const PoseEstimate estimate = SolveClosedForm(name, observations);
      ASSERT_TRUE(estimate.status.ok()) << estimate.status.message;
      const PoseHypothesis& h = estimate.hypotheses[0];
      const Eigen::Vector3d error =
          LogRotation(scene.pose.rotation * h.cam_from_world.rotation.transpose());
      nees += error.dot(h.Covariance().topLeftCorner<3, 3>().inverse() * error) / kTrials;
    }
    if (kSanitized) continue;
    EXPECT_NEAR(nees, 3.0, 0.5) << name;
  }
}

// What `name` needs, in a plane that is tilted by 20 to 70 degrees.
Observations RandomEvidence(const std::string& name, PlaneScene* scene) {
  Random& random = scene->random;
  const auto circle = [&](const char* id, double x, double y) {
    const double radius = random.Uniform(0.6, 1.4);
    return scene->Circle(id, x, y, radius, 20 + random.UniformInt(80));
  };
  Observations observations = scene->Empty();
  FrameObservation& frame = observations.frame;
  if (name == "parallel_circles") {
    observations.circles = {circle("c0", 1.2, 0.4), circle("c1", -1.3, 0.3)};
  } else if (name == "concentric_circles") {
    observations.circles = {circle("c0", 0.2, 0.4), circle("c1", 0.2, 0.4)};
    for (CircleObservation& c : observations.circles) c.concentric = "g";
  } else if (name.find("circle") != std::string::npos) {
    observations.circles = {circle("c0", 0.2, 0.4)};
    if (name == "circle_center") observations.circles[0].center = scene->Pixel(0.2, 0.4);
    const auto chord = [&](double x, double y) {
      return Segment{scene->Pixel(0.2 - x, 0.4 - y), scene->Pixel(0.2 + x, 0.4 + y)};
    };
    observations.circles[0].diameters = {chord(0.5, 0.1), chord(-0.3, 0.4), chord(0.0, 0.5)};
    if (name != "single_circle") frame.x_axis = Segment{scene->Pixel(0, 0), scene->Pixel(2, 0)};
    if (name == "circle_frame") frame.y_axis = Segment{scene->Pixel(0, 0), scene->Pixel(0, 2)};
  } else {
    const int points = random.UniformInt(2) == 0 ? 2 : 30;
    observations.pencils = {scene->Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX(),
                                          2 + random.UniformInt(4), points),
                            scene->Pencil("L2", PencilDirection::kY, Eigen::Vector3d::UnitY(),
                                          2 + random.UniformInt(4), points)};
  }
  return observations;
}

// Squared error of the hypothesis nearest to the truth, in standard deviations, over its dimension:
// of the rotation, or where that is free, of the normal.
double NeesOfRotation(const PoseEstimate& estimate, const PlaneScene& scene) {
  double smallest = std::numeric_limits<double>::infinity(), nees = 0.0;
  for (const PoseHypothesis& h : estimate.hypotheses) {
    const int rank = h.RotationIsFree() ? 2 : 3;
    for (int senses = 0; senses < 4; ++senses) {
      const double x = (senses & 1) != 0 ? -1.0 : 1.0, y = (senses & 2) != 0 ? -1.0 : 1.0;
      const Eigen::Matrix3d truth = scene.pose.rotation * Eigen::Vector3d(x, y, x * y).asDiagonal();
      const Eigen::Vector3d normal = h.cam_from_world.rotation.col(2);
      const Eigen::Vector3d error =
          rank == 2 ? Eigen::Vector3d(normal.cross(truth.col(2)))
                    : LogRotation(truth * h.cam_from_world.rotation.transpose());
      if (!(error.norm() < smallest) || !(normal.dot(truth.col(2)) > 0.0)) continue;
      smallest = error.norm();
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(
          Eigen::Matrix3d(h.Covariance().topLeftCorner<3, 3>()));
      const Eigen::Vector3d along = eigen.eigenvectors().transpose() * error;
      nees = (along.array().square() / eigen.eigenvalues().array()).tail(rank).sum() / rank;
    }
  }
  return nees;
}

TEST(ClosedFormCovarianceTest, CovariancesAreHonestOnRandomScenes) {
  constexpr int kTrials = Trials(300);
  for (const char* name :
       {"orthogonal_vanishing_points", "line_pairs", "single_circle", "circle_center",
        "circle_diameters", "concentric_circles", "parallel_circles", "circle_frame"}) {
    for (const double sigma_px : {0.1, 0.5, 1.0}) {
      double nees = 0.0;
      for (int i = 0; i < kTrials; ++i) {
        Random random(static_cast<std::uint64_t>(i));
        PlaneScene scene(random.Uniform(0.35, 1.2), sigma_px, static_cast<std::uint64_t>(i));
        const Observations observations = RandomEvidence(name, &scene);
        const PoseEstimate estimate =
            SolveClosedForm(name, observations, NoiseModel::Exact(), sigma_px);
        ASSERT_TRUE(estimate.status.ok()) << estimate.status.message;
        nees += NeesOfRotation(estimate, scene) / kTrials;
      }
      if (kSanitized) continue;
      // Two directions whose angle is known are chosen among several by their cost, which makes
      // them better than each.
      EXPECT_GT(nees, 0.85) << name << ' ' << sigma_px;
      EXPECT_LT(nees, 1.15) << name << ' ' << sigma_px;
    }
  }
}

TEST(ClosedFormCovarianceTest, TheNoiseModelIsInTheCovariance) {
  PlaneScene scene(0.7, 0.01);
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("c0", 0.0, 0.0, 1.0, 200)};
  observations.circles[0].radius = 1.0;
  observations.pencils = {AlongX(&scene, 5, 30), AlongY(&scene, 5, 30)};
  const auto covariance = [&](const char* name, const NoiseModel& noise) -> Matrix6d {
    const PoseEstimate estimate = SolveClosedForm(name, observations, noise);
    EXPECT_TRUE(estimate.status.ok()) << estimate.status.message;
    return estimate.hypotheses[0].Covariance();
  };

  // A tilt of the circle is one of the normal.
  NoiseModel noise = NoiseModel::Exact();
  noise.circle_tilt_rad = 0.02;
  const PoseHypothesis circle = SolveClosedForm("single_circle", observations, noise).hypotheses[0];
  const Eigen::Matrix3d tilted = circle.Covariance().topLeftCorner<3, 3>();
  const Eigen::Vector3d normal = circle.cam_from_world.rotation.col(2);
  EXPECT_NEAR(tilted.trace(), 2.0 * 0.02 * 0.02, 2e-5);
  EXPECT_NEAR(normal.dot(tilted * normal), 0.0, 1e-6);

  // So is an oval: the ratio cos(t) of the axes changes by 2 cos(t), and by as much between them.
  noise = NoiseModel::Exact();
  noise.circle_shape = 0.01;
  noise.spread = 0.0;
  const PoseHypothesis oval = SolveClosedForm("single_circle", observations, noise).hypotheses[0];
  const double c = std::abs(normal.dot(oval.cam_from_world.translation.normalized()));
  const double turn = 2.0 * noise.circle_shape * c / std::sqrt(1.0 - c * c);
  EXPECT_NEAR((oval.Covariance().topLeftCorner<3, 3>().trace()), 2.0 * turn * turn,
              0.1 * turn * turn);

  // Of the mean of two orthogonal directions: each leans by itself, and both turn.
  noise = NoiseModel::Exact();
  noise.pencil_axis_rad = 0.01;
  // Lines far apart are of walls that lean in their own ways, which turns a direction by more.
  const Matrix6d apart = covariance("orthogonal_vanishing_points", noise);
  FitDirect(0.01, &observations);
  const Observations with_lines = observations;
  for (PencilObservation& pencil : observations.pencils) pencil.lines.clear();
  const Matrix6d leaning = covariance("orthogonal_vanishing_points", noise);
  EXPECT_NEAR((leaning.topLeftCorner<3, 3>().trace()), 2.5 * kLeaning * kLeaning * 1e-4, 0.6e-4);
  EXPECT_GT((apart.topLeftCorner<3, 3>().trace()), (leaning.topLeftCorner<3, 3>().trace()));
  observations = with_lines;
  EXPECT_LT(covariance("orthogonal_vanishing_points", NoiseModel::Exact()).trace(), 1e-5);

  // The distance follows the focal length, and the direction to the centre the principal point.
  noise = NoiseModel::Exact();
  noise.camera.log_focal = 0.1;
  const Eigen::Vector3d ray = scene.pose.translation.normalized();
  const Eigen::Matrix3d far = covariance("single_circle", noise).bottomRightCorner<3, 3>();
  EXPECT_NEAR(std::sqrt(ray.dot(far * ray)) / scene.pose.translation.norm(), 0.1, 0.02);
  noise = NoiseModel::Exact();
  noise.camera.principal_point_px = 10.0;
  const Eigen::Matrix3d beside = covariance("single_circle", noise).bottomRightCorner<3, 3>();
  EXPECT_NEAR(std::sqrt(beside.trace() / 2.0) / scene.pose.translation.norm(), 10.0 / 605.0, 2e-3);

  // A circle that is 1 % larger is 1 % nearer; one whose contour has grown, too.
  noise = NoiseModel::Exact();
  noise.radius = 0.01;
  const Eigen::Matrix3d scaled = covariance("single_circle", noise).bottomRightCorner<3, 3>();
  EXPECT_NEAR(std::sqrt(scaled.trace()) / scene.pose.translation.norm(), 0.01, 5e-4);
  noise = NoiseModel::Exact();
  noise.contour_offset_px = 1.0;
  const Eigen::Matrix3d grown = covariance("single_circle", noise).bottomRightCorner<3, 3>();
  EXPECT_NEAR(std::sqrt(ray.dot(grown * ray)) / scene.pose.translation.norm(), 1.0 / 60.0, 5e-3);

  noise = NoiseModel();
  noise.contour_px = -1.0;
  EXPECT_EQ(SolveClosedForm("single_circle", observations, noise).status.code,
            StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace circline
