#include "circline/ransac/detection/ellipses/arcs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "circline/estimators/basics.h"

namespace circline {
namespace {

using Eigen::Vector2d;

// Polygonal approximation of a chain: largest distance of a point to it, pixels. Well above the
// noise of an edge point, so that every vertex is a true turn; small enough that a circle of 4 px
// radius still has five vertices.
constexpr float kPolygonTolerancePx = 0.7f;
// On a smooth curve the polygon's turn at a vertex times the shorter edge is about eight times the
// tolerance at most (chord and sagitta); far beyond that, the vertex is a corner.
constexpr double kCornerFactor = 2.0;
constexpr double kMaxTurn = 75.0 * kDegree;
// What an arc needs to take part.
constexpr int kMinArcPoints = 6;
constexpr double kMinArcTurn = 12.0 * kDegree;
// What the smoothing rounds on either side of a corner, points.
constexpr int kCornerReach = 2;
// How far an arc may lie beyond another's tangents and chord, pixels: tangents are good to a few
// degrees.
constexpr double kEndSlackPx = 2.0;

// Point farther than the tolerance from the chord a-b (or from a, where both coincide), or -1.
int Farthest(const std::vector<EdgePoint>& points, int a, int b) {
  const EdgePoint& p = points[static_cast<std::size_t>(a)];
  const EdgePoint& q = points[static_cast<std::size_t>(b)];
  float dx = q.x - p.x, dy = q.y - p.y;
  const float length = std::sqrt(dx * dx + dy * dy);
  // The ends of a closed chain coincide nearly: then the distance to the point itself counts.
  const bool degenerate = length < 2.0f * kPolygonTolerancePx && b - a > 4;
  if (length > 0.0f) {
    dx /= length;
    dy /= length;
  }
  int best = -1;
  float best_distance = kPolygonTolerancePx;
  for (int i = a + 1; i < b; ++i) {
    const EdgePoint& r = points[static_cast<std::size_t>(i)];
    const float ex = r.x - p.x, ey = r.y - p.y;
    const float d = degenerate ? std::sqrt(ex * ex + ey * ey) : std::abs(ex * dy - ey * dx);
    if (d > best_distance) {
      best_distance = d;
      best = i;
    }
  }
  return best;
}

// Vertices (indices of points) of the Douglas-Peucker polygon of a chain.
std::vector<int> ApproximatePolygon(const std::vector<EdgePoint>& points, const EdgeChain& chain) {
  // Those found, and those that end what is left, the nearest last.
  std::vector<int> vertices = {chain.begin}, ends = {chain.end - 1};
  while (!ends.empty()) {
    const int farthest = Farthest(points, vertices.back(), ends.back());
    if (farthest >= 0) {
      ends.push_back(farthest);
    } else {
      vertices.push_back(ends.back());
      ends.pop_back();
    }
  }
  return vertices;
}

Arc MakeArc(const std::vector<EdgePoint>& points, int begin, int end, bool bright_inside,
            double turn) {
  const auto p = [&points](int i) { return points[static_cast<std::size_t>(i)].Position(); };
  const int reach = std::min(4, (end - begin) / 2);
  Arc arc;
  arc.begin = begin;
  arc.end = end;
  arc.turn = turn;
  arc.bright_inside = bright_inside;
  arc.first = p(begin);
  arc.middle = p((begin + end) / 2);
  arc.last = p(end - 1);
  arc.first_tangent = (p(begin + reach) - p(begin)).normalized();
  arc.last_tangent = (p(end - 1) - p(end - 1 - reach)).normalized();
  return arc;
}

// Where an arc bends most sharply: the smallest cosine between the gradients a few pixels before
// and behind.
int SharpestPoint(const std::vector<EdgePoint>& points, const Arc& arc) {
  constexpr int kReach = 4;
  int sharpest = (arc.begin + arc.end) / 2;
  float smallest = 1.0f;
  for (int i = arc.begin + kReach; i + kReach < arc.end; ++i) {
    const EdgePoint& a = points[static_cast<std::size_t>(i - kReach)];
    const EdgePoint& b = points[static_cast<std::size_t>(i + kReach)];
    const float cosine = a.nx * b.nx + a.ny * b.ny;
    if (cosine >= smallest) continue;
    smallest = cosine;
    sharpest = i;
  }
  return sharpest;
}

class ArcFinder {
 public:
  explicit ArcFinder(const EdgeMap& map) : map_(map) {}

  std::vector<Arc> Find() {
    for (const EdgeChain& chain : map_.chains) {
      if (chain.size() >= kMinArcPoints) Cut(ApproximatePolygon(map_.points, chain));
    }
    return std::move(arcs_);
  }

 private:
  Vector2d P(int i) const { return map_.points[static_cast<std::size_t>(i)].Position(); }

  // Cuts the polygon at corners, and where the bend changes sides at the middle of the edge
  // between.
  void Cut(const std::vector<int>& v) {
    int begin = v.front();
    double sign = 0.0, turn = 0.0;
    for (std::size_t k = 1; k + 1 < v.size(); ++k) {
      const Vector2d a = P(v[k]) - P(v[k - 1]), b = P(v[k + 1]) - P(v[k]);
      const double theta = std::atan2(Cross(a, b), a.dot(b));
      if (std::abs(theta) > kMaxTurn || IsCorner(a, b)) {
        Emit(begin, v[k] + 1, turn);
        begin = v[k];
        sign = turn = 0.0;
        continue;
      }
      if (sign * theta < 0.0) {
        const int middle = (v[k - 1] + v[k]) / 2;
        Emit(begin, middle + 1, turn);
        begin = middle;
        turn = 0.0;
      }
      sign = theta;
      turn += theta;
    }
    Emit(begin, v.back() + 1, turn);
  }

  // Whether the polygon bends more from edge `a` to edge `b` than a smooth curve of their lengths.
  static bool IsCorner(const Vector2d& a, const Vector2d& b) {
    const double theta = std::abs(std::atan2(Cross(a, b), a.dot(b)));
    return std::min(a.norm(), b.norm()) * theta / 8.0 > kCornerFactor * kPolygonTolerancePx;
  }

  void Emit(int begin, int end, double turn) {
    if (end - begin < kMinArcPoints || std::abs(turn) < kMinArcTurn) return;
    // With the brighter side on the left and y down, a turn to the left is negative.
    arcs_.push_back(MakeArc(map_.points, begin, end, turn < 0.0, std::abs(turn)));
  }

  const EdgeMap& map_;
  std::vector<Arc> arcs_;
};

// Whether `p` lies on the inner side of the arc's end tangents and chord, as every other point of a
// convex curve through the arc must.
bool InnerSide(const Arc& arc, const Vector2d& p) {
  const double inward = arc.bright_inside ? -1.0 : 1.0;
  if (inward * Cross(arc.first_tangent, p - arc.first) < -kEndSlackPx) return false;
  if (inward * Cross(arc.last_tangent, p - arc.last) < -kEndSlackPx) return false;
  // Beyond the chord, seen from the arc: the walk from the first to the last point turns inward.
  const Vector2d chord = arc.last - arc.first;
  return arc.turn > kPi || inward * Cross(chord, p - arc.first) > -kEndSlackPx * chord.norm();
}

bool OnInnerSide(const Arc& arc, const Arc& other) {
  return InnerSide(arc, other.first) && InnerSide(arc, other.middle) && InnerSide(arc, other.last);
}

// Turn of the gradients over points[begin, end), in steps of four points, towards the darker side.
double GradientTurn(const std::vector<EdgePoint>& points, int begin, int end) {
  double turn = 0.0;
  for (int i = begin; i + 1 < end; i += 4) {
    const Vector2d a = points[static_cast<std::size_t>(i)].Normal();
    const Vector2d b = points[static_cast<std::size_t>(std::min(i + 4, end - 1))].Normal();
    turn += std::atan2(Cross(a, b), a.dot(b));
  }
  return turn;
}

}  // namespace

std::vector<Arc> FindArcs(const EdgeMap& map) { return ArcFinder(map).Find(); }

std::vector<Arc> SplitArc(const EdgeMap& map, const Arc& arc) {
  const int at = SharpestPoint(map.points, arc);
  std::vector<Arc> parts;
  const std::array<std::array<int, 2>, 2> ranges = {
      {{arc.begin, at - kCornerReach}, {at + 1 + kCornerReach, arc.end}}};
  for (const auto& [begin, end] : ranges) {
    if (end - begin < kMinArcPoints) continue;
    const double turn = GradientTurn(map.points, begin, end) * (arc.bright_inside ? -1.0 : 1.0);
    if (turn < kMinArcTurn) continue;
    parts.push_back(MakeArc(map.points, begin, end, arc.bright_inside, turn));
  }
  return parts;
}

bool CanShareEllipse(const Arc& a, const Arc& b) { return OnInnerSide(a, b) && OnInnerSide(b, a); }

}  // namespace circline
