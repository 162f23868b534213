// Links neighbouring edge points into chains.
#ifndef CIRCLINE_RANSAC_DETECTION_EDGE_CHAINS_H_
#define CIRCLINE_RANSAC_DETECTION_EDGE_CHAINS_H_

#include <cstdint>
#include <vector>

#include "circline/ransac/detection/edges.h"

namespace circline {

// Chains the points of `map`, which are in any order, point i in pixel `pixels[i]` of its index
// and none in the outermost pixels. Keeps the chains of at least `min_points` points with at least
// one gradient of `high`; then points are in order chain by chain, and the others are gone.
void ChainEdgePoints(const std::vector<std::int32_t>& pixels, double high, int min_points,
                     EdgeMap* map);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_EDGE_CHAINS_H_
