// What each closed form takes of the evidence, and the propositions as functions of these inputs:
// every pose, and how far each contradicts the evidence that it was not computed from. Internal:
// not installed.
#ifndef CIRCLINE_ESTIMATORS_CLOSED_FORM_RECIPES_H_
#define CIRCLINE_ESTIMATORS_CLOSED_FORM_RECIPES_H_

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "circline/estimators/circle_pose.h"
#include "circline/estimators/closed_form_inputs.h"
#include "circline/estimators/pose.h"

namespace circline {

// --- closed_form_poses.cc ---

struct Candidate {
  CameraPose pose;
  Eigen::VectorXd contradiction;     // Zero where all evidence agrees; may be empty.
  std::optional<CirclePose> circle;  // The first of Inputs::circles.
};

// Rotation of a plane with unit normal +-n: in-plane angle from the axis lines (proposition 2;
// both: proposition 4), or by convention, X towards the camera's right. Senses as drawn, then +Z
// towards the camera, then X to the right. `plane_ray` meets the plane in front of the camera.
bool RotationOfPlane(const Eigen::Vector3d& n, const Eigen::Vector3d& plane_ray,
                     const Inputs& inputs, Eigen::Matrix3d* rotation);

std::vector<Candidate> SingleCirclePoses(const Inputs& inputs);
// Proposition 3; contradiction: the centre's deviation, calibrated units, 2.
std::vector<Candidate> CircleCenterPoses(const Inputs& inputs);
// Proposition 4; contradiction: the cosine between the axes, 1, and the deviation of a centre at
// their crossing, 2.
std::vector<Candidate> CircleFramePoses(const Inputs& inputs);
// Common plane of several circles, weighted; contradiction: the other circles' normals, 2 each,
// and, of concentric ones, their centres, 2 each.
std::vector<Candidate> ParallelCirclePoses(const Inputs& inputs);
std::vector<Candidate> ConcentricCirclePoses(const Inputs& inputs);
// Proposition 5: the better-measured direction keeps its place, the other spans the plane.
std::vector<Candidate> LinePairPoses(const Inputs& inputs);
// Proposition 1: two axes' directions, the excess over 90 degrees split by variance.
std::vector<Candidate> OrthogonalDirectionPoses(const Inputs& inputs);

// --- circle_recipes.cc, pencil_recipes.cc ---

struct Recipe {
  std::string name, needs;
  std::string decided_by;  // What tells several hypotheses apart.
  // Keeps of the (fitted, resolved) observations what is used; a refusal says what was missing.
  std::function<Status(const Observations&, Observations*)> select;
  // Reads the kept evidence.
  std::function<Status(const Observations&, double sigma_px, Inputs*)> gather;
  std::function<std::vector<Candidate>(const Inputs&)> evaluate;
};

// Camera, frame, and the known lengths of the frame's plane.
Observations KeepFrame(const Observations& observations, const FrameObservation& frame);

// A circle's centre, where its diameters cross: in calibrated coordinates that is to chords what a
// vanishing point is to a pencil's lines.
Status GatherDiameters(const Camera& camera, const CircleObservation& circle, double sigma_px,
                       Measured* center);

std::vector<Recipe> PencilRecipes();
std::vector<Recipe> CircleRecipes();

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_CLOSED_FORM_RECIPES_H_
