#include "circline/ransac/detection/structure/find_box.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/estimators/pose.h"
#include "circline/ransac/detection/lines/segment_meetings.h"
#include "circline/ransac/detection/structure/box_edge.h"
#include "circline/ransac/detection/structure/line_odds.h"
#include "circline/ransac/detection/structure/right_angled_axes.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// No box, or no axis.
constexpr double kImpossible = -std::numeric_limits<double>::infinity();

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

// Columns x, normal x x, normal.
Matrix3d AxesOf(const Vector3d& x, const Vector3d& normal) {
  Matrix3d axes;
  axes << x, normal.cross(x), normal;
  return axes;
}

Matrix3d Rotated(const Matrix3d& axes, double angle) {
  return AxesOf(std::cos(angle) * axes.col(0) + std::sin(angle) * axes.col(1), axes.col(2));
}

struct BoxHypothesis {
  std::size_t given = 0;  // Index of the axis that it was looked for about.
  Matrix3d axes = Matrix3d::Identity();
  std::array<std::vector<int>, 3> edges;  // Along each axis, indices of lines.
  double log_odds = kImpossible;
};

// Only lines that end where others do can be edges of a box.
class BoxSearch {
 public:
  // `lines` must outlive it.
  BoxSearch(const std::vector<DetectedLine>& lines, double diagonal_px) : lines_(lines) {
    std::vector<std::vector<std::size_t>> corners = FindCorners(lines, diagonal_px);
    std::size_t num_ends = 0;  // Of lines, in corners.
    for (std::size_t i = 0; i < lines.size(); ++i) {
      num_ends += corners[i].size();
      edges_.push_back({LineOdds(WornEdge(lines[i])), std::move(corners[i])});
    }
    num_corners_ = static_cast<int>(num_ends / 2);
    axis_.resize(edges_.size());
    gain_.resize(edges_.size());
    seen_.resize(edges_.size());
  }

  // The box with the highest odds about one of the axes, known to `sigma_rad`; none where the odds
  // are too low, or do not tell it from another box or, of axes that are known, from one about
  // another.
  std::optional<FoundBox> Best(const std::vector<Vector3d>& axes, double sigma_rad,
                               double log_odds_of_none) {
    variance_ = sigma_rad * sigma_rad;
    std::vector<BoxHypothesis> boxes;
    for (std::size_t k = 0; k < axes.size(); ++k) {
      normal_ = axes[k];
      boxes.push_back(FindOnNormal());
      boxes.back().given = k;
    }
    return Choose(std::move(boxes), log_odds_of_none);
  }

  // The same about no axis that is given, from every three edges in a row that may be along one
  // axis each.
  std::optional<FoundBox> BestOfAll() {
    constexpr std::size_t kMostStarts = 12;  // As many as boxes may be in a photo, and more.
    variance_ = std::numeric_limits<double>::infinity();
    std::vector<BoxHypothesis> starts = StartsFromCorners(), boxes;
    std::stable_sort(starts.begin(), starts.end(), HasHigherOdds);
    std::vector<Matrix3d> tried;
    for (const BoxHypothesis& start : starts) {
      const auto is_same = [&](const Matrix3d& axes) { return AreSame(axes, start.axes); };
      if (std::any_of(tried.begin(), tried.end(), is_same)) continue;
      tried.push_back(start.axes);
      boxes.push_back(Climb(start));
      if (tried.size() == kMostStarts) break;
    }
    std::optional<FoundBox> best = Choose(std::move(boxes), kLogOddsOfNoneFree);
    if (!best) return best;
    // Any pencil gives its axis odds: those of the two others are what makes it a box.
    std::array<double, 3> odds = best->log_odds_along;
    std::sort(odds.begin(), odds.end());
    if (odds[0] + odds[1] < kLogCorners * std::log(num_corners_)) best.reset();
    return best;
  }

 private:
  struct Edge {
    LineOdds odds;                     // With all that it may miss its direction by.
    std::vector<std::size_t> corners;  // Those it forms a corner with, indices into edges_.
  };

  static bool AreSame(const Matrix3d& a, const Matrix3d& b) {
    return (a.transpose() * b).cwiseAbs().rowwise().maxCoeff().minCoeff() >= kSameBox;
  }

  static bool HasHigherOdds(const BoxHypothesis& a, const BoxHypothesis& b) {
    return a.log_odds > b.log_odds;
  }

  std::optional<FoundBox> Choose(std::vector<BoxHypothesis> boxes, double log_odds_of_none) const {
    std::stable_sort(boxes.begin(), boxes.end(), HasHigherOdds);
    const double least = kLogCorners * std::log(std::max(1, num_corners_)) + log_odds_of_none;
    if (boxes.empty() || !(boxes[0].log_odds >= least)) return std::nullopt;
    for (std::size_t k = 1; k < boxes.size(); ++k) {
      if (boxes[0].log_odds - boxes[k].log_odds >= kMinLogMargin) break;
      if (!(variance_ > 0.0 && AreSame(boxes[0].axes, boxes[k].axes))) return std::nullopt;
    }
    return Finish(boxes[0]);
  }

  FoundBox Finish(const BoxHypothesis& box) const {
    FoundBox found;
    found.given = box.given;
    found.axes = box.axes;
    for (std::size_t k = 0; k < 3; ++k) {
      std::vector<LineFit> fits;
      for (const int i : box.edges[k])
        fits.push_back(edges_[static_cast<std::size_t>(i)].odds.fit());
      const Vector3d axis = box.axes.col(static_cast<Eigen::Index>(k));
      found.log_odds_along[k] = LogOddsOfDirection(lines_, box.edges[k], axis);
      found.pencils[k] = MakePencil(lines_, box.edges[k], fits, axis);
      FitAlone(&found.pencils[k]);
    }
    return found;
  }

  std::vector<BoxHypothesis> StartsFromCorners() {
    std::vector<BoxHypothesis> starts;
    const auto line = [this](std::size_t i) { return edges_[i].odds.fit().line; };
    for (std::size_t k = 0; k < edges_.size(); ++k) {
      const std::vector<std::size_t>& corners = edges_[k].corners;
      for (std::size_t i = 0; i < corners.size(); ++i) {
        for (std::size_t j = i + 1; j < corners.size(); ++j) {
          for (const Matrix3d& axes :
               RightAngledAxes(line(corners[i]), line(k), line(corners[j]))) {
            BoxHypothesis start;
            Consider(axes, kPencilSigmaRad * kPencilSigmaRad, &start);
            if (std::isfinite(start.log_odds)) starts.push_back(std::move(start));
          }
        }
      }
    }
    return starts;
  }

  // At any angle about normal_, and from there to where its edges agree best. No odds where there
  // is none.
  BoxHypothesis FindOnNormal() {
    constexpr int kAngles = 180;  // Of a quarter turn: one in half a degree.
    BoxHypothesis start;
    const Matrix3d axes = AxesOf(normal_.unitOrthogonal(), normal_);
    for (int k = 0; k < kAngles; ++k) Consider(Rotated(axes, 0.5 * kPi * k / kAngles), 0.0, &start);
    return std::isfinite(start.log_odds) ? Climb(start) : start;
  }

  // From there to where its edges agree best.
  BoxHypothesis Climb(const BoxHypothesis& start) {
    constexpr int kPasses = 4;
    BoxHypothesis best;
    Consider(start.axes, 0.0, &best);
    if (!std::isfinite(best.log_odds)) Consider(Turned(start), 0.0, &best);
    for (int pass = 0; pass < kPasses && std::isfinite(best.log_odds); ++pass) {
      const double before = best.log_odds;
      Consider(Turned(best), 0.0, &best);
      if (!(best.log_odds > before)) break;
    }
    return best;
  }

  // Which axis each edge is most likely along, and the logarithm of its odds.
  void Assign(const Matrix3d& axes, double off_variance) {
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      gain_[i] = kImpossible;
      for (int k = 0; k < 3 && !edges_[i].corners.empty(); ++k) {
        const Vector3d axis = axes.col(k);
        const LineOdds& line = edges_[i].odds;
        // Four standard deviations off no edge has odds above one, as kModelSigmaRad bounds them;
        // most lines are farther off, and logarithms take time.
        const double residual = line.Residual(axis);
        if (residual * residual > 16.0 * (line.Variance(axis) + off_variance)) continue;
        const double gain = LogOddsOfEdge(line, axis, off_variance);
        if (gain <= gain_[i]) continue;
        gain_[i] = gain;
        axis_[i] = k;
      }
    }
    DropThoseThatMeet();
  }

  // Edges that are parallel in space meet at their vanishing point alone, which no visible part of
  // them reaches. Two that form a corner and yet are along one axis have it there by accident: any
  // two lines pass through their own corner.
  void DropThoseThatMeet() {
    std::vector<std::size_t> meeting;
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      if (gain_[i] <= 0.0) continue;
      const std::vector<std::size_t>& corners = edges_[i].corners;
      const bool meets = std::any_of(corners.begin(), corners.end(), [&](std::size_t j) {
        return gain_[j] > 0.0 && axis_[j] == axis_[i];
      });
      if (meets) meeting.push_back(i);
    }
    for (const std::size_t i : meeting) gain_[i] = kImpossible;
  }

  // The likeliest set of edges that corners between different axes connect. Each two of the axes
  // have a corner in common: only lines that differ in the photo can be told from one another.
  void Consider(const Matrix3d& axes, double off_variance, BoxHypothesis* best) {
    Assign(axes, off_variance);
    const double off = (axes.col(2) - normal_).squaredNorm();
    const double log_prior = variance_ > 0.0 ? -0.5 * off / variance_ : 0.0;
    std::fill(seen_.begin(), seen_.end(), char{0});
    for (std::size_t start = 0; start < edges_.size(); ++start) {
      if (seen_[start] || gain_[start] <= 0.0) continue;
      BoxHypothesis box;
      box.axes = axes;
      box.log_odds = log_prior;
      std::array<bool, 3> have_corner{};  // Of the axes other than the index.
      queue_.assign(1, start);
      seen_[start] = 1;
      while (!queue_.empty()) {
        const std::size_t i = queue_.back();
        queue_.pop_back();
        box.log_odds += gain_[i];
        box.edges[static_cast<std::size_t>(axis_[i])].push_back(static_cast<int>(i));
        for (const std::size_t j : edges_[i].corners) {
          if (gain_[j] <= 0.0 || axis_[j] == axis_[i]) continue;
          have_corner[static_cast<std::size_t>(3 - axis_[i] - axis_[j])] = true;
          if (seen_[j]) continue;
          seen_[j] = 1;
          queue_.push_back(j);
        }
      }
      const bool is_box = have_corner[0] && have_corner[1] && have_corner[2];
      if (is_box && box.log_odds > best->log_odds) *best = std::move(box);
    }
  }

  // Turned to where its edges agree best, one Gauss-Newton step: by a rotation d the residual l . v
  // of an edge along v changes by d . (v x l).
  Matrix3d Turned(const BoxHypothesis& box) const {
    Matrix3d information = Matrix3d::Zero();
    Vector3d gradient = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      const Vector3d v = box.axes.col(k);
      for (const int e : box.edges[static_cast<std::size_t>(k)]) {
        const LineOdds& line = edges_[static_cast<std::size_t>(e)].odds;
        const double weight = 1.0 / line.Variance(v);
        const Vector3d slope = v.cross(line.fit().line);
        information += weight * slope * slope.transpose();
        gradient += weight * line.Residual(v) * slope;
      }
    }
    const Vector3d n = box.axes.col(2);
    if (!(variance_ > 0.0)) {
      const double angle = -n.dot(gradient) / n.dot(information * n);
      return std::isfinite(angle) ? Rotated(box.axes, angle) : box.axes;
    }
    information += (Matrix3d::Identity() - n * n.transpose()) / variance_;
    gradient += n.cross(n - normal_) / variance_;
    return ExpRotation(-information.ldlt().solve(gradient)) * box.axes;
  }

  const std::vector<DetectedLine>& lines_;
  std::vector<Edge> edges_;  // One a line.
  int num_corners_ = 0;
  // Of the box that is looked for; how well it is known, squared radians.
  Vector3d normal_ = Vector3d::UnitZ();
  double variance_ = 0.0;
  // Of each edge, for the axes considered.
  std::vector<int> axis_;
  std::vector<double> gain_;
  std::vector<char> seen_;
  std::vector<std::size_t> queue_;
};

// A box, if there is one, with its first `count` axes in the order of their lines' length.
std::optional<FoundBox> LongestFirst(int count, std::optional<FoundBox> box) {
  if (!box) return box;
  std::array<int, 3> order = {0, 1, 2};
  std::stable_sort(order.begin(), order.begin() + count, [&box](int a, int b) {
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
  return box;
}

}  // namespace

std::optional<FoundBox> FindBox(const std::vector<DetectedLine>& lines,
                                const std::vector<Vector3d>& normals, double diagonal_px) {
  return LongestFirst(2, BoxSearch(lines, diagonal_px).Best(normals, 0.0, kLogOddsOfNone));
}

std::optional<FoundBox> FindFreeBox(const std::vector<DetectedLine>& lines,
                                    const std::vector<Vector3d>& axes, double diagonal_px) {
  return LongestFirst(
      3, BoxSearch(lines, diagonal_px).Best(axes, kPencilSigmaRad, kLogOddsOfNoneFree));
}

std::optional<FoundBox> FindAnyBox(const std::vector<DetectedLine>& lines, double diagonal_px) {
  return LongestFirst(3, BoxSearch(lines, diagonal_px).BestOfAll());
}

}  // namespace circline
