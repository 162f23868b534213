// Photos of one sheet by a camera that nobody knows, for tests of AdjustPhotos.
#ifndef CIRCLINE_TESTS_SHEET_PHOTOS_H_
#define CIRCLINE_TESTS_SHEET_PHOTOS_H_

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/random.h"
#include "circline/refine/adjust_photos.h"
#include "tests/plane_scene.h"

namespace circline {

// Photos of a sheet from all around; each comes with a camera whose focal length is far off and
// that has no distortion.
class Photos {
 public:
  explicit Photos(int count, std::uint64_t seed = 1, double tilt = 0.6,
                  CameraModel model = CameraModel::kOpenCV, double sigma_px = 0.2)
      : scene_(0.0, sigma_px, seed) {
    scene_.camera.id = "cam";
    scene_.camera.model = model;
    scene_.camera.fy = scene_.camera.fx;
    scene_.camera.distortion = {};
    if (model == CameraModel::kOpenCV) scene_.camera.distortion = {-0.2, 0.05};
    if (model == CameraModel::kFisheye) scene_.camera.distortion = {0.05, -0.02};
    for (int i = 0; i < count; ++i) {
      const double turn = 2.0 * kPi * i / count;
      scene_.pose.rotation =
          ExpRotation(tilt * Eigen::Vector3d(std::cos(turn), std::sin(turn), 0.0)) *
          ExpRotation({0.0, 0.0, 0.4 * i}) * Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
      scene_.pose.translation = {1.5 * std::sin(2.0 * turn), 1.2 * std::cos(3.0 * turn), 9.0};
      poses.push_back(scene_.pose);
      photos.push_back(Guessed());
    }
  }

  // Nine circles of the sheet, not quite in a lattice; or one about its origin.
  Photos& WithCircles(double radius = 0.5) {
    for (std::size_t i = 0; i < photos.size(); ++i) {
      scene_.pose = poses[i];
      for (int k = 0; k < 9; ++k) {
        const double x = 2.0 * (k % 3 - 1) + 0.1 * (k % 2), y = 1.6 * (k / 3 - 1) - 0.07 * (k % 4);
        photos[i].circles.push_back(scene_.Circle("c" + std::to_string(k), x, y, radius));
      }
    }
    return *this;
  }
  Photos& WithCircle(const std::string& id, double radius,
                     const Eigen::Vector2d& at = Eigen::Vector2d::Zero()) {
    for (std::size_t i = 0; i < photos.size(); ++i) {
      scene_.pose = poses[i];
      photos[i].circles.push_back(scene_.Circle(id, at.x(), at.y(), radius));
    }
    return *this;
  }
  // Eight rows of eight dots, the one at a corner twice as large. Each photo misses one in eight of
  // the others, and numbers what it has.
  Photos& WithMarkedBoard(std::uint64_t seed) {
    constexpr int kSide = 8;
    constexpr double kStep = 0.6, kMissed = 0.125;
    Random random(seed);
    for (std::size_t i = 0; i < photos.size(); ++i) {
      scene_.pose = poses[i];
      for (int k = 0; k < kSide * kSide; ++k) {
        if (k > 0 && random.Uniform() < kMissed) continue;
        const double x = kStep * (k % kSide - 3.5), y = kStep * (k / kSide - 3.5);
        const std::string id = "c" + std::to_string(photos[i].circles.size());
        photos[i].circles.push_back(scene_.Circle(id, x, y, k == 0 ? 0.2 : 0.1));
      }
    }
    return *this;
  }
  // A lens that is not centred; before anything is seen.
  Photos& OffCentre(double p1) {
    scene_.camera.distortion[2] = p1;
    return *this;
  }
  Photos& WithPencils() {
    for (std::size_t i = 0; i < photos.size(); ++i) {
      scene_.pose = poses[i];
      photos[i].pencils = scene_.Axes(4, 30);
    }
    return *this;
  }
  // One more line of the sheet along an axis, of the pencil that has all of these.
  Photos& WithLine(PencilDirection along, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
    for (std::size_t i = 0; i < photos.size(); ++i) {
      scene_.pose = poses[i];
      std::vector<PencilObservation>& pencils = photos[i].pencils;
      auto pencil = std::find_if(pencils.begin(), pencils.end(),
                                 [&](const auto& p) { return p.direction == along; });
      if (pencil == pencils.end()) {
        PencilObservation made;
        made.id = PencilDirectionName(along);
        made.direction = along;
        made.plane = "p0";
        made.sigma_px = scene_.sigma();
        pencil = pencils.insert(pencils.end(), made);
      }
      pencil->lines.push_back(scene_.Line({from.x(), from.y(), 0.0}, {to.x(), to.y(), 0.0}, 30));
    }
    return *this;
  }
  const Camera& truth() const { return scene_.camera; }

  std::vector<CameraPose> poses;
  std::vector<Observations> photos;

 private:
  Observations Guessed() const {
    Observations observations = scene_.Empty();
    Camera& camera = observations.camera;
    camera.fx = camera.fy = 1.5 * scene_.camera.fx;
    camera.cx = 0.5 * (camera.width - 1);
    camera.cy = 0.5 * (camera.height - 1);
    camera.distortion = {};
    return observations;
  }

  PlaneScene scene_;
};

inline AdjustOptions PointNoiseOnly() {
  AdjustOptions options;
  options.noise_model = NoiseModel::Exact();
  options.num_radial = 2;
  options.tangential_sigma = 0.0;
  CameraSigma& prior = options.camera_sigma["cam"] = UnknownCamera(PlaneScene().camera);
  prior.log_aspect = 0.0;
  return options;
}

// The error of log f, principal point, k1 and k2, or of the first `count` of them: in standard
// deviations squared, over their number, so that 1 is expected.
inline double CameraNees(const AdjustedCamera& made, const Camera& truth, int count = 5) {
  constexpr int kShifts[] = {0, 2, 3, 4, 5};
  Eigen::MatrixXd covariance(count, count);
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j)
      covariance(i, j) =
          made.covariance[static_cast<std::size_t>(kShifts[i] * kCameraSize + kShifts[j])];
  }
  Eigen::Matrix<double, 5, 1> all;
  all << std::log(made.camera.fx / truth.fx), made.camera.cx - truth.cx, made.camera.cy - truth.cy,
      made.camera.distortion[0] - truth.distortion[0],
      made.camera.distortion[1] - truth.distortion[1];
  const Eigen::VectorXd error = all.head(count);
  return error.dot(covariance.inverse() * error) / count;
}

}  // namespace circline

#endif  // CIRCLINE_TESTS_SHEET_PHOTOS_H_
