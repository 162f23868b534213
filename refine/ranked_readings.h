// From minima to ranked hypotheses; circles that contradict the rest are read a second time.
// Internal: not installed.
#ifndef CIRCLINE_REFINE_RANKED_READINGS_H_
#define CIRCLINE_REFINE_RANKED_READINGS_H_

#include <vector>

#include "circline/estimators/pose.h"
#include "circline/estimators/status.h"
#include "circline/refine/joint_problem.h"

namespace circline {

// Fills the hypotheses of all minima that compete, of the second ellipses of circles that these
// leave out besides, and adds the notes of the best one. Not ok: no minimum gives a hypothesis.
Status RankReadings(const JointProblem& problem, const std::vector<State>& minima,
                    PoseEstimate* estimate);

}  // namespace circline

#endif  // CIRCLINE_REFINE_RANKED_READINGS_H_
