// How the circles of a photo lie among those of others. Internal: not installed.
#ifndef CIRCLINE_REFINE_LAYOUT_ALIGNMENT_H_
#define CIRCLINE_REFINE_LAYOUT_ALIGNMENT_H_

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "circline/refine/adjust_layout.h"

namespace circline {

// A layout as an array, from left to right.
struct Place {
  const std::string* id = nullptr;  // In the layout that it was made of.
  LayoutCircle circle;
};
using Places = std::vector<Place>;
Places PlacesOf(const Layout& layout);

// x_to = turn * x_from + shift, where turn is a rotation times scale.
struct Similarity {
  double scale = 1.0;
  Eigen::Matrix2d turn = Eigen::Matrix2d::Identity();
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();

  Eigen::Vector2d operator()(const Eigen::Vector2d& x) const { return turn * x + shift; }
};

// Indices of a photo's own circles and of the shared ones that they are.
using Pairs = std::vector<std::array<std::size_t, 2>>;

struct Alignment {
  Similarity to_shared;
  Pairs pairs;
  double misfit = 0.0;  // Median distance of these after it, in place and size; radii.
};

// How far two sights of one circle may lie from each other: in place, radii, and in size, the
// logarithm of its ratio; where both are off, together no more than either.
struct Reach {
  double place = 0.3, size = 0.3;
};

// The circles of `from` that lie on one of `to`, each on another: the nearest pairs first.
Pairs Matches(const Places& from, const Places& to, const Similarity& similarity,
              const Reach& reach = {});

// All false where too few circles, or none, are those of the other. By their ids:
bool AlignById(const Places& from, const Places& to, Alignment* alignment);
// The similarity under which most circles coincide, of those that a few pairs of neighbours ask
// for.
bool AlignByPattern(const Places& from, const Places& to, Alignment* alignment);
// From one to start from: all circles that coincide under it.
bool AlignFrom(const Places& from, const Places& to, const Similarity& start, Alignment* alignment);

}  // namespace circline

#endif  // CIRCLINE_REFINE_LAYOUT_ALIGNMENT_H_
