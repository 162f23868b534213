#include "apps/reconstruct/box_tracer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/reconstruct/axes_vote.h"
#include "circline/ransac/detection/lines/segment_meetings.h"
#include "circline/ransac/detection/structure/detect_pencils.h"

namespace circline::apps {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t kMaxLines = 40;  // Along one direction; the longest.
constexpr double kMinEdgePx = 15.0;    // Shorter edges of a box are not looked for.
// Directions this near to a plane through the camera may be seen from either end: axes are right to
// two degrees.
constexpr double kEdgeOnSine = 0.12;
constexpr double kNearPx = 5.0;  // From an edge that a line speaks for.
constexpr int kMaxPencils = 6;   // Whose directions may be an axis.
constexpr std::uint64_t kSeed = 1;
constexpr double kSameEndPx = 1.0;    // Far ends nearer than this are one.
constexpr std::size_t kMaxEnds = 32;  // Of a box along one axis that are tried.

// The edge along `axis`, at the far end of the box along `far` (3: at none).
struct VisibleEdge {
  std::size_t axis, far;
};

// Of the visible faces, all of which meet at the nearest corner.
std::vector<VisibleEdge> VisibleEdges(const std::array<bool, 3>& faces) {
  std::vector<VisibleEdge> edges;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t b = (a + 1) % 3, c = (a + 2) % 3;
    if (faces[b] || faces[c]) edges.push_back({a, 3});
    if (faces[c]) edges.push_back({a, b});
    if (faces[b]) edges.push_back({a, c});
  }
  return edges;
}

bool ToFlat(const Vector3d& point, double focal_px, Vector2d* flat) {
  if (!(point.z() > 1e-3)) return false;
  *flat = focal_px * point.head<2>() / point.z();
  return true;
}

bool FlatEnds(const TracedBox& box, const VisibleEdge& edge, double focal_px, Vector2d* a,
              Vector2d* b) {
  std::array<double, 3> share{};
  if (edge.far < 3) share[edge.far] = 1.0;
  if (!ToFlat(box.Point(share), focal_px, a)) return false;
  share[edge.axis] = 1.0;
  return ToFlat(box.Point(share), focal_px, b);
}

class BoxTracer {
 public:
  BoxTracer(const std::vector<FlatLine>& lines, const Eigen::Matrix3d& axes, double focal_px)
      : axes_(axes), focal_px_(focal_px) {
    for (std::size_t k = 0; k < 3; ++k) {
      along_[k] = LinesAlong(lines, axes.col(static_cast<Eigen::Index>(k)), focal_px);
      if (along_[k].size() > kMaxLines) along_[k].resize(kMaxLines);
    }
  }

  TracedBox Find() const {
    TracedBox best;
    for (std::size_t a = 0; a < 3; ++a) {
      for (const FlatLine& s : along_[a]) {
        for (const FlatLine& t : along_[(a + 1) % 3]) {
          if (!FormCorner(s.ends, t.ends)) continue;
          const Vector3d ray = s.plane.cross(t.plane);
          if (std::abs(ray.z()) > 1e-9) TryCorner(ray / ray.z(), &best);
        }
      }
    }
    return best;
  }

 private:
  // Of the edges along the box's axis `a` that begin at the point, one for each of these lengths.
  Eigen::VectorXd Supports(const TracedBox& box, const Vector3d& begin, std::size_t a,
                           const std::vector<double>& lengths) const {
    Eigen::VectorXd support = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(lengths.size()),
                                                        -std::numeric_limits<double>::infinity());
    Vector2d from, to;
    if (!ToFlat(begin, focal_px_, &from)) return support;
    const RaySupport ray(along_[a], from, FlatDirection(box.axis[a], from, focal_px_), kNearPx);
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      if (ToFlat(begin + lengths[i] * box.axis[a], focal_px_, &to))
        support[static_cast<Eigen::Index>(i)] = ray.Of((to - from).norm());
    }
    return support;
  }

  // Each axis leads away from the camera, as far as that can be told, else either way.
  void TryCorner(const Vector3d& corner, TracedBox* best) const {
    for (int senses = 0; senses < 8; ++senses) {
      TracedBox box;
      box.corner = corner;
      bool possible = true;
      for (std::size_t k = 0; k < 3; ++k) {
        const double sign = (senses >> k & 1) != 0 ? -1.0 : 1.0;
        box.axis[k] = sign * axes_.col(static_cast<Eigen::Index>(k));
        const double away = box.axis[k].dot(corner.normalized());
        box.faces[k] = away > 0.0;
        possible = possible && away > -kEdgeOnSine;
      }
      const bool sees_edge = box.faces[0] + box.faces[1] + box.faces[2] >= 2;
      if (possible && sees_edge) TryLengths(box, best);
    }
  }

  // Where lines across it may end the box along the axis: the longest of these lines.
  std::vector<double> FarEnds(const TracedBox& box, std::size_t k) const {
    std::vector<std::array<double, 2>> ends;  // Minus the line's length, and that of the box.
    Vector2d near, far;
    if (!ToFlat(box.corner, focal_px_, &near)) return {};
    for (std::size_t j = 0; j < 3; ++j) {
      for (const FlatLine& line : along_[j]) {
        const double across = line.plane.dot(box.axis[k]);
        if (j == k || std::abs(across) < 1e-9) continue;
        const double length = -line.plane.dot(box.corner) / across;
        if (!(length > 0.0) || !ToFlat(box.corner + length * box.axis[k], focal_px_, &far))
          continue;
        if ((far - near).norm() >= kMinEdgePx) ends.push_back({-line.LengthPx(), length});
      }
    }
    std::sort(ends.begin(), ends.end());
    const double same = kSameEndPx / focal_px_;
    std::vector<double> lengths;
    for (std::size_t i = 0; i < ends.size() && lengths.size() < kMaxEnds; ++i) {
      const bool is_new = std::none_of(lengths.begin(), lengths.end(), [&](double other) {
        return std::abs(ends[i][1] - other) < same;
      });
      if (is_new) lengths.push_back(ends[i][1]);
    }
    return lengths;
  }

  // The support of an edge depends on its own length and on one more at most: tables of pairs, then
  // all triples.
  void TryLengths(const TracedBox& box, TracedBox* best) const {
    std::array<std::vector<double>, 3> ends;
    for (std::size_t k = 0; k < 3; ++k) {
      ends[k] = FarEnds(box, k);
      if (ends[k].empty()) return;
    }
    std::array<Eigen::MatrixXd, 3> pair;  // [k]: of lengths along k + 1 and k + 2.
    for (std::size_t k = 0; k < 3; ++k) pair[k] = PairSupport(box, ends, (k + 1) % 3, (k + 2) % 3);
    const Eigen::VectorXd best_0 = pair[0].rowwise().maxCoeff(),
                          best_1 = pair[1].colwise().maxCoeff().transpose();
    for (Eigen::Index i = 0; i < pair[2].rows(); ++i) {
      for (Eigen::Index j = 0; j < pair[2].cols(); ++j) {
        if (!(pair[2](i, j) + best_0[j] + best_1[i] > best->score)) continue;
        for (Eigen::Index l = 0; l < pair[0].cols(); ++l) {
          const double score = pair[2](i, j) + pair[0](j, l) + pair[1](l, i);
          if (!(score > best->score)) continue;
          *best = box;
          best->length = {ends[0][static_cast<std::size_t>(i)],
                          ends[1][static_cast<std::size_t>(j)],
                          ends[2][static_cast<std::size_t>(l)]};
          best->score = score;
        }
      }
    }
  }

  // Of the edges along a at b's far end and along b at a's, where the face between them is seen;
  // and of those at the corner, each in the table that begins with its axis.
  Eigen::MatrixXd PairSupport(const TracedBox& box, const std::array<std::vector<double>, 3>& ends,
                              std::size_t a, std::size_t b) const {
    const std::size_t c = 3 - a - b;
    const auto rows = static_cast<Eigen::Index>(ends[a].size());
    const auto columns = static_cast<Eigen::Index>(ends[b].size());
    Eigen::MatrixXd support = Eigen::MatrixXd::Zero(rows, columns);
    if (box.faces[b] || box.faces[c]) support.colwise() += Supports(box, box.corner, a, ends[a]);
    if (!box.faces[c]) return support;
    for (Eigen::Index j = 0; j < columns; ++j) {
      const Vector3d far = box.corner + ends[b][static_cast<std::size_t>(j)] * box.axis[b];
      support.col(j) += Supports(box, far, a, ends[a]);
    }
    for (Eigen::Index i = 0; i < rows; ++i) {
      const Vector3d far = box.corner + ends[a][static_cast<std::size_t>(i)] * box.axis[a];
      support.row(i) += Supports(box, far, b, ends[b]).transpose();
    }
    return support;
  }

  Eigen::Matrix3d axes_;
  double focal_px_;
  std::array<std::vector<FlatLine>, 3> along_;
};

}  // namespace

Vector3d TracedBox::Point(const std::array<double, 3>& share) const {
  Vector3d point = corner;
  for (std::size_t k = 0; k < 3; ++k) point += share[k] * length[k] * axis[k];
  return point;
}

VisibleLength VisibleEdgesPx(const TracedBox& box, double focal_px) {
  VisibleLength length;
  for (const VisibleEdge& edge : VisibleEdges(box.faces)) {
    Vector2d a, b;
    if (!FlatEnds(box, edge, focal_px, &a, &b)) continue;
    length.all_px += (b - a).norm();
    length.shortest_px = std::min(length.shortest_px, (b - a).norm());
  }
  return length;
}

std::vector<TracedBox> TraceLines(const std::vector<DetectedLine>& lines,
                                  const std::vector<FlatLine>& flat, const Camera& camera,
                                  const std::vector<Eigen::Matrix3d>& axes) {
  AxesVote vote(flat, camera.fx);
  for (const Eigen::Matrix3d& candidate : axes) {
    for (int k = 0; k < 3; ++k) vote.Try(candidate.col(k));
  }
  for (const DetectedPencil& pencil : DetectPencils(lines, kMaxPencils, kSeed)) {
    if (pencil.observation.fit) vote.Try(pencil.observation.fit->direction.normalized());
  }
  vote.TryTriples();
  std::vector<Eigen::Matrix3d> all = vote.Best();
  all.insert(all.end(), axes.begin(), axes.end());
  std::vector<TracedBox> found;
  for (const Eigen::Matrix3d& candidate : all)
    found.push_back(BoxTracer(flat, candidate, camera.fx).Find());
  return found;
}

}  // namespace circline::apps
