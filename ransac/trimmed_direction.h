// A vanishing point from lines whose noise is not known.
#ifndef CIRCLINE_RANSAC_TRIMMED_DIRECTION_H_
#define CIRCLINE_RANSAC_TRIMMED_DIRECTION_H_

#include <cstddef>
#include <vector>

#include "circline/estimators/line.h"
#include "circline/estimators/status.h"
#include "circline/estimators/vanishing_point.h"

namespace circline {

// Direction of least trimmed squares (Rousseeuw 1984): the one whose `num_kept` smallest residuals
// have the smallest sum of squares, whatever the scale of the covariances. From the crossings of
// pairs, at most 200, and two steps of concentration. Refuses fewer than num_kept lines, num_kept <
// 2, and lines that coincide.
Status FitTrimmedDirection(const std::vector<LineFit>& lines, std::size_t num_kept,
                           VanishingPointFit* fit);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_TRIMMED_DIRECTION_H_
