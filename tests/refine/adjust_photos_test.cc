// Many photos: the camera comes out on its stated uncertainty, whatever is known of the layout;
// what contradicts the rest is left out; what the photos cannot tell is said.
#include "circline/refine/adjust_photos.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "circline/refine/many/adjustment.h"
#include "tests/plane_scene.h"
#include "tests/refine/simulated_options.h"
#include "tests/sheet_photos.h"
#include "tests/trials.h"

namespace circline {
namespace {

TEST(AdjustPhotos, CameraComesOutWithinItsSigma) {
  const int trials = Trials(20);
  for (const RigidWorld rigid : {RigidWorld::kAuto, RigidWorld::kNo}) {
    double sum = 0.0;
    for (int trial = 0; trial < trials; ++trial) {
      const Photos sheet = Photos(6, static_cast<std::uint64_t>(10 + trial)).WithCircles();
      AdjustOptions options = PointNoiseOnly();
      options.rigid = rigid;
      const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, options));
      EXPECT_EQ(adjusted.rigid, rigid == RigidWorld::kAuto);
      const AdjustedCamera& made = adjusted.cameras.front();
      EXPECT_EQ(made.num_photos, 6);
      EXPECT_LT(std::abs(made.camera.fx / sheet.truth().fx - 1.0), 0.02);
      sum += CameraNees(made, sheet.truth());
    }
    if (kSanitized) continue;
    EXPECT_GT(sum / trials, 0.6) << RigidWorldName(rigid);  // 0.68 to 1.38 in 95 % of runs.
    EXPECT_LT(sum / trials, 1.45) << RigidWorldName(rigid);
  }
}

// Of each contour the lens's unknowns together can bend what they cannot tell from noise, and no
// more: it fits as well as is expected, and nothing is scaled.
TEST(AdjustPhotos, AWholeLensFitsAsWellAsIsExpected) {
  for (const CameraModel model : {CameraModel::kOpenCV, CameraModel::kFisheye}) {
    AdjustOptions options;
    options.noise_model = NoiseModel::Exact();
    if (model == CameraModel::kFisheye) options.num_radial = 2;
    const AdjustedPhotos adjusted =
        AdjustPhotos(Photos(6, 3, 0.6, model).WithCircles().photos, options);
    ASSERT_TRUE(adjusted.status.ok() && adjusted.rigid) << adjusted.status.message;
    for (const AdjustedPhoto& photo : adjusted.photos) {
      EXPECT_GT(photo.misfit, 0.3) << static_cast<int>(model);
      EXPECT_LT(photo.misfit, 2.0) << static_cast<int>(model);
    }
  }
}

// Dots so small that they lie a radius and more from where each photo alone has them.
TEST(AdjustPhotos, SmallDotsFarApartShareAWorld) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Photos sheet = Photos(6, seed).WithCircles(0.06);
    const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, PointNoiseOnly()));
    EXPECT_TRUE(adjusted.rigid) << seed;
    EXPECT_LT(std::abs(adjusted.cameras[0].camera.fx / sheet.truth().fx - 1.0), 0.02) << seed;
  }
}

TEST(AdjustPhotos, OneWorldSaysMoreThanOneForEachPhoto) {
  const Photos sheet = Photos(6).WithCircles();
  AdjustOptions options = PointNoiseOnly();
  const AdjustedPhotos together = AdjustPhotos(sheet.photos, options);
  options.rigid = RigidWorld::kNo;
  const AdjustedPhotos apart = AdjustPhotos(sheet.photos, options);
  ASSERT_TRUE(together.status.ok() && apart.status.ok());
  EXPECT_LT(together.cameras[0].Sigma(0), 0.7 * apart.cameras[0].Sigma(0));
}

// The truth in the frame that the first photo holds: its origin, unit and turn.
CameraPose InFrameOf(const CameraPose& truth, const CameraPose& first_truth,
                     const CameraPose& first) {
  const Eigen::Vector3d ray = first.translation.normalized(), n = first_truth.rotation.col(2);
  const double distance = n.dot(first_truth.translation) / n.dot(ray);
  const Eigen::Vector3d origin =
      first_truth.rotation.transpose() * (distance * ray - first_truth.translation);
  double turn = 0.0;
  const auto turned = [&](const CameraPose& pose) -> Eigen::Matrix3d {
    return pose.rotation * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  };
  for (int k = 0; k < 20; ++k)
    turn -= LogRotation(first.rotation.transpose() * turned(first_truth)).z();
  const double scale = first.translation.norm() / distance;
  return {turned(truth), scale * (truth.rotation * origin + truth.translation)};
}

TEST(AdjustPhotos, PosesComeOutWithinTheirCovariance) {
  const int trials = Trials(12);
  double sum = 0.0;
  int count = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const Photos sheet = Photos(5, static_cast<std::uint64_t>(50 + trial)).WithCircles();
    const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, PointNoiseOnly()));
    std::size_t first = 0;  // Held: its translation has no variance.
    while (first < 4 && adjusted.photos[first].covariance[35] > 0.0) ++first;
    for (std::size_t i = 0; i < adjusted.photos.size(); ++i) {
      const AdjustedPhoto& photo = adjusted.photos[i];
      const CameraPose truth =
          InFrameOf(sheet.poses[i], sheet.poses[first], adjusted.photos[first].cam_from_world);
      Vector6d error;
      error << LogRotation(truth.rotation * photo.cam_from_world.rotation.transpose()),
          truth.translation - photo.cam_from_world.translation;
      const Eigen::Map<const Matrix6d> covariance(photo.covariance.data());
      if (i == first) continue;
      sum += error.dot(covariance.llt().solve(error)) / 6.0;
      ++count;
    }
  }
  if (kSanitized) return;
  EXPECT_GT(sum / count, 0.75);
  EXPECT_LT(sum / count, 1.35);
}

// Ids that mean nothing: the circles are the same where they lie alike.
TEST(AdjustPhotos, CirclesAreMatchedByHowTheyLie) {
  Photos sheet = Photos(6).WithCircles();
  const AdjustedPhotos named = AdjustPhotos(sheet.photos, PointNoiseOnly());
  for (std::size_t i = 0; i < sheet.photos.size(); ++i) {
    std::vector<CircleObservation>& circles = sheet.photos[i].circles;
    for (std::size_t k = 0; k < circles.size(); ++k)
      circles[k].id = "d" + std::to_string((k * 4 + i) % circles.size());
  }
  const AdjustedPhotos found = AdjustPhotos(sheet.photos, PointNoiseOnly());
  ASSERT_TRUE(named.status.ok() && found.status.ok());
  EXPECT_TRUE(found.rigid);
  EXPECT_EQ(found.circles.size(), 9U);
  EXPECT_NEAR(found.cameras[0].camera.fx, named.cameras[0].camera.fx, 1e-2);
  EXPECT_NEAR(found.cameras[0].Sigma(0), named.cameras[0].Sigma(0), 1e-5);

  // Pencils are then each photo's own.
  sheet.WithPencils();
  const AdjustedPhotos with_pencils = Ok(AdjustPhotos(sheet.photos, PointNoiseOnly()));
  EXPECT_EQ(with_pencils.directions.size(), 12U);
  for (const AdjustedDirection& direction : with_pencils.directions)
    EXPECT_EQ(direction.id.find(std::to_string(direction.photo) + ":"), 0U) << direction.id;
}

TEST(AdjustPhotos, RowsAndColumnsOfUnknownSpacingSuffice) {
  const Photos board = Photos(8).WithPencils();
  const AdjustedPhotos adjusted = Ok(AdjustPhotos(board.photos, PointNoiseOnly()));
  const AdjustedCamera& made = adjusted.cameras.front();
  EXPECT_LT(std::abs(std::log(made.camera.fx / board.truth().fx)), 4.0 * made.Sigma(0));
  EXPECT_LT(made.Sigma(0), 0.02);
}

TEST(AdjustPhotos, AKnownRadiusMakesItMetric) {
  Photos sheet = Photos(5).WithCircles();
  sheet.photos[3].circles[4].radius = 0.05;  // A tenth; one photo says so.
  const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, PointNoiseOnly()));
  EXPECT_TRUE(adjusted.metric);
  for (std::size_t i = 0; i < sheet.photos.size(); ++i) {
    // Up to where the world lies in the plane: the camera's height over it.
    const CameraPose& pose = adjusted.photos[i].cam_from_world;
    const CameraPose& truth = sheet.poses[i];
    const double height = pose.rotation.col(2).dot(pose.translation);
    EXPECT_NEAR(std::abs(height), 0.1 * std::abs(truth.rotation.col(2).dot(truth.translation)),
                0.01);
  }
}

// The length of a translation, relative.
double ScaleSigma(const AdjustedPhoto& photo) {
  const Eigen::Vector3d t = photo.cam_from_world.translation;
  const Eigen::Map<const Matrix6d> covariance(photo.covariance.data());
  return std::sqrt(t.dot(covariance.bottomRightCorner<3, 3>() * t)) / t.squaredNorm();
}

TEST(AdjustPhotos, ARadiusIsAsWellKnownAsByTheBestStatement) {
  for (const auto& [first, second] : {std::pair(0.1, 0.01), {0.01, 0.1}, {0.01, 0.0}}) {
    Photos sheet = Photos(4).WithCircles();
    for (const std::size_t photo : {0U, 1U}) sheet.photos[photo].circles[4].radius = 0.5;
    sheet.photos[0].circles[4].radius_sigma = first;
    sheet.photos[1].circles[4].radius_sigma = second;
    AdjustOptions options = PointNoiseOnly();
    options.noise_model.radius = 0.001;  // Of those who state none.
    const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, options));
    EXPECT_NEAR(ScaleSigma(adjusted.photos[0]), 0.01, 0.003) << first << ' ' << second;
  }
}

TEST(AdjustPhotos, DifferentRadiiOfOneCircleAreRefused) {
  Photos sheet = Photos(4).WithCircles();
  sheet.photos[0].circles[4].radius = 0.5;
  sheet.photos[2].circles[4].radius = 0.25;
  const Status status = AdjustPhotos(sheet.photos, PointNoiseOnly()).status;
  EXPECT_FALSE(status.ok());
  EXPECT_NE(status.message.find("'c4'"), std::string::npos) << status.message;
}

// Each photo alone has led fits to another camera; known beforehand is one.
TEST(AdjustPhotos, SetsCamerasThatFitsFoundBack) {
  const Photos sheet = Photos(5).WithCircles();
  const AdjustedPhotos expected = Ok(AdjustPhotos(sheet.photos, PointNoiseOnly()));
  std::vector<Observations> found = sheet.photos;
  for (std::size_t i = 0; i < found.size(); ++i) {
    Camera& camera = found[i].camera;
    found[i].stated_focal_px = camera.fx;
    found[i].found_k1 = -0.03 * static_cast<double>(i);
    camera.fx *= 0.6 + 0.1 * static_cast<double>(i);
    camera.fy *= 0.6 + 0.1 * static_cast<double>(i);
    camera.distortion[0] += found[i].found_k1;
  }
  const AdjustedPhotos adjusted = Ok(AdjustPhotos(found, PointNoiseOnly()));
  EXPECT_NEAR(adjusted.cameras[0].camera.fx, expected.cameras[0].camera.fx, 1e-3);
  EXPECT_NEAR(adjusted.cameras[0].Sigma(0), expected.cameras[0].Sigma(0), 1e-6);
}

TEST(AdjustPhotos, AGrossPhotoIsLeftOutAndNamed) {
  Photos sheet = Photos(8).WithCircles();
  for (CircleObservation& circle : sheet.photos[3].circles) {
    for (Eigen::Vector2d& pixel : circle.points) pixel.x() = 320.0 + 0.8 * (pixel.x() - 320.0);
  }
  const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, PointNoiseOnly()));
  for (std::size_t i = 0; i < sheet.photos.size(); ++i)
    EXPECT_EQ(adjusted.photos[i].status.ok(), i != 3) << i << adjusted.photos[i].status.message;
  EXPECT_NE(adjusted.photos[3].status.message, "");
  const AdjustedCamera& made = adjusted.cameras.front();
  EXPECT_LT(std::abs(std::log(made.camera.fx / sheet.truth().fx)), 4.0 * made.Sigma(0));
}

TEST(AdjustPhotos, FrontalPhotosDoNotTellTheFocalLength) {
  const Photos sheet = Photos(4, 1, 0.0).WithCircles();
  const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, PointNoiseOnly()));
  const std::vector<std::string>& unknown = adjusted.cameras.front().at_prior;
  EXPECT_NE(std::find(unknown.begin(), unknown.end(), "focal length"), unknown.end())
      << adjusted.cameras.front().Sigma(0);
}

TEST(AdjustPhotos, TwoCamerasAreTwo) {
  Photos sheet = Photos(5).WithCircles(), other = Photos(5, 2).WithCircles();
  for (Observations& photo : other.photos) {
    photo.camera.id = "other";
    for (CircleObservation& circle : photo.circles) {
      for (Eigen::Vector2d& pixel : circle.points) pixel *= 1.5;  // A finer sensor.
    }
    photo.camera.width = 960;
    photo.camera.height = 720;
    photo.camera.cx *= 1.5;
    photo.camera.cy *= 1.5;
    sheet.photos.push_back(photo);
  }
  const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, PointNoiseOnly()));
  ASSERT_EQ(adjusted.cameras.size(), 2U);
  EXPECT_NEAR(adjusted.cameras[1].camera.fx / adjusted.cameras[0].camera.fx, 1.5, 0.01);
}

TEST(AdjustPhotos, RefusesInWords) {
  EXPECT_EQ(AdjustPhotos({}).status.code, StatusCode::kRefused);
  Photos sheet = Photos(3).WithCircles();
  sheet.photos[2].camera.cx += 1.0;  // The same id, another camera.
  const AdjustedPhotos two = AdjustPhotos(sheet.photos);
  EXPECT_EQ(two.status.code, StatusCode::kInvalidArgument);
  EXPECT_NE(two.status.message.find("'cam'"), std::string::npos);
  std::vector<Observations> empty = Photos(3).photos;
  EXPECT_EQ(AdjustPhotos(empty).status.code, StatusCode::kRefused);
  AdjustOptions options;
  options.num_threads = 0;
  EXPECT_EQ(AdjustPhotos(empty, options).status.code, StatusCode::kInvalidArgument);
  options = AdjustOptions();
  options.camera_sigma["cam1"] = CameraSigma();
  const Status unknown = AdjustPhotos(Photos(3).WithCircles().photos, options).status;
  EXPECT_EQ(unknown.code, StatusCode::kInvalidArgument);
  EXPECT_EQ(unknown.message, "camera_sigma: no photo has a camera 'cam1', only 'cam'");
}

TEST(AdjustPhotos, EveryCameraModelComesOutWithinItsSigma) {
  for (const CameraModel model : {CameraModel::kPinhole, CameraModel::kFisheye}) {
    const Photos sheet = Photos(6, 3, 0.6, model).WithCircles();
    const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, PointNoiseOnly()));
    const AdjustedCamera& made = adjusted.cameras.front();
    EXPECT_LT(std::abs(std::log(made.camera.fx / sheet.truth().fx)), 4.0 * made.Sigma(0));
    EXPECT_LT(std::abs(made.camera.cx - sheet.truth().cx), 4.0 * made.Sigma(2));
    EXPECT_LT(made.Sigma(0), 0.01);
    for (std::size_t k = 0; k < 2; ++k) {
      const double error = made.camera.distortion[k] - sheet.truth().distortion[k];
      EXPECT_LE(std::abs(error), 4.0 * made.Sigma(4 + static_cast<int>(k))) << k;
    }
    EXPECT_EQ(made.Sigma(4) > 0.0, model != CameraModel::kPinhole);
  }
}

// Of features that state no noise, as in a single photo.
TEST(AdjustPhotos, FitsTakeTheScaleThatIsGiven) {
  PlaneScene scene(0.6, 0.2);
  Observations photo = scene.Empty();
  photo.pencils = scene.Axes();
  for (PencilObservation& pencil : photo.pencils) pencil.sigma_px = 0.0;
  const auto trace = [&](double scale_px) {
    EstimationOptions options = Exact();
    options.line_loss.scale_px = scale_px;
    const Observations prepared = Prepare(photo, photo.camera, options);
    return prepared.pencils[0].lines[0].fit.value().covariance.trace();
  };
  EXPECT_NEAR(trace(2.0) / trace(1.0), 4.0, 1e-6);
}

TEST(AdjustPhotos, SameBitsWithAnyNumberOfThreads) {
  const Photos sheet = Photos(4).WithCircles();
  AdjustOptions options = PointNoiseOnly();
  const AdjustedPhotos a = AdjustPhotos(sheet.photos, options);
  options.num_threads = 3;
  const AdjustedPhotos b = AdjustPhotos(sheet.photos, options);
  ASSERT_TRUE(a.status.ok());
  EXPECT_EQ(a.cameras[0].camera.fx, b.cameras[0].camera.fx);
  EXPECT_EQ(a.cameras[0].covariance, b.cameras[0].covariance);
}

}  // namespace
}  // namespace circline
