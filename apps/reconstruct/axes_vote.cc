#include "apps/reconstruct/axes_vote.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "apps/reconstruct/box_start.h"
#include "circline/ransac/detection/lines/segment_meetings.h"

namespace circline::apps {
namespace {

constexpr double kMinSine = 0.2;        // Of a line's plane against an axis that it is across of.
constexpr double kSameCosine = 0.9998;  // One degree.
constexpr std::size_t kMostAxes = 48;

}  // namespace

AxesVote::AxesVote(const std::vector<FlatLine>& lines, double focal_px)
    : lines_(lines), focal_px_(focal_px) {
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (std::size_t j = i + 1; j < lines.size(); ++j) {
      if (FormCorner(lines[i].ends, lines[j].ends)) corners_.push_back({i, j});
    }
  }
}

void AxesVote::Try(const Eigen::Vector3d& axis) {
  for (const FlatLine& line : lines_) {
    const Eigen::Vector3d along = line.plane.cross(axis);
    if (!(along.norm() > kMinSine)) continue;
    Eigen::Matrix3d axes;
    axes << along.normalized(), axis.cross(along.normalized()), axis;
    votes_.emplace_back(Vote(axes), axes);
  }
}

void AxesVote::TryTriples() {
  for (const auto& [i, j] : corners_) {
    // Those that go on from j to a line that forms one with i, too.
    for (auto next = std::lower_bound(corners_.begin(), corners_.end(), Corner{j, 0});
         next != corners_.end() && (*next)[0] == j; ++next) {
      const std::size_t l = (*next)[1];
      if (!std::binary_search(corners_.begin(), corners_.end(), Corner{i, l})) continue;
      for (const Eigen::Matrix3d& axes :
           OrthogonalAxes({lines_[i].plane, lines_[j].plane, lines_[l].plane}))
        votes_.emplace_back(Vote(axes), axes);
    }
  }
}

std::vector<Eigen::Matrix3d> AxesVote::Best() {
  std::stable_sort(votes_.begin(), votes_.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<Eigen::Matrix3d> best;
  for (const auto& [vote, axes] : votes_) {
    const bool is_new = std::none_of(best.begin(), best.end(), [&a = axes](const auto& b) {
      return (a.transpose() * b).cwiseAbs().rowwise().maxCoeff().minCoeff() > kSameCosine;
    });
    if (is_new) best.push_back(axes);
    if (best.size() == kMostAxes) break;
  }
  return best;
}

double AxesVote::Vote(const Eigen::Matrix3d& axes) const {
  std::vector<int> axis(lines_.size(), -1);
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      if (IsAlong(lines_[i], axes.col(k), focal_px_)) axis[i] = k;
    }
  }
  double sum = 0.0;
  for (const auto& [i, j] : corners_) {
    if (axis[i] < 0 || axis[j] < 0 || axis[i] == axis[j]) continue;
    sum += std::min(lines_[i].LengthPx(), lines_[j].LengthPx());
  }
  return sum;
}

}  // namespace circline::apps
