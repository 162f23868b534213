#include "circline/ransac/detection/find_box.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "circline/estimators/line.h"
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
// Least odds of a box, kLogCorners times the logarithm of the number of corners in the photo beyond
// kLogOddsOfNone: by accident one normal in a hundred has as much, on photos of few lines and of
// many (the test RealPhotographs.BoxesAreRare*). And by how much the odds exceed those of a box on
// the other plane.
constexpr double kLogCorners = 2.0;
constexpr double kLogOddsOfNone = -4.0;
constexpr double kMinLogMargin = 2.0;
constexpr double kPi = 3.14159265358979323846;
// Angles about the normal that are tried, of a quarter turn: one in half a degree.
constexpr int kAngles = 180;
constexpr int kPasses = 4;

// The lines that end where others do: only they can be edges of a box.
class BoxSearch {
 public:
  BoxSearch(const std::vector<DetectedLine>& lines, double diagonal_px) : lines_(lines) {
    FindCorners(diagonal_px);
    axis_.resize(edges_.size());
    gain_.resize(edges_.size());
    seen_.resize(edges_.size());
  }

  struct Box {
    Matrix3d axes;
    std::array<std::vector<int>, 3> edges;  // Indices into edges_.
    double log_odds = -std::numeric_limits<double>::infinity();
  };

  // The best box with this normal; odds of minus infinity where there is none.
  Box Find(const Vector3d& normal) {
    Box best;
    const Matrix3d axes = Axes(normal.unitOrthogonal(), normal);
    for (int k = 0; k < kAngles; ++k) Consider(Rotated(axes, 0.5 * kPi * k / kAngles), &best);
    // To where its edges agree best.
    for (int pass = 0; pass < kPasses && std::isfinite(best.log_odds); ++pass) {
      const double before = best.log_odds;
      Consider(Turned(best), &best);
      if (!(best.log_odds > before)) break;
    }
    return best;
  }

  double LeastLogOdds() const {
    return kLogCorners * std::log(std::max(1, num_corners_)) + kLogOddsOfNone;
  }

  FoundBox Finish(const Box& box) const {
    FoundBox found;
    found.log_odds = box.log_odds;
    found.axes = box.axes;
    for (std::size_t k = 0; k < 3; ++k) {
      std::vector<int> members;
      std::vector<LineFit> fits;
      for (const int e : box.edges[k]) {
        members.push_back(edges_[static_cast<std::size_t>(e)].line);
        fits.push_back(edges_[static_cast<std::size_t>(e)].fit);
      }
      found.pencils[k] =
          MakePencil(lines_, members, fits, box.axes.col(static_cast<Eigen::Index>(k)));
    }
    if (found.pencils[1].support_px > found.pencils[0].support_px) {
      std::swap(found.pencils[0], found.pencils[1]);
      found.axes = Axes(found.axes.col(1), found.axes.col(2));
    }
    return found;
  }

 private:
  struct Edge {
    int line;                  // Index into lines_.
    LineFit fit;               // With all that it may miss its direction by.
    std::vector<int> corners;  // Those it forms a corner with, indices into edges_.
  };

  // Of lines that form corners: edges, and which form them.
  void FindCorners(double diagonal_px) {
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
      const LineFit fit = WithDirectionError(WithSharedError(lines_[i], kWornPx), kModelSigmaRad);
      edges_.push_back({static_cast<int>(i), fit, std::move(corners[i])});
    }
    for (Edge& edge : edges_) {
      for (int& corner : edge.corners) corner = edge_of[static_cast<std::size_t>(corner)];
    }
  }

  static Matrix3d Rotated(const Matrix3d& axes, double angle) {
    return Axes(std::cos(angle) * axes.col(0) + std::sin(angle) * axes.col(1), axes.col(2));
  }

  static Matrix3d Axes(const Vector3d& x, const Vector3d& normal) {
    Matrix3d axes;
    axes << x, normal.cross(x), normal;
    return axes;
  }

  // Which axis each edge is most likely along, and the logarithm of its odds: a line of any
  // direction misses an axis by a sine that is uniform in [0, 1], one along it by a Gaussian.
  void Assign(const Matrix3d& axes) {
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      gain_[i] = -std::numeric_limits<double>::infinity();
      for (int k = 0; k < 3; ++k) {
        const Vector3d v = axes.col(k);
        const double miss = edges_[i].fit.line.dot(v);
        const double variance = v.dot(edges_[i].fit.covariance * v);
        const double gain = 0.5 * std::log(2.0 / (kPi * variance)) - 0.5 * miss * miss / variance -
                            std::log(3.0) + kLogOddsOfAnEdge;
        if (gain <= gain_[i]) continue;
        gain_[i] = gain;
        axis_[i] = k;
      }
    }
  }

  // The likeliest set of edges that corners between different axes connect. Each two of the axes
  // have a corner in common: only lines that differ in the photo can be told from one another.
  void Consider(const Matrix3d& axes, Box* best) {
    Assign(axes);
    std::fill(seen_.begin(), seen_.end(), char{0});
    for (std::size_t start = 0; start < edges_.size(); ++start) {
      if (seen_[start] || gain_[start] <= 0.0) continue;
      Box box;
      box.axes = axes;
      box.log_odds = 0.0;
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

  // Turned about the normal to where its edges in the plane agree best, one Gauss-Newton step: by
  // the angle, x moves along y and y along -x.
  Matrix3d Turned(const Box& box) const {
    double numerator = 0.0, denominator = 0.0;
    for (int k = 0; k < 2; ++k) {
      const Vector3d v = box.axes.col(k);
      const Vector3d dv = k == 0 ? Vector3d(box.axes.col(1)) : Vector3d(-box.axes.col(0));
      for (const int e : box.edges[static_cast<std::size_t>(k)]) {
        const LineFit& fit = edges_[static_cast<std::size_t>(e)].fit;
        const double weight = 1.0 / v.dot(fit.covariance * v);
        numerator += weight * fit.line.dot(dv) * fit.line.dot(v);
        denominator += weight * fit.line.dot(dv) * fit.line.dot(dv);
      }
    }
    const double angle = denominator > 0.0 ? -numerator / denominator : 0.0;
    return Rotated(box.axes, angle);
  }

  const std::vector<DetectedLine>& lines_;
  std::vector<Edge> edges_;
  int num_corners_ = 0;
  // Of each edge, for the axes considered.
  std::vector<int> axis_;
  std::vector<double> gain_;
  std::vector<char> seen_;
  std::vector<int> queue_;
};

}  // namespace

std::optional<FoundBox> FindBox(const std::vector<DetectedLine>& lines,
                                const std::vector<Vector3d>& normals, double diagonal_px) {
  BoxSearch search(lines, diagonal_px);
  BoxSearch::Box best;
  std::size_t best_normal = 0;
  double second = -std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < normals.size(); ++k) {
    BoxSearch::Box box = search.Find(normals[k]);
    second = std::max(second, std::min(box.log_odds, best.log_odds));
    if (!(box.log_odds > best.log_odds)) continue;
    best = std::move(box);
    best_normal = k;
  }
  if (!(best.log_odds >= search.LeastLogOdds() && best.log_odds - second >= kMinLogMargin)) {
    return std::nullopt;
  }
  FoundBox found = search.Finish(best);
  found.normal = best_normal;
  return found;
}

}  // namespace circline
