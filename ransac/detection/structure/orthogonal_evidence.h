// Evidence of directions at right angles to one that is known. Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_STRUCTURE_ORTHOGONAL_EVIDENCE_H_
#define CIRCLINE_RANSAC_DETECTION_STRUCTURE_ORTHOGONAL_EVIDENCE_H_

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "circline/estimators/line.h"
#include "circline/estimators/observations.h"
#include "circline/ransac/detection/structure/line_odds.h"

namespace circline {

// Some of the lines may share a direction at right angles to `axis`, as walls are (to
// kRightAngleSigmaDeg); the others lie any way. Long, well-measured lines say more than short ones.
class OrthogonalEvidence {
 public:
  // Each line is to be one of its own, no piece of another. Lines may miss the direction by
  // kParallelSigmaRad more than their covariances say. `num_along`: lines along the axis, off which
  // some of these have drifted (ransac/drifted_lines.h).
  OrthogonalEvidence(const std::vector<LineFit>& lines, const Eigen::Vector3d& axis,
                     std::size_t num_along);

  // Logarithm of the odds that some share about this direction to that all lie any way. The
  // likelihood of the mixture is integrated over the direction's angle about the axis (Laplace),
  // uniform before.
  double LogOdds(const Eigen::Vector3d& direction) const;

  // The direction with the highest odds of those that single lines have if they are at right angles
  // to the axis; none where there are no odds above kMinLogOdds.
  std::optional<Eigen::Vector3d> Best() const;

  // Logarithm of the odds of the best of these to none, whatever they are; the lines' evidence of
  // the third direction counts where it speaks for it.
  double HighestLogOdds() const;

 private:
  // The directions that single lines have if they are at right angles to the axis.
  std::vector<Eigen::Vector3d> Proposals() const;

  Eigen::Vector3d axis_;
  std::vector<LineOdds> lines_;
  double drifted_for_each_ = 0.0;  // Lines that drift, for each of the lines.
};

// Directions about `direction`, turned about `axis`, and how probable each is by all of `lines`: a
// mixture of `num_own` lines along it, which leans from the right angle to the axis by what walls
// do (kRightAngleSigmaDeg, integrated over), and others that run any way. A fit that knows which
// lines are its own misses that others might be.
std::vector<DirectionReading> ReadDirection(const std::vector<LineFit>& lines,
                                            const Eigen::Vector3d& axis,
                                            const Eigen::Vector3d& direction, int num_own);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_STRUCTURE_ORTHOGONAL_EVIDENCE_H_
