// The minima of all readings of a photo's evidence: which features take part, and from where.
// Internal: not installed.
#ifndef CIRCLINE_REFINE_READING_SEARCH_H_
#define CIRCLINE_REFINE_READING_SEARCH_H_

#include <vector>

#include "circline/estimators/status.h"
#include "circline/refine/joint_problem.h"
#include "circline/refine/pose_seeds.h"

namespace circline {

// Radians. Solutions stop within a few hundredths of a standard deviation, and those of hopeless
// evidence have a tenth of a radian.
inline constexpr double kSamePose = 1e-3;

// One pose, up to what the evidence cannot tell: the spin about the normal where that is free, and
// the senses of the axes, which are settled by convention and may tip over.
bool IsSamePose(const JointProblem& problem, const State& a, const State& b,
                double tolerance = kSamePose);

// All minima of all readings that compete, in the order of the seeds; their cost is with what is
// left out. A feature that contradicts the others as a whole makes a reading without it, and the
// one with it stays. Not ok: no seed could be refined.
Status FindMinima(const JointProblem& problem, const std::vector<Seed>& seeds,
                  std::vector<State>* minima);

}  // namespace circline

#endif  // CIRCLINE_REFINE_READING_SEARCH_H_
