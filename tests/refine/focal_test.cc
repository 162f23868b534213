// The focal length as an unknown with a prior: on the bound that counts it in, corrected where the
// evidence shows it, and left to the prior, with a sentence, where not.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "circline/refine/estimate_pose.h"
#include "tests/plane_scene.h"
#include "tests/refine/simulated_options.h"
#include "tests/trials.h"

namespace circline {
namespace {

using Matrix4d = Eigen::Matrix4d;
using Vector4d = Eigen::Vector4d;

constexpr double kPrior = 0.03;

CameraSigma FocalSigma(double log_focal) {
  CameraSigma sigma = CameraSigma::Exact();
  sigma.log_focal = log_focal;
  return sigma;
}

EstimationOptions WithFocal(LossType loss = LossType::kTrivial) {
  EstimationOptions options = Exact(loss);
  options.camera_sigma = FocalSigma(kPrior);
  return options;
}

// The camera that is given instead of the true one.
void Mistake(double relative, Observations* observations) {
  observations->camera.fx *= relative;
  observations->camera.fy *= relative;
}

// Rotation and logarithm of the focal length: their error, in standard deviations squared.
double Nees(const PoseHypothesis& h, const Vector4d& error) {
  Matrix4d covariance;
  const Eigen::Matrix<double, 6, 1> cross =
      Eigen::Map<const Eigen::Matrix<double, 6, 1>>(h.focal_covariance.data()) / h.focal_scale;
  covariance.topLeftCorner<3, 3>() = h.Covariance().topLeftCorner<3, 3>();
  covariance.topRightCorner<3, 1>() = cross.head<3>();
  covariance.bottomLeftCorner<1, 3>() = cross.head<3>().transpose();
  covariance(3, 3) = std::pow(h.focal_sigma / h.focal_scale, 2);
  return error.dot(covariance.inverse() * error);
}

Vector4d Error(const PoseHypothesis& h, const PlaneScene& scene, double mistake) {
  Vector4d error;
  error.head<3>() = LogRotation(scene.pose.rotation * h.cam_from_world.rotation.transpose());
  error[3] = -std::log(mistake * h.focal_scale);
  return error;
}

// Two pencils known to be orthogonal, oriented by axes along their first lines.
Observations Grid(PlaneScene* scene) {
  Observations observations = scene->Empty();
  observations.pencils = {scene->Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX(), 5, 9),
                          scene->Pencil("L2", PencilDirection::kY, Eigen::Vector3d::UnitY(), 5, 9)};
  const auto axis = [](const LineObservation& line) {
    return Segment{line.points.front(), line.points.back()};
  };
  observations.frame.x_axis = axis(observations.pencils[0].lines[2]);
  observations.frame.y_axis = axis(observations.pencils[1].lines[2]);
  return observations;
}

// Information of rotation and log focal length in exact lines n along d: n . d = 0, of variance d^T
// Cov(n) d. A focal length longer by e takes n to (n1, n2, (1 - e) n3) where there is no lens.
Matrix4d Information(const PlaneScene& exact, double sigma_px) {
  PlaneScene scene = exact;
  Observations observations = Grid(&scene);
  for (PencilObservation& pencil : observations.pencils) pencil.sigma_px = sigma_px;
  FitDirect(sigma_px, &observations);
  Matrix4d information = Matrix4d::Zero();
  information(3, 3) = 1.0 / (kPrior * kPrior);
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector3d d = scene.pose.rotation.col(k);
    const PencilObservation& pencil = observations.pencils[static_cast<std::size_t>(k)];
    for (const LineObservation& line : pencil.lines) {
      const Eigen::Vector3d n = line.fit->line;
      Vector4d j;
      j << d.cross(n), -n.z() * d.z();
      information += j * j.transpose() / d.dot(line.fit->covariance * d);
    }
  }
  return information;
}

TEST(FocalTest, GridsSitOnTheBoundOfRotationAndFocalLength) {
  constexpr int kTrials = Trials(600);
  constexpr double kSigmaPx = 0.2;
  Random random(9);
  double rotation = 0.0, focal = 0.0, nees = 0.0;
  const auto pinhole = [](PlaneScene* scene) {
    scene->camera.model = CameraModel::kPinhole;
    scene->camera.distortion = {};
  };
  PlaneScene exact(0.8, 0.0);
  pinhole(&exact);
  // The frame's axes are lines of the pencils; that both meet the origin says nothing of these.
  const Matrix4d bound = Information(exact, kSigmaPx).inverse();
  for (int i = 0; i < kTrials; ++i) {
    PlaneScene scene(0.8, kSigmaPx, static_cast<std::uint64_t>(i + 1));
    pinhole(&scene);
    Observations observations = Grid(&scene);
    const double mistake = std::exp(kPrior * random.Normal());
    Mistake(mistake, &observations);
    const PoseHypothesis best = Best(EstimatePose(observations, WithFocal()));
    const Vector4d error = Error(best, scene, mistake);
    rotation += error.head<3>().squaredNorm() / kTrials;
    focal += error[3] * error[3] / kTrials;
    nees += Nees(best, error) / kTrials;
  }
  if (kSanitized) return;
  const double rotation_ratio = std::sqrt(rotation / bound.topLeftCorner<3, 3>().trace());
  const double focal_ratio = std::sqrt(focal / bound(3, 3));
  std::printf(
      "grid: rotation %.3f of its bound, focal length %.3f of its bound (%.4f), NEES %.2f\n",
      rotation_ratio, focal_ratio, std::sqrt(bound(3, 3)), nees);
  // 600 trials: the rms of one number scatters by 3 %, the mean NEES of four by 0.12.
  EXPECT_LT(std::sqrt(bound(3, 3)), 0.5 * kPrior);  // Or the prior would decide.
  EXPECT_NEAR(rotation_ratio, 1.0, 0.10);
  EXPECT_NEAR(focal_ratio, 1.0, 0.12);
  EXPECT_NEAR(nees, 4.0, 0.5);
}

// A camera whose focal length is off by 3 %, of every model: pencils and rings each show it.
class WrongFocalTest : public ::testing::TestWithParam<CameraModel> {
 protected:
  void Check(const char* name, Observations (*observe)(PlaneScene*)) {
    constexpr int kTrials = Trials(60);
    constexpr double kMistake = 1.03;
    double squares = 0.0, worst = 0.0, fixed_angle = 0.0, angle = 0.0, sigma = 0.0;
    for (int i = 0; i < kTrials; ++i) {
      PlaneScene scene(0.8, 0.1, static_cast<std::uint64_t>(i + 1));
      scene.camera.model = GetParam();
      if (GetParam() == CameraModel::kFisheye) scene.camera.distortion = {0.02, -0.01, 0.0, 0.0};
      if (GetParam() == CameraModel::kPinhole) scene.camera.distortion = {};
      Observations observations = observe(&scene);
      Mistake(kMistake, &observations);
      const PoseEstimate estimate = Ok(EstimatePose(observations, WithFocal()));
      const PoseHypothesis& best = estimate.hypotheses[0];
      const double error =
          std::log(kMistake * best.focal_scale) / (best.focal_sigma / best.focal_scale);
      squares += error * error / kTrials;
      worst = std::max(worst, std::abs(error));
      sigma += best.focal_sigma / kTrials;
      angle += NormalError(best, scene) / kTrials;
      EstimationOptions fixed = WithFocal();
      fixed.camera_sigma = CameraSigma::Exact();
      const PoseEstimate stubborn = EstimatePose(observations, fixed);
      fixed_angle += NormalError(stubborn.hypotheses[0], scene) / kTrials;
      ASSERT_FALSE(estimate.notes.empty());
      EXPECT_NE(estimate.notes.back().find("focal length"), std::string::npos);
    }
    if (kSanitized) return;
    std::printf(
        "%s: focal length 3 %% wrong, found to +- %.4f; rms %.2f sigma, worst %.1f; normal "
        "off by %.5f rad, with the wrong one %.5f\n",
        name, sigma, std::sqrt(squares), worst, angle, fixed_angle);
    EXPECT_LT(sigma, 0.3 * kPrior);
    EXPECT_LT(std::sqrt(squares), 1.35);  // 60 trials: 1 +- 0.09; the prior is off by one sigma.
    EXPECT_GT(std::sqrt(squares), 0.65);
    EXPECT_LT(angle, fixed_angle);
  }
};

TEST_P(WrongFocalTest, PencilsShowIt) { Check("grid", Grid); }

TEST_P(WrongFocalTest, RingsShowIt) {
  Check("rings", [](PlaneScene* scene) {
    Observations observations = scene->Empty();
    observations.circles = {scene->Circle("outer", 0.2, 0.1, 3.0, 200),
                            scene->Circle("inner", 0.2, 0.1, 1.5, 200)};
    for (CircleObservation& circle : observations.circles) circle.concentric = "g0";
    return observations;
  });
}

INSTANTIATE_TEST_SUITE_P(Cameras, WrongFocalTest,
                         ::testing::Values(CameraModel::kPinhole, CameraModel::kOpenCV,
                                           CameraModel::kFisheye));

TEST(FocalTest, OneCircleLeavesItToThePrior) {
  PlaneScene scene(0.7, 0.1);
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("c0", 0.5, 0.2, 1.0)};
  const PoseEstimate estimate = Ok(EstimatePose(observations, WithFocal()));
  for (const PoseHypothesis& h : estimate.hypotheses) {
    EXPECT_NEAR(h.focal_scale, 1.0, 1e-3);
    EXPECT_NEAR(h.focal_sigma, kPrior, 0.01 * kPrior);
  }
  ASSERT_FALSE(estimate.notes.empty());
  EXPECT_NE(estimate.notes.back().find("the prior alone decides"), std::string::npos);
  // What the focal length leaves open is in the pose's covariance.
  EstimationOptions fixed = WithFocal();
  fixed.camera_sigma = CameraSigma::Exact();
  const PoseEstimate known = EstimatePose(observations, fixed);
  EXPECT_EQ(known.hypotheses[0].focal_scale, 1.0);
  EXPECT_EQ(known.hypotheses[0].focal_sigma, 0.0);
  EXPECT_GT(estimate.hypotheses[0].Covariance().trace(),
            1.5 * known.hypotheses[0].Covariance().trace());
}

// A figure that one camera in ten invents: believed where nothing speaks against it, given up where
// the evidence does, and then the answer is no surer than the evidence.
TEST(FocalTest, DoubtfulFigureIsGivenUp) {
  for (const double mistake : {1.0, 1.5}) {
    PlaneScene scene(0.8, 0.2, 3);
    Observations observations = Grid(&scene);
    Mistake(mistake, &observations);
    EstimationOptions options = WithFocal();
    options.camera_sigma->log_focal = 0.05;
    options.camera_sigma->doubtful_log_focal = 0.5;
    const PoseEstimate doubted = EstimatePose(observations, options);
    options.camera_sigma->log_focal = 0.5;
    options.camera_sigma->doubtful_log_focal = 0.0;
    const PoseEstimate open = EstimatePose(observations, options);
    ASSERT_TRUE(doubted.status.ok() && open.status.ok());
    const PoseHypothesis &best = doubted.hypotheses[0], &free = open.hypotheses[0];
    EXPECT_NEAR(mistake * best.focal_scale, 1.0, 3.0 * free.focal_sigma) << mistake;
    // Near the figure both speak, far from it the evidence alone.
    const double precision =
        1.0 / std::pow(free.focal_sigma / free.focal_scale, 2) + (mistake > 1.0 ? 0.0 : 400.0);
    EXPECT_NEAR(best.focal_sigma / best.focal_scale, 1.0 / std::sqrt(precision),
                0.05 / std::sqrt(precision))
        << mistake;
    EXPECT_EQ(HasNote(doubted, "is a placeholder"), mistake > 1.0);
  }
}

// Outliers do not keep it from being found.
TEST(FocalTest, RobustLossesFindIt) {
  for (const LossType loss : {LossType::kCauchy, LossType::kTukey}) {
    PlaneScene scene(0.8, 0.1, 5);
    Observations observations = Grid(&scene);
    Mistake(0.97, &observations);
    for (PencilObservation& pencil : observations.pencils) {
      for (LineObservation& line : pencil.lines) {
        line.points[4] += Eigen::Vector2d(12.0, 15.0);
        line.inliers.assign(line.points.size(), 1);  // As a robust fit marks them.
        line.inliers[4] = 0;
      }
    }
    const PoseHypothesis best = Best(EstimatePose(observations, WithFocal(loss)));
    EXPECT_NEAR(best.focal_scale, 1.0 / 0.97, 3.0 * best.focal_sigma) << LossName(loss);
    EXPECT_LT(best.focal_sigma, 0.3 * kPrior) << LossName(loss);
  }
}

// Whatever can and cannot be told of it: finite, positive and within the prior's reach.
TEST(FocalTest, PoorEvidenceStaysFinite) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
                        z = Eigen::Vector3d::UnitZ();
  Random random(5);
  for (int i = 0; i < 120; ++i) {
    const double tilt = random.Uniform(0.05, 1.35), noise_px = random.Uniform();
    PlaneScene scene(tilt, noise_px, static_cast<std::uint64_t>(i + 1));
    Observations observations = scene.Empty();
    if (i % 4 == 0) {
      observations.circles = {scene.Circle("a", 0.4, -0.3, 1.0)};
      observations.circles[0].center = scene.Pixel(0.0, 0.0);  // Not where it is.
    } else if (i % 4 == 1) {
      observations.pencils = {scene.Pencil("1", PencilDirection::kX, x, 2),
                              scene.Pencil("2", PencilDirection::kFree, y, 2)};
    } else if (i % 4 == 2) {
      observations.pencils = {scene.Pencil("1", PencilDirection::kX, x),
                              scene.Pencil("2", PencilDirection::kZ, z)};
    } else {
      observations.circles = {scene.Circle("a", -1.0, 0.0, 1.0), scene.Circle("b", 1.5, 0.5, 0.6)};
    }
    if (i % 3 == 0) {
      for (CircleObservation& circle : observations.circles) circle.sigma_px = 0.0;
      for (PencilObservation& pencil : observations.pencils) pencil.sigma_px = 0.0;
    }
    Mistake(1.02, &observations);
    const PoseEstimate estimate =
        EstimatePose(observations, WithFocal(i % 5 < 3 ? LossType::kCauchy : LossType::kTukey));
    ASSERT_TRUE(estimate.status.ok()) << i << ": " << estimate.status.message;
    for (const PoseHypothesis& h : estimate.hypotheses) {
      EXPECT_TRUE(h.Covariance().allFinite()) << i;
      EXPECT_LT(std::abs(std::log(h.focal_scale)), 4.001 * kPrior) << i;
      EXPECT_GT(h.focal_sigma, 0.0) << i;
      EXPECT_LT(h.focal_sigma, 1.001 * kPrior * h.focal_scale) << i;
    }
  }
}

// A circle near the rim of what the lens can image, of which shorter focal lengths would lose
// points or all: it stays in the problem, whole.
TEST(FocalTest, PointsAtTheLensRimAreKept) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    PlaneScene scene(0.8, 0.5, seed);
    scene.camera.fx = scene.camera.fy = 420.0;
    scene.camera.distortion = {-0.45, 0.0, 0.0, 0.0, 0.0};  // One-to-one up to 241 px.
    Observations observations = Grid(&scene);
    observations.circles = {scene.Circle("rim", 0.0, 5.4, 0.4, 30),
                            scene.Circle("middle", 0.3, 0.2, 1.0)};
    Mistake(1.03, &observations);
    EstimationOptions options = Exact();
    options.camera_sigma = FocalSigma(0.1);
    const PoseHypothesis best = Best(EstimatePose(observations, options));
    EXPECT_EQ(best.num_observations, 30 + 60 + 2 * 5 * 9);
    EXPECT_LT(NormalError(best, scene), 0.03) << seed;
    EXPECT_NEAR(1.03 * best.focal_scale, 1.0, 0.1) << seed;
  }
}

TEST(FocalTest, SigmaIsChecked) {
  EstimationOptions options;
  options.camera_sigma = FocalSigma(-0.1);
  EXPECT_NE(options.Validate().message.find("log_focal"), std::string::npos);
  options.camera_sigma = FocalSigma(2.0);  // As wide as anybody likes.
  EXPECT_TRUE(options.Validate().ok());
}

}  // namespace
}  // namespace circline
