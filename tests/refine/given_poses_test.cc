// Photos whose poses come from elsewhere: circles are landmarks of that world, and a known radius
// gives its scale.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/refine/simulated_options.h"
#include "tests/sheet_photos.h"
#include "tests/trials.h"

namespace circline {
namespace {

constexpr double kRotationSigma = 5e-4, kTranslationSigma = 1e-3;  // Radians; of the distance.

// The frame that poses are given in: X_given = kScale kTurn X + kShift.
constexpr double kScale = 3.7;
const Eigen::Matrix3d kTurn = ExpRotation({0.7, -1.1, 0.4});
const Eigen::Vector3d kShift(5.0, -2.0, 1.0);

struct GivenSheet {
  explicit GivenSheet(int count, std::uint64_t seed = 1, double noise = 0.0)
      : sheet(Photos(count, seed).WithCircles()) {
    Random random(seed);
    const auto draw = [&](double sigma) {
      const double x = random.Normal(), y = random.Normal(), z = random.Normal();
      return Eigen::Vector3d(noise * sigma * Eigen::Vector3d(x, y, z));
    };
    for (std::size_t i = 0; i < sheet.photos.size(); ++i) {
      sheet.photos[i].camera = sheet.truth();
      CameraPose pose = sheet.poses[i];
      pose.rotation = ExpRotation(draw(kRotationSigma)) * pose.rotation;
      pose.translation += draw(kTranslationSigma) * pose.translation.norm();
      const Eigen::Matrix3d R = pose.rotation * kTurn.transpose();
      options.given_poses.emplace_back(CameraPose{R, kScale * pose.translation - R * kShift});
    }
    options.noise_model = NoiseModel::Exact();
    options.camera_sigma["cam"] = CameraSigma::Exact();
    options.num_radial = 0;
    options.given_rotation_sigma = kRotationSigma;
    options.given_translation_sigma = kTranslationSigma;
  }
  // Leaves one circle in each photo, the middle one of the sheet.
  void KeepOneCircle() {
    for (Observations& photo : sheet.photos) photo.circles = {photo.circles[4]};
  }
  // Leaves those circles in a photo.
  void Keep(std::size_t photo, const std::vector<std::size_t>& circles) {
    std::vector<CircleObservation> kept;
    for (const std::size_t k : circles) kept.push_back(sheet.photos[photo].circles[k]);
    sheet.photos[photo].circles = kept;
  }
  AdjustedPhotos Run() const { return AdjustPhotos(sheet.photos, options); }

  Photos sheet;
  AdjustOptions options;
};

// One of a circle's two poses is right in each photo; which, and where the circle is, the given
// poses tell.
TEST(GivenPoses, OneCircleOfKnownRadiusGivesScaleAndPlane) {
  GivenSheet given(5);
  given.KeepOneCircle();
  given.sheet.photos[2].circles[0].radius = 0.05;  // A tenth of what it is.
  const AdjustedPhotos adjusted = Ok(given.Run());
  ASSERT_TRUE(adjusted.given.has_value());
  EXPECT_TRUE(adjusted.metric);
  EXPECT_NEAR(adjusted.given->scale, 10.0 * kScale, 0.005 * 10.0 * kScale);
  EXPECT_GT(std::abs(adjusted.given->rotation.col(2).dot(kTurn.col(2))), std::cos(0.003));
  ASSERT_EQ(adjusted.circles.size(), 1U);
  // Its centre, which is the origin of the sheet, in the given frame.
  const Eigen::Vector3d center =
      adjusted.given->scale * (adjusted.given->rotation * adjusted.circles[0].center) +
      adjusted.given->translation;
  EXPECT_LT((center - kShift).norm(), 0.02 * kScale);
}

TEST(GivenPoses, ScaleIsAsGoodAsItsSigma) {
  const int trials = Trials(20);
  double sum = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    GivenSheet given(5, static_cast<std::uint64_t>(100 + trial), 1.0);
    given.KeepOneCircle();
    given.sheet.photos[0].circles[0].radius = 0.5;
    const AdjustedPhotos adjusted = Ok(given.Run());
    const double error = std::log(adjusted.given->scale / kScale);
    EXPECT_GT(adjusted.given->log_scale_sigma, 0.0);
    sum += std::pow(error / adjusted.given->log_scale_sigma, 2);
  }
  if (kSanitized) return;
  EXPECT_GT(sum / trials, 0.4);  // 0.48 to 1.71 in 95 % of runs, of 20.
  EXPECT_LT(sum / trials, 1.8);
}

TEST(GivenPoses, CirclesAreFoundAgainWhateverTheirIds) {
  GivenSheet given(5);
  for (std::size_t i = 0; i < given.sheet.photos.size(); ++i) {
    for (std::size_t k = 0; k < 9; ++k)
      given.sheet.photos[i].circles[k].id = "c" + std::to_string((k + 2 * i) % 9);
  }
  const AdjustedPhotos adjusted = Ok(given.Run());
  EXPECT_EQ(adjusted.circles.size(), 9U);
  EXPECT_FALSE(adjusted.metric);
  EXPECT_GT(std::abs(adjusted.given->rotation.col(2).dot(kTurn.col(2))), std::cos(0.001));
}

// Two rims about one centre, so near in size that each may be a sight of the other.
TEST(GivenPoses, EachOfTwoRimsIsALandmark) {
  GivenSheet given(5);
  for (Observations& photo : given.sheet.photos) photo.circles.clear();
  given.sheet.WithCircle("a", 1.0).WithCircle("b", 1.2);
  given.sheet.photos[1].circles[1].radius = 0.12;  // A tenth of what it is.
  const AdjustedPhotos adjusted = Ok(given.Run());
  ASSERT_EQ(adjusted.circles.size(), 2U);
  EXPECT_NEAR(adjusted.circles[0].radius, 0.1, 0.0005);
  EXPECT_NEAR(adjusted.circles[1].radius, 0.12, 1e-6);
  EXPECT_NEAR(adjusted.given->scale, 10.0 * kScale, 0.005 * 10.0 * kScale);
}

// Each photo shares a circle with the next one only; the one at the end of the chain is first.
TEST(GivenPoses, TheOrderOfPhotosLosesNone) {
  GivenSheet given(4);
  given.Keep(0, {8});
  given.Keep(1, {0, 1});
  given.Keep(2, {1, 4});
  given.Keep(3, {4, 8});
  const AdjustedPhotos adjusted = Ok(given.Run());
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_TRUE(adjusted.photos[i].status.ok()) << i << adjusted.photos[i].status.message;
  EXPECT_EQ(adjusted.circles.size(), 4U);
}

// Between two photos of one circle others show none, or others.
TEST(GivenPoses, PhotosFarApartInTheListAreFound) {
  for (const bool are_blank : {true, false}) {
    GivenSheet given(10);
    given.Keep(0, {0});
    given.Keep(9, {0});
    for (std::size_t i = 1; i < 9; ++i)
      given.Keep(i, are_blank ? std::vector<std::size_t>() : std::vector<std::size_t>{i});
    const AdjustedPhotos adjusted = Ok(given.Run());
    EXPECT_TRUE(adjusted.photos[0].status.ok()) << adjusted.photos[0].status.message;
    EXPECT_TRUE(adjusted.photos[9].status.ok()) << adjusted.photos[9].status.message;
    EXPECT_EQ(adjusted.circles.size(), 1U);
  }
}

// Line groups are the same where their directions are, whatever the photos call them.
TEST(GivenPoses, DirectionsAreFoundAgainWhateverTheirIds) {
  GivenSheet given(4);
  given.sheet.WithPencils();
  for (std::size_t i = 0; i < given.sheet.photos.size(); ++i) {
    Observations& photo = given.sheet.photos[i];
    if (i % 2 == 1) std::swap(photo.pencils[0].id, photo.pencils[1].id);
    for (std::size_t k = 0; k < 9; ++k) photo.circles[k].id = "c" + std::to_string((k + 2 * i) % 9);
  }
  const AdjustedPhotos adjusted = Ok(given.Run());
  ASSERT_EQ(adjusted.directions.size(), 2U);
  EXPECT_EQ(adjusted.directions[0].photo, -1);
  EXPECT_LT(std::abs(adjusted.directions[0].direction.dot(adjusted.directions[1].direction)), 0.01);
}

TEST(GivenPoses, APhotoOfAnotherPlaceIsLeftOutAndNamed) {
  GivenSheet given(6);
  std::optional<CameraPose>& wrong = given.options.given_poses[3];
  wrong->rotation = ExpRotation({0.0, 0.05, 0.0}) * wrong->rotation;
  const AdjustedPhotos adjusted = Ok(given.Run());
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_EQ(adjusted.photos[i].status.ok(), i != 3) << i << adjusted.photos[i].status.message;
  EXPECT_NE(adjusted.photos[3].status.message.find("contradicts the other photos"),
            std::string::npos)
      << adjusted.photos[3].status.message;
}

TEST(GivenPoses, WhatIsMissingIsSaidInWords) {
  GivenSheet given(4);
  given.options.given_poses[1].reset();
  AdjustedPhotos adjusted = given.Run();
  ASSERT_TRUE(adjusted.status.ok()) << adjusted.status.message;
  EXPECT_EQ(adjusted.photos[1].status.message, "no pose is given for it");

  given.options.rigid = RigidWorld::kYes;
  adjusted = given.Run();
  EXPECT_EQ(adjusted.status.code, StatusCode::kInvalidArgument);
  EXPECT_NE(adjusted.status.message.find("rigid"), std::string::npos);
  given.options.rigid = RigidWorld::kAuto;

  given.options.given_poses[1] = CameraPose{2.0 * Eigen::Matrix3d::Identity(), {0.0, 0.0, 1.0}};
  EXPECT_EQ(given.Run().status.code, StatusCode::kInvalidArgument);
  given.options.given_poses.pop_back();
  EXPECT_EQ(given.Run().status.code, StatusCode::kInvalidArgument);

  // Photos that look elsewhere.
  GivenSheet apart(4);
  for (std::size_t i = 0; i < 4; ++i)
    apart.options.given_poses[i]->translation.x() += 100.0 * static_cast<double>(i);
  adjusted = apart.Run();
  EXPECT_EQ(adjusted.status.code, StatusCode::kRefused);
  EXPECT_NE(adjusted.status.message.find("given poses"), std::string::npos);
}

}  // namespace
}  // namespace circline
