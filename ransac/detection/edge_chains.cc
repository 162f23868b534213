#include "circline/ransac/detection/edge_chains.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace circline {
namespace {

// Two points are neighbours on one edge only if their gradients agree within 50 degrees; a sharper
// turn over one or two pixels is a corner.
constexpr float kMinNeighbourCosine = 0.64f;
// A neighbour lies along the edge rather than beside it: its offset across the edge, pixels.
constexpr float kMaxNeighbourOffset = 1.0f;
constexpr float kNoDistance = 1e9f;

// For each point the next and the previous one along its edge, or -1.
struct Links {
  std::vector<std::int32_t> next, previous;
};

// Which pixels of the square frame at `radius` around a point can hold points ahead of it, as steps
// through the index: one list for every octant of the tangent.
class Frame {
 public:
  Frame(int radius, int width) {
    for (int octant = 0; octant < 8; ++octant) {
      for (int dy = -radius; dy <= radius; ++dy) {
        for (int dx = -radius; dx <= radius; ++dx) {
          if (std::max(std::abs(dx), std::abs(dy)) != radius || !CanBeAhead(octant, dx, dy))
            continue;
          steps_[static_cast<std::size_t>(octant)].push_back(dy * width + dx);
        }
      }
    }
  }

  const std::vector<std::int32_t>& Steps(float tx, float ty) const {
    const int octant = (std::abs(tx) > std::abs(ty) ? 4 : 0) + (tx > 0.0f ? 2 : 0) + (ty > 0.0f);
    return steps_[static_cast<std::size_t>(octant)];
  }

 private:
  // Both points lie within half a pixel of their pixels' centres, along one axis, so that they can
  // be ahead by up to the tangent's larger component more than the pixel is. What is not ahead for
  // either end of the octant, the axis and the diagonal, is not for the tangents between.
  static bool CanBeAhead(int octant, int dx, int dy) {
    const int sx = (octant & 2) != 0 ? 1 : -1, sy = (octant & 1) != 0 ? 1 : -1;
    const int along = ((octant & 4) != 0 ? sx * dx : sy * dy) + 1;
    const int beside = (octant & 4) != 0 ? sy * dy : sx * dx;
    return along > 0 || along + beside > 0;
  }

  std::array<std::vector<std::int32_t>, 8> steps_;
};

// Every point points to the nearest ahead, walking with the brighter side on the left; of several
// that point to the same, the nearest keeps it.
class Linker {
 public:
  Linker(const EdgeMap& map, const std::vector<std::int32_t>& pixels)
      : map_(map), pixels_(pixels), adjacent_(1, map.width), around_(2, map.width) {}

  Links Link() {
    const std::size_t n = map_.points.size();
    Links links{std::vector<std::int32_t>(n, -1), std::vector<std::int32_t>(n, -1)};
    for (std::size_t i = 0; i < n; ++i) {
      const Neighbour ahead = NearestAhead(i);
      if (ahead.point < 0) continue;
      std::int32_t* previous = &links.previous[static_cast<std::size_t>(ahead.point)];
      if (*previous >= 0) {
        const auto rival = static_cast<std::size_t>(*previous);
        if (ahead.distance >= SquaredDistance(rival, ahead.point)) continue;
        links.next[rival] = -1;
      }
      *previous = static_cast<std::int32_t>(i);
      links.next[i] = ahead.point;
    }
    return links;
  }

 private:
  struct Neighbour {
    std::int32_t point = -1;
    float distance = kNoDistance;  // Squared.
  };

  float SquaredDistance(std::size_t i, std::int32_t j) const {
    const EdgePoint& p = map_.points[i];
    const EdgePoint& q = map_.points[static_cast<std::size_t>(j)];
    const float dx = q.x - p.x, dy = q.y - p.y;
    return dx * dx + dy * dy;
  }

  // In the adjacent pixels, or else in those around them: that bridges one missing pixel.
  Neighbour NearestAhead(std::size_t i) const {
    const Neighbour adjacent = NearestAhead(i, adjacent_);
    if (adjacent.point >= 0 || !HasRoomAround(pixels_[i])) return adjacent;
    return NearestAhead(i, around_);
  }

  // Whether there are three rows above and below a pixel. (To the left and right, a step beyond the
  // end of one of two rows leads to another's outermost pixel, which holds no point.)
  bool HasRoomAround(std::int32_t pixel) const {
    return pixel >= 3 * map_.width && pixel < (map_.height - 3) * map_.width;
  }

  Neighbour NearestAhead(std::size_t i, const Frame& frame) const {
    const EdgePoint& p = map_.points[i];
    const std::int32_t* pixel = map_.index.data() + pixels_[i];
    // First who is there, without a branch for every pixel.
    std::array<std::int32_t, 16> there;
    std::size_t count = 0;
    for (const std::int32_t step : frame.Steps(-p.ny, p.nx)) {
      there[count] = pixel[step];
      count += pixel[step] >= 0 ? 1U : 0U;
    }
    Neighbour best;
    for (std::size_t k = 0; k < count; ++k) Compare(p, there[k], &best);
    return best;
  }

  // Takes point j if it is a neighbour ahead of p and nearer than the best so far.
  void Compare(const EdgePoint& p, std::int32_t j, Neighbour* best) const {
    const EdgePoint& q = map_.points[static_cast<std::size_t>(j)];
    const float dx = q.x - p.x, dy = q.y - p.y;
    const float d = dx * dx + dy * dy;
    const float ahead = dy * p.nx - dx * p.ny;
    const float ahead_of_q = dy * q.nx - dx * q.ny;  // Seen from there p must lie behind.
    const float offset = std::abs(dx * p.nx + dy * p.ny);
    const float cosine = p.nx * q.nx + p.ny * q.ny;
    if (ahead <= 0.0f || ahead_of_q <= 0.0f || d >= best->distance ||
        cosine < kMinNeighbourCosine || offset > kMaxNeighbourOffset + 0.5f * ahead) {
      return;
    }
    best->point = j;
    best->distance = d;
  }

  const EdgeMap& map_;
  const std::vector<std::int32_t>& pixels_;
  const Frame adjacent_, around_;
};

// Walks the links and gives the points of chains that are long and strong enough their new places.
class ChainBuilder {
 public:
  ChainBuilder(const Links& links, float high, int min_points, EdgeMap* map)
      : links_(links), high_(high), min_points_(min_points), map_(map) {}

  // Returns for each point its new place, or kNone.
  std::vector<std::int32_t> Build() {
    const std::size_t n = map_->points.size();
    place_.assign(n, kNotSeen);
    for (std::size_t i = 0; i < n; ++i) {
      if (links_.previous[i] < 0) Walk(static_cast<std::int32_t>(i), false);
    }
    for (std::size_t i = 0; i < n; ++i) Walk(static_cast<std::int32_t>(i), true);  // Loops remain.
    return std::move(place_);
  }

  static constexpr std::int32_t kNone = -1;

 private:
  static constexpr std::int32_t kNotSeen = -2;

  void Walk(std::int32_t start, bool closed) {
    int length = 0;
    float strongest = 0.0f;
    std::int32_t i = start;
    for (; i >= 0 && Place(i) == kNotSeen; i = Next(i)) {
      Place(i) = kNone;
      ++length;
      strongest = std::max(strongest, map_->points[static_cast<std::size_t>(i)].gradient);
    }
    if (length == 0 || strongest < high_ || length < min_points_) return;
    EdgeChain chain;
    chain.begin = kept_;
    chain.end = kept_ + length;
    chain.closed = closed;
    map_->chains.push_back(chain);
    for (i = start; kept_ < chain.end; i = Next(i)) Place(i) = kept_++;
  }

  std::int32_t Next(std::int32_t i) const { return links_.next[static_cast<std::size_t>(i)]; }
  std::int32_t& Place(std::int32_t i) { return place_[static_cast<std::size_t>(i)]; }

  const Links& links_;
  const float high_;
  const int min_points_;
  EdgeMap* map_;
  std::int32_t kept_ = 0;
  std::vector<std::int32_t> place_;
};

// Moves every point to its place and drops those without one, in place: fresh memory would cost
// more than the moving.
void Rearrange(std::vector<std::int32_t> place, std::vector<EdgePoint>* points) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < place.size(); ++i) {
    // Until a point comes here that belongs here or nowhere.
    while (place[i] >= 0) {
      const auto to = static_cast<std::size_t>(place[i]);
      std::swap((*points)[i], (*points)[to]);
      std::swap(place[i], place[to]);
      ++kept;
      place[to] = ChainBuilder::kNone;  // Done.
    }
  }
  points->resize(kept);
}

}  // namespace

void ChainEdgePoints(const std::vector<std::int32_t>& pixels, double high, int min_points,
                     EdgeMap* map) {
  const Links links = Linker(*map, pixels).Link();
  std::vector<std::int32_t> place =
      ChainBuilder(links, static_cast<float>(high), min_points, map).Build();
  for (std::size_t i = 0; i < place.size(); ++i) {
    map->index[static_cast<std::size_t>(pixels[i])] = place[i];
  }
  Rearrange(std::move(place), &map->points);
}

}  // namespace circline
