// Photos that show what another one shows already. Internal: not installed.
#ifndef CIRCLINE_REFINE_EQUAL_VIEWS_H_
#define CIRCLINE_REFINE_EQUAL_VIEWS_H_

#include <vector>

#include "circline/estimators/observations.h"

namespace circline {

// For each photo the first one of the same camera that shows nearly the same: four fifths of the
// features of each lie within `distance`, of the photo's diagonal, of one of the other; -1 where
// there is none. Ids mean nothing here.
std::vector<int> NearlyEqualViews(const std::vector<Observations>& photos, double distance);

}  // namespace circline

#endif  // CIRCLINE_REFINE_EQUAL_VIEWS_H_
