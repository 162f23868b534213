#include <gtest/gtest.h>

#include <cmath>

#include "circline/refine/estimate_pose.h"
#include "tests/plane_scene.h"

namespace circline {
namespace {

// A camera that faces a wall sees its uprights and its levels at right angles at nearly any focal
// length: what walls lean says nothing of that, and what is stated of it is the prior.
TEST(GuessedFocalLength, IsKnownToItsPriorWhereRightAnglesSayNothing) {
  for (const double tilt : {0.05, 0.1, 0.2}) {
    PlaneScene scene(tilt, 0.6);
    Observations observations = scene.Empty();
    observations.pencils = {scene.Pencil("x", PencilDirection::kX, Eigen::Vector3d::UnitX()),
                            scene.Pencil("y", PencilDirection::kY, Eigen::Vector3d::UnitY())};
    EstimationOptions options;
    options.camera_sigma = CameraSigma();
    options.camera_sigma->log_focal = 0.5;
    const PoseEstimate estimate = EstimatePose(observations, options);
    ASSERT_TRUE(estimate.status.ok()) << estimate.status.message;
    const PoseHypothesis& best = estimate.hypotheses.front();
    const double sigma = best.focal_sigma / best.focal_scale;
    EXPECT_LT(sigma, std::hypot(0.5, std::log(best.focal_scale))) << tilt;
    EXPECT_GT(sigma, 0.01) << tilt;
  }
}

}  // namespace
}  // namespace circline
