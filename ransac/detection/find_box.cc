#include "circline/ransac/detection/find_box.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "circline/ransac/detection/box_search.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Least odds of a box, kLogCorners times the logarithm of the number of corners in the photo beyond
// kLogOddsOfNone: by accident one normal in a hundred has as much, on photos of few lines and of
// many (the test RealPhotographs.BoxesAreRare*). And by how much the odds exceed those of a box on
// the other plane.
constexpr double kLogCorners = 2.0;
constexpr double kLogOddsOfNone = -4.0;
constexpr double kMinLogMargin = 2.0;
// The same where nothing but a pencil says where an axis is, and as a photo has several pencils:
// one direction of nothing in five hundred has as much, on box-camprodon, chessboard-opencv and
// turntable-teabox.
constexpr double kLogOddsOfNoneFree = 2.0;
// A pencil with a few lines of other things is half a degree off.
constexpr double kPencilSigmaRad = 0.01;
// Axes nearer than this, each to each, are those of one box: a cosine, 3 degrees.
constexpr double kSameBox = 0.9986;

double LeastLogOdds(const BoxSearch& search, double of_none) {
  return kLogCorners * std::log(std::max(1, search.num_corners())) + of_none;
}

// The first `count` axes in the order of their lines' length.
void PutLongestFirst(int count, FoundBox* box) {
  std::array<int, 3> order = {0, 1, 2};
  std::stable_sort(order.begin(), order.begin() + count, [box](int a, int b) {
    return box->pencils[static_cast<std::size_t>(a)].support_px >
           box->pencils[static_cast<std::size_t>(b)].support_px;
  });
  FoundBox before = *box;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto from = static_cast<std::size_t>(order[k]);
    box->pencils[k] = std::move(before.pencils[from]);
    box->log_odds_along[k] = before.log_odds_along[from];
  }
  box->axes = AxesOf(box->axes.col(order[0]), box->axes.col(order[2]));
}

}  // namespace

std::optional<FoundBox> FindBox(const std::vector<DetectedLine>& lines,
                                const std::vector<Vector3d>& normals, double diagonal_px) {
  BoxSearch search(lines, diagonal_px);
  BoxSearch::Box best;
  std::size_t best_normal = 0;
  double second = -std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < normals.size(); ++k) {
    BoxSearch::Box box = search.Find(normals[k], 0.0);
    second = std::max(second, std::min(box.log_odds, best.log_odds));
    if (!(box.log_odds > best.log_odds)) continue;
    best = std::move(box);
    best_normal = k;
  }
  if (!(best.log_odds >= LeastLogOdds(search, kLogOddsOfNone) &&
        best.log_odds - second >= kMinLogMargin)) {
    return std::nullopt;
  }
  FoundBox found = search.Finish(best);
  found.normal = best_normal;
  PutLongestFirst(2, &found);
  return found;
}

std::optional<FoundBox> FindFreeBox(const std::vector<DetectedLine>& lines,
                                    const std::vector<Vector3d>& axes, double diagonal_px) {
  BoxSearch search(lines, diagonal_px);
  std::vector<BoxSearch::Box> boxes;
  for (const Vector3d& axis : axes) boxes.push_back(search.Find(axis, kPencilSigmaRad));
  std::stable_sort(boxes.begin(), boxes.end(),
                   [](const auto& a, const auto& b) { return a.log_odds > b.log_odds; });
  if (boxes.empty() || !(boxes[0].log_odds >= LeastLogOdds(search, kLogOddsOfNoneFree)))
    return std::nullopt;
  for (std::size_t k = 1; k < boxes.size(); ++k) {
    if (boxes[0].log_odds - boxes[k].log_odds >= kMinLogMargin) break;
    const Matrix3d cosines = (boxes[0].axes.transpose() * boxes[k].axes).cwiseAbs();
    if (cosines.rowwise().maxCoeff().minCoeff() < kSameBox) return std::nullopt;
  }
  FoundBox found = search.Finish(boxes[0]);
  PutLongestFirst(3, &found);
  return found;
}

}  // namespace circline
