// Evidence of a direction at right angles to one that is known. Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_ORTHOGONAL_EVIDENCE_H_
#define CIRCLINE_RANSAC_DETECTION_ORTHOGONAL_EVIDENCE_H_

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "circline/estimators/line.h"
#include "circline/ransac/detection/line_odds.h"

namespace circline {

// Some of the lines may share a direction at right angles to `axis`, as walls are (to
// kRightAngleSigmaDeg); the others lie any way. Long, well-measured lines say more than short ones.
class OrthogonalEvidence {
 public:
  // Each line is to be one of its own, no piece of another. Lines may miss the direction by
  // `spread_rad` more than their covariances say.
  OrthogonalEvidence(const std::vector<LineFit>& lines, const Eigen::Vector3d& axis,
                     double spread_rad);

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
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_ORTHOGONAL_EVIDENCE_H_
