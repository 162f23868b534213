// The corners, faces and edges of a box.
#ifndef CIRCLINE_APPS_RECONSTRUCT_BOX_GEOMETRY_H_
#define CIRCLINE_APPS_RECONSTRUCT_BOX_GEOMETRY_H_

#include <Eigen/Core>

#include "apps/common/solids.h"
#include "apps/reconstruct/fit_box.h"

namespace circline::apps {

// The box's corner with these bits: 1 far along x, 2 along y, 4 along z.
Eigen::Vector3d BoxCorner(const Eigen::Vector3d& length, int corner);

// Whether the camera sees the face across `axis`, at its far or its near end, from outside.
bool FaceIsSeen(const BoxFit& fit, int axis, bool far);

// Of the two faces that meet in the edge along `axis` at that corner, how many it sees.
int NumSeenFaces(const BoxFit& fit, int axis, int corner);

// Of the part that is marked or found, in whatever order its points are.
double EdgeLengthPx(const BoxEdge& edge);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_BOX_GEOMETRY_H_
