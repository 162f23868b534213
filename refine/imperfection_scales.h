// How exact this photo's world is, against what the noise model takes it for: a board is flatter
// than a box, a box straighter than a street. Internal: not installed.
#ifndef CIRCLINE_REFINE_IMPERFECTION_SCALES_H_
#define CIRCLINE_REFINE_IMPERFECTION_SCALES_H_

#include "circline/estimators/noise_model.h"
#include "circline/refine/joint_problem.h"

namespace circline {

// Whether there are features enough for any scale.
bool HasManyFeatures(const JointProblem& problem);

// The noise model with the standard deviations that many features of one kind have, each its own
// draw (tilt, height and shared error of contours; deviation and shared error of lines), scaled to
// how far these features contradict each other at a minimum. NoiseModel::spread says by how much
// its own figures may be off.
NoiseModel ScaledNoiseModel(const JointProblem& problem, const State& minimum);

}  // namespace circline

#endif  // CIRCLINE_REFINE_IMPERFECTION_SCALES_H_
