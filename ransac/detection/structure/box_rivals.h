// Two pencils of parallel lines that say otherwise than a box. Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_STRUCTURE_BOX_RIVALS_H_
#define CIRCLINE_RANSAC_DETECTION_STRUCTURE_BOX_RIVALS_H_

#include <vector>

#include "circline/ransac/detection/structure/choose_plane.h"
#include "circline/ransac/detection/structure/find_box.h"

namespace circline {

// Whether the evidence of two pencils (LogOddsOfDirection) is such that no box outweighs it.
// `lines` are those that the pencils' members index.
bool OutweighAnyBox(const std::vector<DetectedLine>& lines, const PlacedPencil& a,
                    const PlacedPencil& b);

// Whether two pencils have better evidence than the box, directions that they have in common left
// out, which speak for both. The two are those that span the plane, unless the box has the
// directions of both; or, where the plane is that of one circle, those that would span one without
// it, if they also outweigh any box (the circle and the box speak for each other): then the plane
// becomes theirs, and the pencils as ChoosePlane fits them. What passes for a circle may be a
// lamp's shadow.
bool YieldsToPencils(const FoundBox& box, const AssemblyOptions& options,
                     const std::vector<DetectedLine>& lines,
                     const std::vector<CircleEvidence>& circles, Plane* plane,
                     std::vector<PlacedPencil>* pencils);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_STRUCTURE_BOX_RIVALS_H_
