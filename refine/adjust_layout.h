// The circles of many photos in one world. Internal: not installed.
#ifndef CIRCLINE_REFINE_ADJUST_LAYOUT_H_
#define CIRCLINE_REFINE_ADJUST_LAYOUT_H_

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "circline/estimators/pose.h"

namespace circline {

// A circle in the world's plane.
struct LayoutCircle {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  double radius = 1.0;
};
using Layout = std::map<std::string, LayoutCircle>;  // By id.

// A hypothesis' circles in its own plane.
Layout LayoutOf(const PoseHypothesis& hypothesis);

// The layout that photos share, in the frame and unit of the photo that sees most of it, and the
// pose of each in that frame.
struct SharedLayout {
  Layout circles;
  std::vector<CameraPose> poses;
  std::vector<bool> placed;  // False: shares too few circles with the others, or contradicts them.
  std::vector<std::map<std::string, std::string>> names;  // By photo: own id to the shared one.
  // Of pencils, where photos can tell; else they are each photo's own.
  std::vector<std::map<std::string, std::string>> pencil_names;
  double misfit = 0.0;  // Median distance of circles from their place, radii.
};
// Circles are the same where their ids are; or, without `by_id`, where they lie alike: a pattern of
// circles and sizes that both have, be it a lattice or not. (Of a lattice seen in part that is one
// of several ways, which fit alike.)
SharedLayout AlignLayouts(const std::vector<PoseEstimate>& estimates, bool by_id);

}  // namespace circline

#endif  // CIRCLINE_REFINE_ADJUST_LAYOUT_H_
