// Edges of one solid that pass for circles: the rims of a cup, a saucer, a collar, a wheel, the top
// of a coin and its outline. They lie at different heights, rounded: a plane that they share would
// choose one of two poses by how they err, and of two that pass for concentric by their heights.
// Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_STRUCTURE_SOLID_RIMS_H_
#define CIRCLINE_RANSAC_DETECTION_STRUCTURE_SOLID_RIMS_H_

#include <Eigen/Core>
#include <vector>

#include "circline/ransac/detection/structure/assemble_observations.h"

namespace circline {

class SolidRims {
 public:
  explicit SolidRims(const std::vector<CircleEvidence>& circles);

  // Whether circle `i` says nothing of a plane with this normal beside `members`, circles by index:
  // another rim of its solid is among them, or it is no rim there, but an outline.
  bool IsSilent(int i, const std::vector<int>& members, const Eigen::Vector3d& normal) const;

  // The rim that circle `i` is taken for in a plane with this normal: its own, or where it is an
  // outline there the one that it touches.
  int RimOf(int i, const Eigen::Vector3d& normal) const;

 private:
  // Two rims that touch on one side. Seen from above, that is the far side of a thing that stands
  // out, whose top is the inner one, and the outer one goes over to its foot; of a hollow it is the
  // near side, and the inner one goes over from its floor to its mouth.
  struct Touch {
    int other;
    bool is_outer;
    Eigen::Vector2d center;   // Of the outer one, calibrated.
    Eigen::Vector2d towards;  // The side, from there.

    // Whether this is the rim that goes over to the other's height.
    bool IsOutline(const Eigen::Vector3d& normal) const;
  };
  struct Rim {
    std::vector<int> others;  // Of its solid.
    std::vector<Touch> touches;
  };
  void AddConcentric(const std::vector<CircleEvidence>& circles);

  std::vector<Rim> rims_;  // By circle.
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_STRUCTURE_SOLID_RIMS_H_
