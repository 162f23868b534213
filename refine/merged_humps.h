// Hypotheses that are one pose. Internal: not installed.
#ifndef CIRCLINE_REFINE_MERGED_HUMPS_H_
#define CIRCLINE_REFINE_MERGED_HUMPS_H_

#include <vector>

#include "circline/estimators/pose.h"

namespace circline {

// Hypotheses that are less apart than they are wide become one: the pose that fits best, with the
// covariance of all about it, and with the volume of all (log_det), so that it is as probable as
// they are together. Ranks what is left. The two poses of a lone circle stay two, however near.
void MergeHumps(std::vector<PoseHypothesis>* hypotheses);

}  // namespace circline

#endif  // CIRCLINE_REFINE_MERGED_HUMPS_H_
