// The edges of a box in a photo, where they are expected, and the lines on its faces.
#ifndef CIRCLINE_APPS_RECONSTRUCT_SNAP_BOX_H_
#define CIRCLINE_APPS_RECONSTRUCT_SNAP_BOX_H_

#include <vector>

#include "apps/reconstruct/fit_box.h"
#include "circline/ransac/detection/edges.h"
#include "circline/ransac/detection/lines/detect_lines.h"

namespace circline::apps {

struct SnappedBox {
  std::vector<BoxEdge> edges;
  // Of the visible edges: the length along which the photo has edge points; by how much their lines
  // run on beyond the box's corners. Both in all.
  double covered_px = 0.0, overrun_px = 0.0;
};

// The photo's edges: of a colour photo those of each channel, as a box may be as bright as what is
// behind it, and of another colour.
using PhotoEdges = std::vector<EdgeMap>;

// Of each visible edge of the box the edge points of the photo that form a line within `reach_px`
// of where `fit` has it, nearly in its direction. Where there are several lines: of the outline the
// outermost, as prints and bevels lie inside of it; of an edge between two visible faces the one
// with most points or, where a person has marked the box (`is_marked`) so that it is known well,
// the one nearest to where it was expected, as prints lie on either side of it. `shared_px` of a
// marked box's edges is how far off the others lie. Edges of which the photo shows less than a
// third are left out.
SnappedBox SnapBox(const PhotoEdges& edges, const BoxFit& fit, double reach_px, bool is_marked);

// Of the photo's lines those within a visible face of the box, where `fit` has it, and nearly along
// one of its axes: printed borders and pictures are. They tell the box's directions better than its
// worn edges do.
std::vector<FaceLine> FaceLines(const std::vector<DetectedLine>& lines, const BoxFit& fit);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_SNAP_BOX_H_
