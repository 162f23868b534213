// Minimising from a start that may be far off: graduated non-convexity. Internal: not installed.
#ifndef CIRCLINE_REFINE_GRADUATED_H_
#define CIRCLINE_REFINE_GRADUATED_H_

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "circline/estimators/status.h"
#include "circline/refine/joint_evidence.h"
#include "circline/refine/quadratic_models.h"
#include "circline/refine/reduced_problem.h"

namespace circline {

// Image of a circle as it stands, calibrated coordinates.
Eigen::Matrix3d ImageOf(const CircleTerm& term, const JointState& state);

// Calls visit(set, is_circle, term, distances) for each circle that takes part, then for each line;
// distances of the set's points, signed, pixels.
template <typename Visit>
void ForEachCurve(const JointEvidence& e, const JointState& state, const Visit& visit) {
  std::vector<double> distances;
  const auto set = [&e](int index) -> const PointSet& {
    return e.sets[static_cast<std::size_t>(index)];
  };
  for (std::size_t i = 0; i < e.circles.size(); ++i) {
    if (state.circle_left_out[i] != 0) continue;
    ConicDistances(set(e.circles[i].set), ImageOf(e.circles[i], state), &distances);
    visit(set(e.circles[i].set), true, i, distances);
  }
  for (std::size_t i = 0; i < e.lines.size(); ++i) {
    if (state.line_left_out[i] != 0) continue;
    Eigen::Matrix3d unused;
    const Eigen::Vector3d line = state.rotation * LineNormal(e.lines[i], state, &unused);
    LineDistances(set(e.lines[i].set), line, &distances);
    visit(set(e.lines[i].set), false, i, distances);
  }
}

// By how much the losses must be stretched for (nearly) all residuals to lie where they are convex;
// 1 where nothing lies far in their tails.
double NeededStretch(const JointEvidence& evidence, const JointState& state);

// Minimize (minimize.h), where residuals lie far in the tails under losses as wide as these
// ask for, which narrow to their own width as the residuals shrink (Black and Rangarajan 1996).
Status GraduatedMinimize(const JointEvidence& evidence, int max_iterations, double tolerance,
                         JointState* state);

}  // namespace circline

#endif  // CIRCLINE_REFINE_GRADUATED_H_
