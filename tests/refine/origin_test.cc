// Where the world has its origin.
#include <gtest/gtest.h>

#include "circline/refine/estimate_pose.h"
#include "tests/plane_scene.h"
#include "tests/refine/simulated_options.h"

namespace circline {
namespace {

// The origin, measured by itself, is the centre of two rings: whichever of them is named, and in
// whatever order they come.
TEST(OriginTest, TheOriginIsTheCenterOfAllRingsAboutIt) {
  PlaneScene scene(0.7, 0.3, 3);
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("a", 0.5, 0.2, 1.0), scene.Circle("b", 0.5, 0.2, 1.6)};
  for (CircleObservation& circle : observations.circles) circle.concentric = "rings";
  observations.frame.origin = scene.Pixel(0.5, 0.2);
  for (const char* named : {"a", "b"}) {
    observations.frame.origin_is_center = named;
    const PoseHypothesis best = Best(EstimatePose(observations, Exact()));
    for (const CircleEstimate& circle : best.circles) {
      EXPECT_LT((circle.center - best.cam_from_world.translation).norm(), 1e-9)
          << circle.id << " where " << named << " is named";
    }
  }
}

// The origin is the centre of a lone circle, whatever that is called.
TEST(OriginTest, TheOriginIsTheCenterOfALoneCircle) {
  PlaneScene scene(0.7, 0.3, 3);
  for (const char* id : {"c0", ""}) {
    Observations observations = scene.Empty();
    observations.circles = {scene.Circle(id, 0.5, 0.2, 1.0)};
    const PoseHypothesis best = Best(EstimatePose(observations, Exact()));
    EXPECT_LT((best.circles[0].center - best.cam_from_world.translation).norm(), 1e-9);
    EXPECT_GT(best.covariance[35], 0.0);
  }
}

// A circle of too few points is no origin: it is as if none were named.
TEST(OriginTest, AnOriginWithoutPointsIsNone) {
  PlaneScene scene(0.7, 0.3, 3);
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("c0", 0.5, 0.2, 1.0), scene.Circle("c1", -1.0, 0.5, 0.7)};
  FitDirect(0.3, &observations);
  observations.circles[0].inliers.assign(observations.circles[0].points.size(), 0);
  observations.frame.origin_is_center = "c0";
  const PoseEstimate estimate = Ok(EstimatePose(observations, Exact()));
  for (const PoseHypothesis& h : estimate.hypotheses) {
    EXPECT_FALSE(h.origin_observed);
    ASSERT_EQ(h.circles.size(), 1U);
    EXPECT_EQ(h.circles[0].id, "c1");
    EXPECT_LT((h.circles[0].center - h.cam_from_world.translation).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace circline
