// The degenerate and ambiguous cases of circles and lines, one test for each: a defined answer from
// every closed form, with a status and a sentence, never NaN, never a hypothesis silently dropped.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "tests/estimators/closed_form_call.h"

namespace circline {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// What holds of any answer: hypotheses, all finite and proper, or a sentence.
void ExpectDefined(const PoseEstimate& estimate) {
  EXPECT_EQ(estimate.status.ok(), !estimate.hypotheses.empty()) << estimate.solver;
  EXPECT_EQ(estimate.status.ok(), estimate.status.message.empty()) << estimate.solver;
  double probability = 0.0;
  for (const PoseHypothesis& h : estimate.hypotheses) {
    const Eigen::Matrix3d& R = h.cam_from_world.rotation;
    EXPECT_LT((R.transpose() * R - Eigen::Matrix3d::Identity()).norm(), 1e-9) << estimate.solver;
    EXPECT_GT(R.determinant(), 0.0) << estimate.solver;
    EXPECT_TRUE(h.cam_from_world.translation.allFinite()) << estimate.solver;
    EXPECT_TRUE(h.Covariance().allFinite()) << estimate.solver;
    EXPECT_TRUE(std::isfinite(h.cost)) << estimate.solver;
    probability += h.probability;
  }
  if (!estimate.hypotheses.empty()) {
    EXPECT_NEAR(probability, 1.0, 1e-9) << estimate.solver;
  }
}

// The answer of one solver; those of all others are checked as well.
PoseEstimate SolveDefined(const std::string& name, const Observations& observations) {
  SolverRegistry registry;
  AddClosedFormSolvers(&registry);
  PoseEstimate answer;
  for (const auto& solver : registry.solvers()) {
    const PoseEstimate estimate = solver->Solve(observations);
    ExpectDefined(estimate);
    if (solver->name() == name) answer = estimate;
  }
  return answer;
}

double BestNormalError(const PoseEstimate& estimate, const PlaneScene& scene) {
  double best = std::numeric_limits<double>::infinity();
  for (const PoseHypothesis& h : estimate.hypotheses) best = std::min(best, NormalError(h, scene));
  return best;
}

// Both candidates coincide where the circle is seen straight on: the direction to its centre is
// the normal.
TEST(DegeneracyTest, AFrontalCircleKeepsItsNormal) {
  for (const double tilt : {0.0, 1e-9, 1e-6, 1e-3}) {
    PlaneScene scene;
    scene.camera.distortion = {};
    scene.pose.rotation = ExpRotation({tilt, 0.0, 0.0}) * Vector3d(1.0, -1.0, -1.0).asDiagonal();
    scene.pose.translation = Vector3d(0.0, 0.0, 10.0);
    Observations observations = OneCircle(&scene, 0.0, 0.0);
    const PoseEstimate estimate = SolveDefined("single_circle", observations);
    ASSERT_GE(estimate.hypotheses.size(), 1U) << estimate.status.message;
    // The fit knows the two largest eigenvalues to 1e-15 or so; the tilt is their root.
    EXPECT_LT(BestNormalError(estimate, scene), 1e-6) << tilt;
  }
}

// Nearly affine: the centre tells the candidates apart by less than the noise, and the
// probabilities say so. A circle that fills the photo decides.
TEST(DegeneracyTest, AFarAwayCircleLeavesBothPosesOpen) {
  for (const double distance : {10.0, 300.0}) {
    PlaneScene scene(0.7, 0.2);
    scene.pose.translation = Vector3d(0.0, 0.0, distance);
    Observations observations = scene.Empty();
    observations.circles = {scene.Circle("c0", 0.0, 0.0, 3.0)};
    observations.circles[0].center = scene.Pixel(0.0, 0.0);
    const PoseEstimate estimate = SolveDefined("circle_center", observations);
    ASSERT_EQ(estimate.hypotheses.size(), 2U) << estimate.status.message;
    if (distance > 100.0) {
      EXPECT_LT(estimate.hypotheses[0].probability, 0.9);
    } else {
      EXPECT_GT(estimate.hypotheses[0].probability, 0.999);
      EXPECT_LT(NormalError(estimate.hypotheses[0], scene), 0.01);
    }
  }
}

// An axis through the centre along the direction of the tilt passes for orthogonal to the other on
// both candidates; that the origin is the centre decides, by the rule of proposition 3.
TEST(DegeneracyTest, AnAxisAlongTheTiltLeavesProposition4Open) {
  PlaneScene scene;
  scene.pose.rotation = ExpRotation({0.7, 0.0, 0.0}) * Vector3d(1.0, -1.0, -1.0).asDiagonal();
  scene.pose.translation = Vector3d(0.0, 0.0, 10.0);
  Observations observations = OneCircle(&scene, 0.0, 0.0);
  // The origin is the centre, or lies elsewhere on the axis: ambiguous all the same.
  for (const double origin : {0.0, 0.8}) {
    observations.frame.x_axis = Segment{scene.Pixel(0, origin), scene.Pixel(2, origin)};
    observations.frame.y_axis = Segment{scene.Pixel(0, origin), scene.Pixel(0, origin + 2)};
    const PoseEstimate estimate = SolveDefined("circle_frame", observations);
    ASSERT_EQ(estimate.hypotheses.size(), 2U) << estimate.status.message;
    EXPECT_LT(estimate.hypotheses[0].probability, 0.7);
    EXPECT_LT(BestNormalError(estimate, scene), kExact);
  }
  observations.frame.x_axis = Segment{scene.Pixel(0, 0), scene.Pixel(2, 0)};
  observations.frame.y_axis = Segment{scene.Pixel(0, 0), scene.Pixel(0, 2)};
  observations.frame.origin_is_center = "c0";
  const PoseEstimate estimate = SolveDefined("circle_frame", observations);
  ASSERT_EQ(estimate.hypotheses.size(), 2U) << estimate.status.message;
  EXPECT_GT(estimate.hypotheses[0].probability, 0.95);
  EXPECT_LT(NormalError(estimate.hypotheses[0], scene), kExact);
}

// The circle reaches behind the camera: what is seen of it is a branch of a hyperbola, or at the
// limit a parabola. The circle is refused by name.
TEST(DegeneracyTest, AHyperbolaIsNoCircle) {
  for (const double reach : {1.0, 1.5}) {  // Of the circle beyond the camera's own plane.
    PlaneScene scene;
    scene.camera.distortion = {};
    scene.camera.fx = scene.camera.fy = 100.0;
    // The camera is over the plane and looks along it, tilted down by 30 degrees.
    scene.pose.rotation =
        ExpRotation({0.5 - 1.5707963267948966, 0.0, 0.0}) * Vector3d(1.0, -1.0, -1.0).asDiagonal();
    scene.pose.translation = scene.pose.rotation * Vector3d(0.0, 0.0, -1.0);
    Observations observations = scene.Empty();
    CircleObservation circle = scene.Circle("c0", 0.0, 3.0, 3.0 * reach + 1.0, 400);
    const auto behind = [&](const Vector2d& pixel) { return pixel.norm() > 1e5; };
    circle.points.erase(std::remove_if(circle.points.begin(), circle.points.end(), behind),
                        circle.points.end());
    ASSERT_GE(circle.points.size(), 20U);
    ASSERT_LT(circle.points.size(), 400U);
    observations.circles = {circle};
    const PoseEstimate estimate = SolveDefined("single_circle", observations);
    ASSERT_FALSE(estimate.status.ok());
    EXPECT_NE(estimate.status.message.find("'c0'"), std::string::npos) << estimate.status.message;
  }
}

TEST(DegeneracyTest, PencilsParallelInTheImageAreOrdinary) {
  PlaneScene scene;
  scene.camera.distortion = {};
  scene.pose.rotation = Vector3d(1.0, -1.0, -1.0).asDiagonal();
  Observations observations = scene.Empty();
  observations.pencils = {AlongX(&scene, 2), AlongY(&scene, 2)};
  observations.frame.x_axis = Segment{scene.Pixel(0, 0), scene.Pixel(2, 0)};
  observations.frame.y_axis = Segment{scene.Pixel(0, 0), scene.Pixel(0, 2)};
  const PoseEstimate estimate = SolveDefined("line_pairs", observations);
  ASSERT_EQ(estimate.hypotheses.size(), 1U) << estimate.status.message;
  EXPECT_LT(RotationAngle(estimate.hypotheses[0].cam_from_world.rotation, scene.pose.rotation),
            1e-9);
}

TEST(DegeneracyTest, OneDirectionSpansNoPlane) {
  PlaneScene scene;
  Observations observations = scene.Empty();
  observations.pencils = {AlongX(&scene, 4)};
  PoseEstimate estimate = SolveDefined("line_pairs", observations);
  EXPECT_EQ(estimate.status.code, StatusCode::kRefused);
  EXPECT_NE(estimate.status.message.find("second direction"), std::string::npos)
      << estimate.status.message;
  // Two pencils of one direction: v1 and v2 coincide.
  PencilObservation again = scene.Pencil("again", PencilDirection::kFree, Vector3d::UnitX(), 3);
  observations.pencils.push_back(again);
  estimate = SolveDefined("line_pairs", observations);
  EXPECT_EQ(estimate.status.code, StatusCode::kRefused);
  EXPECT_NE(estimate.status.message.find("same direction"), std::string::npos)
      << estimate.status.message;
}

// Lines through the principal point, vertical and horizontal ones have nothing special about them.
TEST(DegeneracyTest, LinesMayRunAnywhere) {
  PlaneScene scene;
  scene.camera.distortion = {};
  scene.pose.rotation = ExpRotation({0.6, 0.0, 0.0}) * Vector3d(1.0, -1.0, -1.0).asDiagonal();
  scene.pose.translation = Vector3d(0.0, 0.0, 10.0);
  Observations observations = scene.Empty();
  // Of three lines each the middle one is seen through the principal point: horizontal, vertical.
  observations.pencils = {AlongX(&scene), AlongY(&scene)};
  const PoseEstimate estimate = SolveDefined("line_pairs", observations);
  ASSERT_EQ(estimate.hypotheses.size(), 1U) << estimate.status.message;
  EXPECT_LT(NormalError(estimate.hypotheses[0], scene), kExact);
}

struct BrokenPencil {
  const char* name;
  void (*damage)(PencilObservation* pencil);
};

// A pencil that cannot be used is named, whichever solver is asked.
TEST(DegeneracyTest, UnusablePencilsAreNamed) {
  const BrokenPencil cases[] = {
      {"coincident lines", [](PencilObservation* p) { p->lines[1] = p->lines[0]; }},
      {"a segment of length zero",
       [](PencilObservation* p) { p->lines[1].points[1] = p->lines[1].points[0]; }},
      {"one line", [](PencilObservation* p) { p->lines.resize(1); }},
      {"a single point", [](PencilObservation* p) { p->lines[0].points.resize(1); }},
      {"NaN",
       [](PencilObservation* p) {
         p->lines[0].points[0].x() = std::numeric_limits<double>::quiet_NaN();
       }},
      {"infinity",
       [](PencilObservation* p) {
         p->lines[1].points[0].y() = std::numeric_limits<double>::infinity();
       }},
  };
  for (const BrokenPencil& broken : cases) {
    PlaneScene scene;
    Observations observations = scene.Empty();
    observations.pencils = {AlongX(&scene, 2), AlongY(&scene, 2)};
    broken.damage(&observations.pencils[1]);
    const PoseEstimate estimate = SolveDefined("line_pairs", observations);
    ASSERT_FALSE(estimate.status.ok()) << broken.name;
    EXPECT_NE(estimate.status.message.find("L2"), std::string::npos)
        << broken.name << ": " << estimate.status.message;
  }
}

struct BrokenCircle {
  const char* name;
  void (*damage)(CircleObservation* circle);
};

TEST(DegeneracyTest, UnusableContoursAreNamed) {
  const BrokenCircle cases[] = {
      {"fewer points than unknowns", [](CircleObservation* c) { c->points.resize(4); }},
      {"one point repeated",
       [](CircleObservation* c) {
         std::fill(c->points.begin(), c->points.end(), c->points.front());
       }},
      {"four points repeated",
       [](CircleObservation* c) {
         for (std::size_t i = 4; i < c->points.size(); ++i) c->points[i] = c->points[i % 4];
       }},
      {"collinear points",
       [](CircleObservation* c) {
         for (std::size_t i = 0; i < c->points.size(); ++i) {
           c->points[i] = Vector2d(100.0 + 3.0 * static_cast<double>(i), 240.0);
         }
       }},
      {"NaN",
       [](CircleObservation* c) { c->points[3].y() = std::numeric_limits<double>::quiet_NaN(); }},
      {"infinity",
       [](CircleObservation* c) { c->points[0].x() = -std::numeric_limits<double>::infinity(); }},
  };
  for (const BrokenCircle& broken : cases) {
    PlaneScene scene;
    scene.camera.distortion = {};
    Observations observations = OneCircle(&scene);
    observations.circles[0].center = scene.Pixel(0.5, 0.2);
    broken.damage(&observations.circles[0]);
    const PoseEstimate estimate = SolveDefined("circle_center", observations);
    ASSERT_FALSE(estimate.status.ok()) << broken.name;
    EXPECT_NE(estimate.status.message.find("c0"), std::string::npos)
        << broken.name << ": " << estimate.status.message;
  }
}

// Part of a contour is a contour. The shorter the arc, the larger the stated uncertainty; an answer
// is off by no more than that, and what carries no shape is refused.
TEST(DegeneracyTest, ShortArcsKnowWhatTheyDoNotKnow) {
  double previous = 0.0;
  for (const double degrees : {360.0, 180.0, 90.0, 60.0}) {
    PlaneScene scene(0.7, 0.05);
    Observations observations = scene.Empty();
    CircleObservation circle = scene.Circle("c0", 0.5, 0.2, 2.0, 360);
    circle.points.resize(static_cast<std::size_t>(degrees));
    observations.circles = {circle};
    const PoseEstimate estimate = SolveDefined("single_circle", observations);
    ASSERT_EQ(estimate.hypotheses.size(), 2U) << degrees << estimate.status.message;
    // The rotation about the normal is free: what is left of its covariance is the normal's.
    const auto& best = *std::min_element(estimate.hypotheses.begin(), estimate.hypotheses.end(),
                                         [&](const auto& a, const auto& b) {
                                           return NormalError(a, scene) < NormalError(b, scene);
                                         });
    const double sigma = std::sqrt(best.Covariance().topLeftCorner<3, 3>().trace());
    EXPECT_GT(sigma, previous) << degrees;
    EXPECT_LT(NormalError(best, scene), 4.0 * sigma) << degrees;
    previous = sigma;
  }
}

}  // namespace
}  // namespace circline
