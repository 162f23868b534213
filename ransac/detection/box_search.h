// The search for a box of find_box.h. Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_BOX_SEARCH_H_
#define CIRCLINE_RANSAC_DETECTION_BOX_SEARCH_H_

#include <Eigen/Core>
#include <array>
#include <limits>
#include <vector>

#include "circline/ransac/detection/find_box.h"
#include "circline/ransac/detection/line_odds.h"

namespace circline {

// Logarithm of how much likelier lines[members] are along the direction than along any, with the
// errors and the prior odds of a box's edges.
double LogOddsOfDirection(const std::vector<DetectedLine>& lines, const std::vector<int>& members,
                          const Eigen::Vector3d& direction);

// Columns x, normal x x, normal.
Eigen::Matrix3d AxesOf(const Eigen::Vector3d& x, const Eigen::Vector3d& normal);

// Among the lines that end where others do: only they can be edges of a box.
class BoxSearch {
 public:
  // `lines` must outlive it.
  BoxSearch(const std::vector<DetectedLine>& lines, double diagonal_px);

  struct Box {
    Eigen::Matrix3d axes;
    std::array<std::vector<int>, 3> edges;  // Of BoxSearch's.
    double log_odds = -std::numeric_limits<double>::infinity();
  };

  // The best box with this normal, or with one that differs by a Gaussian error of so much,
  // radians; odds of minus infinity where there is none.
  Box Find(const Eigen::Vector3d& normal, double sigma_rad);

  FoundBox Finish(const Box& box) const;

  int num_corners() const { return num_corners_; }

 private:
  struct Edge {
    int line;                  // Index into lines_.
    LineOdds odds;             // With all that it may miss its direction by.
    std::vector<int> corners;  // Those it forms a corner with, indices into edges_.
  };

  // Of lines that form corners: edges, and which form them.
  void FindCorners(double diagonal_px);
  // At any angle about the normal, of which edges may be off by so much; and from there to where
  // its edges agree best.
  Box FindOn(const Eigen::Vector3d& normal, double off_variance);
  // Which axis each edge is most likely along, and the logarithm of its odds.
  void Assign(const Eigen::Matrix3d& axes, double off_variance);
  // The likeliest set of edges that corners between different axes connect. Each two of the axes
  // have a corner in common: only lines that differ in the photo can be told from one another.
  void Consider(const Eigen::Matrix3d& axes, double off_variance, Box* best);
  // Turned to where its edges agree best, one Gauss-Newton step: by a rotation d the miss l . v of
  // an edge along v changes by d . (v x l).
  Eigen::Matrix3d Turned(const Box& box) const;

  const std::vector<DetectedLine>& lines_;
  std::vector<Edge> edges_;
  int num_corners_ = 0;
  // Of the box that is looked for; how well it is known, squared radians.
  Eigen::Vector3d normal_ = Eigen::Vector3d::UnitZ();
  double variance_ = 0.0;
  // Of each edge, for the axes considered.
  std::vector<int> axis_;
  std::vector<double> gain_;
  std::vector<char> seen_;
  std::vector<int> queue_;
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_BOX_SEARCH_H_
