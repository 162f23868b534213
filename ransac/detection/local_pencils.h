// Two pencils of one thing: a board, a box, a sheet.
#ifndef CIRCLINE_RANSAC_DETECTION_LOCAL_PENCILS_H_
#define CIRCLINE_RANSAC_DETECTION_LOCAL_PENCILS_H_

#include <array>
#include <vector>

#include "circline/ransac/detection/detect_pencils.h"

namespace circline {

// The lines of pencils come from the whole photo, and are those that are exactly parallel. The
// region in which two pencils form corners may be one thing: then all its lines count, bent or not,
// and no others. Fits both pencils to the lines of that region. False, and nothing changed, where
// less than half of either pencil is left: two directions of a street, say.
bool RefitWhereTheyMeet(const std::vector<DetectedLine>& lines, std::array<DetectedPencil, 2>* pair,
                        double diagonal_px = kUsualDiagonalPx);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_LOCAL_PENCILS_H_
