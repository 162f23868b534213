// Where the refinement of a box begins.
#ifndef CIRCLINE_APPS_RECONSTRUCT_BOX_START_H_
#define CIRCLINE_APPS_RECONSTRUCT_BOX_START_H_

#include <Eigen/Core>
#include <array>
#include <vector>

#include "apps/common/solids.h"
#include "circline/estimators/camera.h"

namespace circline::apps {

// The normal of the plane through the camera and the points of a straight edge. False where the
// camera can undistort no two of them.
bool PlaneOfPoints(const Camera& camera, const std::vector<Eigen::Vector2d>& pixels,
                   Eigen::Vector3d* normal);

// Rotations of which each axis lies in one of three planes through the camera, those of the images
// of three edges of a box: two at most; none where no directions at right angles look like that.
// Senses are without meaning.
std::vector<Eigen::Matrix3d> OrthogonalAxes(const std::array<Eigen::Vector3d, 3>& normals);

// The same of the longest edge along each axis.
std::vector<Eigen::Matrix3d> BoxAxes(const Camera& camera, const std::vector<BoxEdge>& edges);

// Where the box lies if its axes are these: least squares over the edges, up to scale. False where
// they do not fix it. Lengths may be negative: the box then lies along the negative axis.
bool PlaceBox(const Camera& camera, const std::vector<BoxEdge>& edges, const Eigen::Matrix3d& axes,
              Eigen::Vector3d* translation, Eigen::Vector3d* length);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_BOX_START_H_
