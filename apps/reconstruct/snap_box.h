// The edges of a box in a photo, where they are expected.
#ifndef CIRCLINE_APPS_RECONSTRUCT_SNAP_BOX_H_
#define CIRCLINE_APPS_RECONSTRUCT_SNAP_BOX_H_

#include <vector>

#include "apps/reconstruct/fit_box.h"
#include "circline/ransac/detection/edges.h"

namespace circline::apps {

// Of each visible edge of the box the edge points of the photo that form a line within `reach_px`
// of where `fit` has it, nearly in its direction. Where there are several lines: of the outline the
// outermost, as prints and bevels lie inside of it; of an edge between two visible faces the one
// with most points. Edges of which the photo shows less than a third are left out.
// `overrun_px` (may be null): by how much these lines run on beyond the box's corners, in all.
std::vector<BoxEdge> SnapBox(const EdgeMap& edges, const BoxFit& fit, double reach_px,
                             double* overrun_px = nullptr);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_SNAP_BOX_H_
