// A closed form of one's own beside the built-in ones, and alone in EstimatePose, on 200 noisy
// images of a wheel and two kerbs: does it find the pose, and are its errors what it says?
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "circle_pencil.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/random.h"
#include "circline/refine/estimate_pose.h"

using namespace circline;

namespace {

constexpr double kNoisePx = 0.3;

CameraPose TruePose() {
  CameraPose pose;
  pose.rotation = ExpRotation({0.6, 0.1, 0.0}) * Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  pose.translation = Eigen::Vector3d(0.3, -0.2, 10.0);
  return pose;
}

Eigen::Vector2d Pixel(const Camera& camera, double x, double y, Random* random) {
  const CameraPose pose = TruePose();
  Eigen::Vector2d pixel(0.0, 0.0);
  CameraToPixel(camera, pose.rotation * Eigen::Vector3d(x, y, 0.0) + pose.translation, &pixel);
  const double u = random->Normal(), v = random->Normal();
  return pixel + kNoisePx * Eigen::Vector2d(u, v);
}

Observations Observe(Random* random) {
  Observations observations;
  Camera& camera = observations.camera;
  camera.width = 1280;
  camera.height = 960;
  camera.fx = camera.fy = 1000.0;
  camera.cx = 640.0;
  camera.cy = 480.0;
  CircleObservation wheel;
  wheel.id = "wheel";
  wheel.plane = "road";
  wheel.radius = 2.0;
  wheel.sigma_px = kNoisePx;
  for (int i = 0; i < 100; ++i) {
    const double angle = 2.0 * 3.14159265358979 * i / 100.0;
    wheel.points.push_back(
        Pixel(camera, wheel.radius * std::cos(angle), wheel.radius * std::sin(angle), random));
  }
  observations.circles.push_back(std::move(wheel));
  PencilObservation kerbs;
  kerbs.id = "kerbs";
  kerbs.plane = "road";
  kerbs.sigma_px = kNoisePx;
  for (const double y : {-3.0, 3.0}) {
    LineObservation line;
    for (int k = 0; k < 50; ++k)
      line.points.push_back(Pixel(camera, -3.0 + 6.0 * k / 49.0, y, random));
    kerbs.lines.push_back(std::move(line));
  }
  observations.pencils.push_back(std::move(kerbs));
  return observations;
}

}  // namespace

int main() {
  ClosedFormOptions options;
  options.noise_model = NoiseModel::Exact();
  SolverRegistry registry;
  AddCirclePencilSolver(options, &registry);
  EstimationOptions estimation;
  estimation.noise_model = NoiseModel::Exact();

  constexpr int kImages = 200;
  Random random(1);
  double chi2 = 0.0, refined_error = 0.0;
  for (int i = 0; i < kImages; ++i) {
    const Observations observations = Observe(&random);
    const PoseEstimate closed_form =
        registry.Find("circle_pencil", SolverStage::kClosedForm)->Solve(observations);
    const PoseEstimate refined = EstimatePose(observations, estimation, &registry);
    if (!closed_form.status.ok() || !refined.status.ok()) {
      std::fprintf(stderr, "%s %s\n", closed_form.status.message.c_str(),
                   refined.status.message.c_str());
      return 1;
    }
    const PoseHypothesis& best = closed_form.hypotheses.front();
    const CameraPose truth = TruePose();
    Vector6d error;
    error << LogRotation(truth.rotation * best.cam_from_world.rotation.transpose()),
        truth.translation - best.cam_from_world.translation;
    chi2 += error.dot(best.Covariance().ldlt().solve(error));
    refined_error =
        std::max(refined_error,
                 RotationAngle(truth.rotation, refined.hypotheses.front().cam_from_world.rotation));
  }
  // 6 is honest; of the mean of 200 the standard deviation is 0.25.
  std::printf(
      "mean squared error by its covariance (6 is honest): %.2f; refined, at most %.4f rad "
      "off\n",
      chi2 / kImages, refined_error);
  return chi2 / kImages > 5.0 && chi2 / kImages < 7.0 && refined_error < 0.01 ? 0 : 1;
}
