// The circles of many photos in one world. Internal: not installed.
#ifndef CIRCLINE_REFINE_MANY_ADJUST_LAYOUT_H_
#define CIRCLINE_REFINE_MANY_ADJUST_LAYOUT_H_

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "circline/estimators/pose.h"
#include "circline/refine/adjust_photos.h"

namespace circline {

// A circle in the world's plane.
struct LayoutCircle {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  double radius = 1.0;
};
using Layout = std::map<std::string, LayoutCircle>;  // By id.

// A hypothesis' circles in its own plane.
Layout LayoutOf(const PoseHypothesis& hypothesis);

// The layout that photos share, and the pose of each in its frame.
struct SharedLayout {
  explicit SharedLayout(std::size_t num_photos = 0)
      : poses(num_photos), placed(num_photos), names(num_photos), pencil_names(num_photos) {}

  Layout circles;
  std::vector<CameraPose> poses;
  std::vector<bool> placed;  // False: shares too few circles with the others, or contradicts them.
  std::vector<std::map<std::string, std::string>> names;  // By photo: own id to the shared one.
  // Of pencils, where photos can tell; else they are each photo's own.
  std::vector<std::map<std::string, std::string>> pencil_names;
  double misfit = 0.0;  // Median distance of circles from their place, units of Place.

  // Adds a photo whose circles lie so in the shared frame. `matched`: what the layout calls those
  // that it has; the others join it, under their own id where that is free.
  void Add(std::size_t photo, const CameraPose& pose, const Layout& own,
           std::map<std::string, std::string> matched);
  // Whether circles are the same where their ids are.
  bool IsById() const;
};
// The frame and unit are those of the photo that sees most.
// Circles are the same where their ids are; or, without `by_id`, where they lie alike: a pattern of
// circles and sizes that both have, be it a lattice or not. (Of a lattice seen in part that is one
// of several ways, which fit alike.)
SharedLayout AlignLayouts(const std::vector<PoseEstimate>& estimates, bool by_id);

// --- layout_alignment.cc: how the circles of a photo lie among those of others. ---

// A layout as an array, from left to right.
struct Place {
  const std::string* id = nullptr;  // In the layout that it was made of.
  LayoutCircle circle;
  // In what it is measured how far another circle is from this one: its radius, or a part of how
  // far the nearest other one of the layout is, where that is more: small circles far apart are
  // told from each other as well as large ones.
  double unit = 1.0;
  // What a match with it counts: 1 for circles of the commonest size, more by the logarithm of how
  // rare its size is. A board's dots match wherever the lattice does, its mark at one place.
  double weight = 1.0;
};
using Places = std::vector<Place>;
Places PlacesOf(const Layout& layout);

// x_to = turn * x_from + shift, where turn is a rotation times scale; or, where said, any map of
// positive determinant, of which scale is the root.
struct Similarity {
  double scale = 1.0;
  Eigen::Matrix2d turn = Eigen::Matrix2d::Identity();
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();

  Eigen::Vector2d operator()(const Eigen::Vector2d& x) const { return turn * x + shift; }
};

// A pose of a photo's own world in the world that `to_shared` maps its plane to.
CameraPose MovedPose(const CameraPose& own, const Similarity& to_shared);

// Indices of a photo's own circles and of the shared ones that they are.
using Pairs = std::vector<std::array<std::size_t, 2>>;

struct Alignment {
  Similarity to_shared;
  Pairs pairs;
  double misfit = 0.0;  // Median distance of these after it, in place, units of Place, and size.
};

// The circles of `from` that lie on one of `to`, each on another: the nearest pairs first. The
// similarity may be affine.
Pairs Matches(const Places& from, const Places& to, const Similarity& similarity);

// All false where too few circles, or none, are those of the other. By their ids:
bool AlignById(const Places& from, const Places& to, Alignment* alignment);
// The similarity under which the circles that coincide say most (Place::weight), of those that a
// few pairs of neighbours ask for.
bool AlignByPattern(const Places& from, const Places& to, Alignment* alignment);
// From one to start from: all circles that coincide under it.
bool AlignFrom(const Places& from, const Places& to, const Similarity& start, Alignment* alignment);

// --- given_poses.cc: photos whose poses are known up to where, how large and how turned the world
// is: which circles of one are which of another, and where they lie. ---

// Where the world lies, and the photos' circles and directions in it. `estimates`: each photo's
// own, the unit of each another one. None where no circle is found in two of them.
std::optional<GivenFrame> PlaceByGivenPoses(const std::vector<PoseEstimate>& estimates,
                                            const std::vector<std::optional<CameraPose>>& given,
                                            SharedLayout* shared);

}  // namespace circline

#endif  // CIRCLINE_REFINE_MANY_ADJUST_LAYOUT_H_
