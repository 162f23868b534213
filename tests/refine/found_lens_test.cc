#include <gtest/gtest.h>

#include "circline/refine/estimate_pose.h"
#include "tests/plane_scene.h"

namespace circline {
namespace {

// A lens that was looked through is no prior: where the evidence says nothing of it, the one known
// beforehand is.
TEST(FoundLens, IsNoPrior) {
  PlaneScene scene(0.7, 0.1);
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("c0", 0.5, 0.2, 0.3)};
  EstimationOptions options;
  options.noise_model = NoiseModel::Exact();
  options.camera_sigma = CameraSigma::Exact();
  options.camera_sigma->log_focal = 0.03;
  options.camera_sigma->k1 = 0.2;
  for (const double found : {-0.1, 0.1}) {
    observations.camera.model = CameraModel::kOpenCV;
    observations.camera.distortion[0] = observations.found_k1 = found;
    const PoseEstimate estimate = EstimatePose(observations, options);
    ASSERT_TRUE(estimate.status.ok()) << estimate.status.message;
    ASSERT_TRUE(estimate.hypotheses[0].camera.has_value());
    EXPECT_NEAR(estimate.hypotheses[0].camera->distortion[0], 0.0, 0.02) << found;
  }
}

}  // namespace
}  // namespace circline
