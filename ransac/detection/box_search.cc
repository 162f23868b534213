#include "circline/ransac/detection/box_search.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/estimators/pose.h"
#include "circline/ransac/detection/segment_meetings.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// What all points of an edge share, pixels: cartons are worn and bulge.
constexpr double kWornPx = 0.35;
// What lens and calibration leave beyond that, radians.
constexpr double kModelSigmaRad = 1.7e-3;
// The logarithm of the odds, before its direction is looked at, that a line that forms corners is
// an edge of the box (the choice between three directions not counted).
constexpr double kLogOddsOfAnEdge = -1.5;
// Angles about the normal that are tried, of a quarter turn: one in half a degree.
constexpr int kAngles = 180;
constexpr int kPasses = 4;

LineOdds WornLine(const DetectedLine& line) {
  return LineOdds(WithDirectionError(WithSharedError(line, kWornPx), kModelSigmaRad));
}

// Of an edge along an axis that is off by a Gaussian error of that variance.
double LogOddsAlong(const LineOdds& line, const Vector3d& axis, double off_variance) {
  const double variance = line.Variance(axis) + off_variance;
  return line.LogRatio(axis, variance) - std::log(3.0) + kLogOddsOfAnEdge;
}

// Four standard deviations off no edge has odds above one, as kModelSigmaRad bounds them; most
// lines are farther off, and logarithms take time.
bool IsFarOff(const LineOdds& line, const Vector3d& axis, double off_variance) {
  const double miss = line.Miss(axis);
  return miss * miss > 16.0 * (line.Variance(axis) + off_variance);
}

Matrix3d Rotated(const Matrix3d& axes, double angle) {
  return AxesOf(std::cos(angle) * axes.col(0) + std::sin(angle) * axes.col(1), axes.col(2));
}

}  // namespace

double LogOddsOfDirection(const std::vector<DetectedLine>& lines, const std::vector<int>& members,
                          const Vector3d& direction) {
  double sum = 0.0;
  for (const int i : members)
    sum += LogOddsAlong(WornLine(lines[static_cast<std::size_t>(i)]), direction, 0.0);
  return sum;
}

Matrix3d AxesOf(const Vector3d& x, const Vector3d& normal) {
  Matrix3d axes;
  axes << x, normal.cross(x), normal;
  return axes;
}

BoxSearch::BoxSearch(const std::vector<DetectedLine>& lines, double diagonal_px) : lines_(lines) {
  FindCorners(diagonal_px);
  axis_.resize(edges_.size());
  gain_.resize(edges_.size());
  seen_.resize(edges_.size());
}

BoxSearch::Box BoxSearch::Find(const Vector3d& normal, double sigma_rad) {
  normal_ = normal;
  variance_ = sigma_rad * sigma_rad;
  Box best = FindOn(normal, 0.0);
  if (variance_ > 0.0) {
    Box near = FindOn(normal, variance_);
    if (near.log_odds > best.log_odds) best = std::move(near);
  }
  return best;
}

FoundBox BoxSearch::Finish(const Box& box) const {
  FoundBox found;
  found.log_odds = box.log_odds;
  found.axes = box.axes;
  for (std::size_t k = 0; k < 3; ++k) {
    std::vector<int> members;
    std::vector<LineFit> fits;
    for (const int e : box.edges[k]) {
      members.push_back(edges_[static_cast<std::size_t>(e)].line);
      fits.push_back(edges_[static_cast<std::size_t>(e)].odds.fit());
    }
    found.log_odds_along[k] =
        LogOddsOfDirection(lines_, members, found.axes.col(static_cast<Eigen::Index>(k)));
    found.pencils[k] =
        MakePencil(lines_, members, fits, box.axes.col(static_cast<Eigen::Index>(k)));
  }
  return found;
}

void BoxSearch::FindCorners(double diagonal_px) {
  const std::vector<int> twin_of = FindTwins(lines_, diagonal_px);
  std::vector<std::vector<int>> corners(lines_.size());
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    for (std::size_t j = i + 1; j < lines_.size() && twin_of[i] < 0; ++j) {
      if (twin_of[j] >= 0 || !FormCorner(lines_[i].ends, lines_[j].ends, diagonal_px)) continue;
      corners[i].push_back(static_cast<int>(j));
      corners[j].push_back(static_cast<int>(i));
      ++num_corners_;
    }
  }
  std::vector<int> edge_of(lines_.size(), -1);
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    if (corners[i].empty()) continue;
    edge_of[i] = static_cast<int>(edges_.size());
    edges_.push_back({static_cast<int>(i), WornLine(lines_[i]), std::move(corners[i])});
  }
  for (Edge& edge : edges_) {
    for (int& corner : edge.corners) corner = edge_of[static_cast<std::size_t>(corner)];
  }
}

BoxSearch::Box BoxSearch::FindOn(const Vector3d& normal, double off_variance) {
  Box start, best;
  const Matrix3d axes = AxesOf(normal.unitOrthogonal(), normal);
  for (int k = 0; k < kAngles; ++k)
    Consider(Rotated(axes, 0.5 * kPi * k / kAngles), off_variance, &start);
  if (!std::isfinite(start.log_odds)) return best;
  Consider(start.axes, 0.0, &best);
  if (!std::isfinite(best.log_odds)) Consider(Turned(start), 0.0, &best);
  for (int pass = 0; pass < kPasses && std::isfinite(best.log_odds); ++pass) {
    const double before = best.log_odds;
    Consider(Turned(best), 0.0, &best);
    if (!(best.log_odds > before)) break;
  }
  return best;
}

void BoxSearch::Assign(const Matrix3d& axes, double off_variance) {
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    gain_[i] = -std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
      if (IsFarOff(edges_[i].odds, axes.col(k), off_variance)) continue;
      const double gain = LogOddsAlong(edges_[i].odds, axes.col(k), off_variance);
      if (gain <= gain_[i]) continue;
      gain_[i] = gain;
      axis_[i] = k;
    }
  }
}

void BoxSearch::Consider(const Matrix3d& axes, double off_variance, Box* best) {
  Assign(axes, off_variance);
  const double off = (axes.col(2) - normal_).squaredNorm();
  const double log_prior = variance_ > 0.0 ? -0.5 * off / variance_ : 0.0;
  std::fill(seen_.begin(), seen_.end(), char{0});
  for (std::size_t start = 0; start < edges_.size(); ++start) {
    if (seen_[start] || gain_[start] <= 0.0) continue;
    Box box;
    box.axes = axes;
    box.log_odds = log_prior;
    std::array<bool, 3> have_corner{};  // Of the axes other than the index.
    queue_.assign(1, static_cast<int>(start));
    seen_[start] = 1;
    while (!queue_.empty()) {
      const std::size_t i = static_cast<std::size_t>(queue_.back());
      queue_.pop_back();
      box.log_odds += gain_[i];
      box.edges[static_cast<std::size_t>(axis_[i])].push_back(static_cast<int>(i));
      for (const int corner : edges_[i].corners) {
        const std::size_t j = static_cast<std::size_t>(corner);
        if (gain_[j] <= 0.0 || axis_[j] == axis_[i]) continue;
        have_corner[static_cast<std::size_t>(3 - axis_[i] - axis_[j])] = true;
        if (seen_[j]) continue;
        seen_[j] = 1;
        queue_.push_back(corner);
      }
    }
    const bool is_box = have_corner[0] && have_corner[1] && have_corner[2];
    if (is_box && box.log_odds > best->log_odds) *best = std::move(box);
  }
}

Matrix3d BoxSearch::Turned(const Box& box) const {
  Matrix3d information = Matrix3d::Zero();
  Vector3d gradient = Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const Vector3d v = box.axes.col(k);
    for (const int e : box.edges[static_cast<std::size_t>(k)]) {
      const LineOdds& line = edges_[static_cast<std::size_t>(e)].odds;
      const double weight = 1.0 / line.Variance(v);
      const Vector3d slope = v.cross(line.fit().line);
      information += weight * slope * slope.transpose();
      gradient += weight * line.Miss(v) * slope;
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

}  // namespace circline
