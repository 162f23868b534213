// A camera that was found on the way is no prior.
#include <gtest/gtest.h>

#include "circline/estimators/closed_form_solvers.h"
#include "circline/refine/estimate_pose.h"
#include "circline/refine/refined_solvers.h"
#include "tests/plane_scene.h"
#include "tests/refine/simulated_options.h"

namespace circline {
namespace {

// A lens that was looked through is no prior: where the evidence says nothing of it, the one known
// beforehand is.
TEST(FoundLens, IsNoPrior) {
  PlaneScene scene(0.7, 0.1);
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("c0", 0.5, 0.2, 0.3)};
  EstimationOptions options = Exact();
  options.camera_sigma = CameraSigma::Exact();
  options.camera_sigma->log_focal = 0.03;
  options.camera_sigma->k1 = 0.2;
  for (const double found : {-0.1, 0.1}) {
    observations.camera.model = CameraModel::kOpenCV;
    observations.camera.distortion[0] = observations.found_k1 = found;
    const PoseHypothesis best = Best(EstimatePose(observations, options));
    ASSERT_TRUE(best.camera.has_value());
    EXPECT_NEAR(best.camera->distortion[0], 0.0, 0.02) << found;
  }
}

// The prior is about the focal length that was stated, for a solver on its own evidence, too.
TEST(FoundFocal, IsNoPrior) {
  PlaneScene scene(0.7, 0.1);
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("c0", 0.5, 0.2, 0.3)};
  observations.stated_focal_px = 0.7 * observations.camera.fx;
  EstimationOptions options;
  options.camera_sigma = CameraSigma::Exact();
  options.camera_sigma->log_focal = 0.1;
  SolverRegistry registry;
  AddClosedFormSolvers(&registry);
  AddRefinedSolvers(&registry, options);
  for (const char* name : {"single_circle", "joint"}) {
    const PoseHypothesis best =
        Best(registry.Find(name, SolverStage::kRefined)->Solve(observations));
    EXPECT_NEAR(best.focal_scale, 0.7, 0.02) << name;
  }
}

}  // namespace
}  // namespace circline
