// Sets of photos that a calibration had better not trust, or cannot tell much from.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <new>
#include <string>
#include <vector>

#include "circline/estimators/random.h"
#include "circline/refine/adjust_photos.h"
#include "circline/refine/many/adjustment.h"
#include "tests/basics.h"
#include "tests/refine/simulated_options.h"
#include "tests/sheet_photos.h"

namespace circline {
namespace {

TEST(ParallelFor, ThrowsWhatAThreadThrows) {
  for (const int threads : {1, 4}) {
    std::atomic<int> done{0};
    const auto work = [&](std::size_t i) {
      if (i == 10) throw std::bad_alloc();
      ++done;
    };
    EXPECT_THROW(ParallelFor(1000000, threads, work), std::bad_alloc);
    EXPECT_LT(done, 1000000);
    ParallelFor(10, threads, work);
    EXPECT_GE(done, 10);
  }
}

TEST(AdjustHard, OnePhotoIsAsGoodAsItsSigma) {
  const Photos sheet = Photos(1).WithCircles();
  const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, PointNoiseOnly()));
  EXPECT_FALSE(adjusted.rigid);
  const AdjustedCamera& made = adjusted.cameras.front();
  EXPECT_EQ(made.num_photos, 1);
  EXPECT_LT(std::abs(std::log(made.camera.fx / sheet.truth().fx)), 3.0 * made.Sigma(0));
}

// Every photo has circles of its own, elsewhere and of other sizes.
TEST(AdjustHard, PhotosThatShareNothingShareTheCamera) {
  Photos sheet = Photos(4).WithCircles();
  for (std::size_t i = 0; i < sheet.photos.size(); ++i) {
    std::vector<CircleObservation> own;
    for (std::size_t k = 0; k < 3; ++k) own.push_back(sheet.photos[i].circles[(2 * i + 3 * k) % 9]);
    for (CircleObservation& circle : own) circle.id += "_" + std::to_string(i);
    sheet.photos[i].circles = own;
  }
  AdjustOptions options = PointNoiseOnly();
  const AdjustedPhotos apart = Ok(AdjustPhotos(sheet.photos, options));
  EXPECT_FALSE(apart.rigid);
  EXPECT_EQ(apart.cameras[0].num_photos, 4);
  EXPECT_LT(std::abs(std::log(apart.cameras[0].camera.fx / sheet.truth().fx)),
            4.0 * apart.cameras[0].Sigma(0));
  options.rigid = RigidWorld::kYes;
  const AdjustedPhotos forced = AdjustPhotos(sheet.photos, options);
  ASSERT_TRUE(forced.status.ok());
  EXPECT_FALSE(forced.rigid);
  ASSERT_FALSE(forced.notes.empty());
  EXPECT_NE(forced.notes.front().find("share no circles"), std::string::npos);
}

// No photo sees the whole sheet, and some share no circle with each other.
TEST(AdjustHard, PhotosThatOverlapInPartAreOfOneWorld) {
  Photos sheet = Photos(6).WithCircles();
  for (std::size_t i = 0; i < sheet.photos.size(); ++i) {
    std::vector<CircleObservation> own;  // Two rows, or the one that the others do not share.
    for (std::size_t k = 0; k < 9; ++k) {
      if ((i % 2 == 0 ? k / 3 != 2 : k / 3 != 0)) own.push_back(sheet.photos[i].circles[k]);
    }
    sheet.photos[i].circles = own;
  }
  const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, PointNoiseOnly()));
  EXPECT_TRUE(adjusted.rigid);
  EXPECT_EQ(adjusted.circles.size(), 9U);
  EXPECT_EQ(adjusted.cameras[0].num_photos, 6);
}

// Its dots match wherever the lattice does, turned or shifted, and as many as are found in both:
// its mark says where.
TEST(AdjustHard, AMarkSaysHowABoardLies) {
  for (std::uint64_t seed = 4; seed <= 6; ++seed) {
    const Photos sheet = Photos(6, seed).WithMarkedBoard(seed);
    const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, PointNoiseOnly()));
    EXPECT_TRUE(adjusted.rigid);
    EXPECT_EQ(adjusted.circles.size(), 64U) << seed;
    for (std::size_t i = 0; i < sheet.poses.size(); ++i) {
      const auto turned_by = [&](const CameraPose& pose, const CameraPose& first) {
        return Eigen::Matrix3d(pose.rotation * first.rotation.transpose());
      };
      const Eigen::Matrix3d off =
          turned_by(adjusted.photos[i].cam_from_world, adjusted.photos[0].cam_from_world) *
          turned_by(sheet.poses[i], sheet.poses[0]).transpose();
      EXPECT_LT(Eigen::AngleAxisd(off).angle(), 0.02) << seed << " " << i;
    }
  }
}

// Through a camera that is a little off exact contours of one plane contradict each other by far.
TEST(AdjustHard, ExactContoursKeepTheirCircles) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const int count = 2 + static_cast<int>(seed % 3);
    const Photos sheet =
        Photos(count, seed, 0.3 + 0.03 * static_cast<double>(seed), CameraModel::kOpenCV, 0.002)
            .WithCircles();
    const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, PointNoiseOnly()));
    EXPECT_EQ(adjusted.circles.size(), 9U) << seed;
    EXPECT_NEAR(adjusted.cameras[0].camera.fx / sheet.truth().fx, 1.0, 0.01) << seed;
  }
}

// A camera that photos contradict is named.
// Right angles are not right through the camera that is started from: no line is left out for it.
TEST(AdjustHard, TwoPencilsStartThroughAnyFocalLength) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    PlaneScene scene(0.0, 0.3, seed);
    scene.camera.id = "cam";
    scene.camera.fy = scene.camera.fx;
    scene.camera.distortion = {-0.05};
    std::vector<Observations> photos;
    for (int i = 0; i < 5; ++i) {
      const double tilt = scene.random.Uniform(0.2, 1.0), about = scene.random.Uniform(0.0, 6.28);
      scene.pose.rotation = ExpRotation({tilt * std::cos(about), tilt * std::sin(about), 0.0}) *
                            ExpRotation({0.0, 0.0, scene.random.Uniform(0.0, 6.28)}) *
                            Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
      scene.pose.translation = {0.0, 0.0, 9.0};
      photos.push_back(scene.Empty());
      photos.back().pencils = scene.Axes(4, 20);
      // Half way between two that are tried.
      photos.back().camera.fx = photos.back().camera.fy = std::exp(0.15) * scene.camera.fx;
      photos.back().camera.distortion = {};
    }
    const AdjustedPhotos adjusted = Ok(AdjustPhotos(photos, PointNoiseOnly()));
    const AdjustedCamera& made = adjusted.cameras.front();
    EXPECT_EQ(made.num_photos, 5) << seed;
    EXPECT_LT(std::abs(std::log(made.camera.fx / scene.camera.fx)), 4.0 * made.Sigma(0)) << seed;
  }
}

TEST(AdjustHard, ACameraFarFromTheOneGivenIsNamed) {
  for (const double wrong : {1.0, 1.2}) {
    Photos sheet = Photos(8).WithCircles();
    AdjustOptions options = PointNoiseOnly();
    CameraSigma stated;
    stated.log_focal = 0.02;
    options.camera_sigma[sheet.photos[0].camera.id] = stated;
    for (Observations& photo : sheet.photos) {
      photo.camera.fx = wrong * sheet.truth().fx;
      photo.camera.fy = wrong * sheet.truth().fy;
    }
    const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, options));
    EXPECT_EQ(HasNote(adjusted, "its focal length is so far from the one given"), wrong > 1.0)
        << wrong;
  }
}

// Cheap cameras have lenses that are glued in beside the middle.
TEST(AdjustHard, ALensFarOffCentreKeepsThePrincipalPoint) {
  for (const double p1 : {0.0, 0.01}) {
    Photos sheet = Photos(8).OffCentre(p1).WithCircles();
    AdjustOptions options = PointNoiseOnly();
    options.tangential_sigma = AdjustOptions().tangential_sigma;
    const AdjustedPhotos adjusted = Ok(AdjustPhotos(sheet.photos, options));
    const AdjustedCamera& made = adjusted.cameras[0];
    EXPECT_LT(std::abs(made.camera.distortion[2] - p1), 3.0 * made.Sigma(6)) << p1;
    EXPECT_LT(made.Sigma(6), p1 > 0.0 ? 2e-3 : 5e-4) << p1;
    EXPECT_LT(CameraNees(made, sheet.truth()), 3.0) << p1;  // 1 expected; 99.5 % below 3.35.
  }
}

// What is known of a circle's tilt beforehand counts once, however many photos measure it: one does
// to about 4 mrad, all of them to 1.2, so that three quarters of it are believed; a fifth were, if
// it counted for each.
TEST(AdjustHard, ATiltIsKnownBeforehandOnce) {
  constexpr double kSigma = 2e-3, kTilt = 3.0 * kSigma;
  Photos sheet = Photos(12).WithCircles();
  Random random(1);
  for (std::size_t i = 0; i < sheet.photos.size(); ++i) {
    CircleObservation& circle = sheet.photos[i].circles[4];  // About (0.1, 0).
    for (std::size_t k = 0; k < circle.points.size(); ++k) {
      const double a =
          2.0 * kPi * static_cast<double>(k) / static_cast<double>(circle.points.size());
      const Eigen::Vector3d point(0.5 * std::cos(a), 0.5 * std::sin(a), -kTilt * 0.5 * std::cos(a));
      ASSERT_TRUE(CameraToPixel(sheet.truth(),
                                sheet.poses[i].rotation * point + sheet.poses[i].translation,
                                &circle.points[k]));
      circle.points[k] += Noise2(circle.sigma_px, &random);
    }
  }
  AdjustOptions options = PointNoiseOnly();
  options.noise_model.circle_tilt_rad = kSigma;
  const AdjustedPhotos adjusted = AdjustPhotos(sheet.photos, options);
  ASSERT_TRUE(adjusted.status.ok() && adjusted.rigid) << adjusted.status.message;
  double tilt = 0.0;
  for (const AdjustedCircle& circle : adjusted.circles) {
    if (circle.id == "c4") tilt = std::acos(std::min(1.0, std::abs(circle.normal.z())));
  }
  EXPECT_GT(tilt, 0.5 * kTilt);
  EXPECT_LT(tilt, 1.2 * kTilt);
}

// A thousand frames of a video in which next to nothing moves.
TEST(AdjustHard, FramesThatAreNearlyEqualCountOnce) {
  constexpr int kFrames = 1000;
  const Photos views = Photos(2).WithCircles();
  std::vector<Observations> video;
  Random random(1);
  for (int i = 0; i < kFrames; ++i) {
    Observations& frame = video.emplace_back(views.photos[i < kFrames / 2 ? 0 : 1]);
    const Eigen::Vector2d shake = Noise2(0.5, &random);
    for (CircleObservation& circle : frame.circles) {
      for (Eigen::Vector2d& pixel : circle.points) pixel += shake;
    }
  }
  const AdjustedPhotos two = AdjustPhotos(views.photos, PointNoiseOnly());
  const AdjustedPhotos all = AdjustPhotos(video, PointNoiseOnly());
  ASSERT_TRUE(two.status.ok() && all.status.ok()) << all.status.message;
  EXPECT_EQ(all.cameras[0].num_photos, 2);
  EXPECT_GT(all.cameras[0].Sigma(0), 0.8 * two.cameras[0].Sigma(0));
  EXPECT_NE(all.photos[7].status.message.find("nearly the same"), std::string::npos);
  ASSERT_FALSE(all.notes.empty());
  EXPECT_NE(all.notes.front().find("998 of 1000"), std::string::npos) << all.notes.front();
}

TEST(AdjustHard, NearlyEqualFramesTakePartWhereThatIsAskedFor) {
  Photos views = Photos(2).WithCircles();
  views.photos.push_back(views.photos.front());
  AdjustOptions options = PointNoiseOnly();
  options.nearly_equal = 0.0;
  const AdjustedPhotos adjusted = Ok(AdjustPhotos(views.photos, options));
  EXPECT_EQ(adjusted.cameras[0].num_photos, 3);
  // One that cannot take part stands for no other.
  views.photos[0].circles[0].radius = -1.0;
  const AdjustedPhotos others = Ok(AdjustPhotos(views.photos, PointNoiseOnly()));
  EXPECT_EQ(others.cameras[0].num_photos, 2);
  options.nearly_equal = -1.0;
  EXPECT_EQ(AdjustPhotos(views.photos, options).status.code, StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace circline
