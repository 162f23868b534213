// How much likelier a line is along a direction than any other way. Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_STRUCTURE_LINE_ODDS_H_
#define CIRCLINE_RANSAC_DETECTION_STRUCTURE_LINE_ODDS_H_

#include <Eigen/Core>

#include "circline/estimators/line.h"

namespace circline {

// A line where it was seen, against lines of any orientation at that place. Lines near a vanishing
// point pass by it at a small distance whichever way they run: that says little, and the less the
// nearer they are.
class LineOdds {
 public:
  explicit LineOdds(const LineFit& fit);

  const LineFit& fit() const { return fit_; }
  double Residual(const Eigen::Vector3d& direction) const { return fit_.line.dot(direction); }
  // Of the miss.
  double Variance(const Eigen::Vector3d& direction) const {
    return direction.dot(fit_.covariance * direction);
  }
  // Where the line was seen: its middle, a unit vector in front of the camera.
  const Eigen::Vector3d& middle() const { return middle_; }
  // Sine of the angle between where the line was seen and the direction: the largest miss there.
  double Sine(const Eigen::Vector3d& direction) const;
  // Logarithm of the likelihood ratio for a miss with this variance.
  double LogRatio(const Eigen::Vector3d& direction, double variance) const;

 private:
  LineFit fit_;
  Eigen::Vector3d middle_;
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_STRUCTURE_LINE_ODDS_H_
