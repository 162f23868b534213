// The edges of a box in a photo, where they are expected.
#ifndef CIRCLINE_APPS_RECONSTRUCT_SNAP_BOX_H_
#define CIRCLINE_APPS_RECONSTRUCT_SNAP_BOX_H_

#include <vector>

#include "apps/reconstruct/fit_box.h"
#include "circline/ransac/detection/edges.h"

namespace circline::apps {

struct SnappedBox {
  std::vector<BoxEdge> edges;
  // Of the visible edges: the length along which the photo has edge points; by how much their lines
  // run on beyond the box's corners. Both in all.
  double covered_px = 0.0, overrun_px = 0.0;
};

// Of each visible edge of the box the edge points of the photo that form a line within `reach_px`
// of where `fit` has it, nearly in its direction. Where there are several lines: of the outline the
// outermost, as prints and bevels lie inside of it; of an edge between two visible faces the one
// with most points. Edges of which the photo shows less than a third are left out.
SnappedBox SnapBox(const EdgeMap& edges, const BoxFit& fit, double reach_px);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_SNAP_BOX_H_
