// Which axes of a box the corners of a photo's lines speak for.
#ifndef CIRCLINE_APPS_RECONSTRUCT_AXES_VOTE_H_
#define CIRCLINE_APPS_RECONSTRUCT_AXES_VOTE_H_

#include <Eigen/Core>
#include <array>
#include <utility>
#include <vector>

#include "apps/reconstruct/box_support.h"

namespace circline::apps {

// `lines` outlive it.
class AxesVote {
 public:
  AxesVote(const std::vector<FlatLine>& lines, double focal_px);

  // One axis is `axis`, unit; a second one at right angles to it is seen along one of the lines.
  void Try(const Eigen::Vector3d& axis);
  // Three lines that form corners with one another leave few.
  void TryTriples();

  // Columns; best first, without those that are nearly the same.
  std::vector<Eigen::Matrix3d> Best();

 private:
  using Corner = std::array<std::size_t, 2>;  // Indices into lines_, ascending.

  // Length of lines that form corners between different axes, the shorter of each two.
  double Vote(const Eigen::Matrix3d& axes) const;

  const std::vector<FlatLine>& lines_;
  double focal_px_;
  std::vector<Corner> corners_;  // In order.
  std::vector<std::pair<double, Eigen::Matrix3d>> votes_;
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_AXES_VOTE_H_
