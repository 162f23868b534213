#include "apps/reconstruct/box_tracer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/reconstruct/fit_box.h"
#include "circline/ransac/detection/detect_pencils.h"
#include "circline/ransac/detection/segment_meetings.h"

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
constexpr double kSameEndPx = 1.0;  // Far ends nearer than this are one.

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
  double Support(const TracedBox& box, const VisibleEdge& edge) const {
    Vector2d a, b;
    if (!FlatEnds(box, edge, focal_px_, &a, &b)) return -std::numeric_limits<double>::infinity();
    return EdgeSupport(along_[edge.axis], a, b, kNearPx);
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

  // Where lines across it may end the box along the axis.
  std::vector<double> FarEnds(const TracedBox& box, std::size_t k) const {
    std::vector<double> lengths;
    Vector2d near, far;
    if (!ToFlat(box.corner, focal_px_, &near)) return lengths;
    for (std::size_t j = 0; j < 3; ++j) {
      for (const FlatLine& line : along_[j]) {
        const double across = line.plane.dot(box.axis[k]);
        if (j == k || std::abs(across) < 1e-9) continue;
        const double length = -line.plane.dot(box.corner) / across;
        if (!(length > 0.0) || !ToFlat(box.corner + length * box.axis[k], focal_px_, &far))
          continue;
        if ((far - near).norm() >= kMinEdgePx) lengths.push_back(length);
      }
    }
    std::sort(lengths.begin(), lengths.end());
    const double same = kSameEndPx / focal_px_;
    lengths.erase(std::unique(lengths.begin(), lengths.end(),
                              [same](double a, double b) { return b - a < same; }),
                  lengths.end());
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
    const auto index = [](std::size_t i) { return static_cast<Eigen::Index>(i); };
    for (std::size_t i = 0; i < ends[0].size(); ++i) {
      for (std::size_t j = 0; j < ends[1].size(); ++j) {
        for (std::size_t l = 0; l < ends[2].size(); ++l) {
          const double score = pair[2](index(i), index(j)) + pair[0](index(j), index(l)) +
                               pair[1](index(l), index(i));
          if (!(score > best->score)) continue;
          *best = box;
          best->length = {ends[0][i], ends[1][j], ends[2][l]};
          best->score = score;
        }
      }
    }
  }

  // Of the edges along a at b's far end and along b at a's, where the face between them is seen;
  // and of those at the corner, each in the table that begins with its axis.
  Eigen::MatrixXd PairSupport(TracedBox box, const std::array<std::vector<double>, 3>& ends,
                              std::size_t a, std::size_t b) const {
    const std::size_t c = 3 - a - b;
    const auto rows = static_cast<Eigen::Index>(ends[a].size());
    const auto columns = static_cast<Eigen::Index>(ends[b].size());
    Eigen::MatrixXd support = Eigen::MatrixXd::Zero(rows, columns);
    for (Eigen::Index i = 0; i < rows; ++i) {
      box.length[a] = ends[a][static_cast<std::size_t>(i)];
      if (box.faces[b] || box.faces[c]) support.row(i).array() += Support(box, {a, 3});
      for (Eigen::Index j = 0; j < columns && box.faces[c]; ++j) {
        box.length[b] = ends[b][static_cast<std::size_t>(j)];
        support(i, j) += Support(box, {a, b}) + Support(box, {b, a});
      }
    }
    return support;
  }

  Eigen::Matrix3d axes_;
  double focal_px_;
  std::array<std::vector<FlatLine>, 3> along_;
};

// Which axes, of those that a direction known beforehand leaves, corners of lines speak for.
class AxesVote {
 public:
  AxesVote(const std::vector<FlatLine>& lines, double focal_px)
      : lines_(lines), focal_px_(focal_px) {
    for (std::size_t i = 0; i < lines.size(); ++i) {
      for (std::size_t j = i + 1; j < lines.size(); ++j) {
        if (FormCorner(lines[i].ends, lines[j].ends)) corners_.push_back({i, j});
      }
    }
  }

  // One axis is `axis`, a second one at right angles to it is seen along one of the lines.
  void Try(const Vector3d& axis) {
    for (const FlatLine& line : lines_) {
      const Vector3d along = line.plane.cross(axis);
      if (!(along.norm() > kMinSine)) continue;
      Eigen::Matrix3d axes;
      axes << along.normalized(), axis.cross(along.normalized()), axis;
      votes_.emplace_back(Vote(axes), axes);
    }
  }

  // Three lines that form corners with one another leave few.
  void TryTriples(const std::vector<DetectedLine>& lines, const Camera& camera) {
    const auto edge = [&](std::size_t i, int axis) {
      BoxEdge one;
      one.axis = axis;
      one.points = lines[static_cast<std::size_t>(lines_[i].index)].points;
      return one;
    };
    for (const auto& [i, j] : corners_) {
      for (const auto& [k, l] : corners_) {
        if (k != j || std::find(corners_.begin(), corners_.end(), Corner{i, l}) == corners_.end())
          continue;
        for (const Eigen::Matrix3d& axes : BoxAxes(camera, {edge(i, 0), edge(j, 1), edge(l, 2)}))
          votes_.emplace_back(Vote(axes), axes);
      }
    }
  }

  std::vector<Eigen::Matrix3d> Best() {
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

 private:
  using Corner = std::array<std::size_t, 2>;  // Indices into lines_, ascending.
  static constexpr double kMinSine = 0.2;
  static constexpr double kSameCosine = 0.9998;  // One degree.
  static constexpr std::size_t kMostAxes = 48;

  // Length of lines that form corners between different axes, the shorter of each two.
  double Vote(const Eigen::Matrix3d& axes) const {
    std::vector<int> axis(lines_.size(), -1);
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        if (IsAlong(lines_[i], axes.col(k), focal_px_)) axis[i] = k;
      }
    }
    double sum = 0.0;
    for (const auto& [i, j] : corners_) {
      if (axis[i] < 0 || axis[j] < 0 || axis[i] == axis[j]) continue;
      sum += std::min((lines_[i].ends[1] - lines_[i].ends[0]).norm(),
                      (lines_[j].ends[1] - lines_[j].ends[0]).norm());
    }
    return sum;
  }

  const std::vector<FlatLine>& lines_;
  double focal_px_;
  std::vector<Corner> corners_;
  std::vector<std::pair<double, Eigen::Matrix3d>> votes_;
};

}  // namespace

Eigen::Matrix3d TracedBox::Axes() const {
  Eigen::Matrix3d axes;
  axes << axis[0], axis[1], axis[2];
  return axes;
}

Vector3d TracedBox::Point(const std::array<double, 3>& share) const {
  Vector3d point = corner;
  for (std::size_t k = 0; k < 3; ++k) point += share[k] * length[k] * axis[k];
  return point;
}

double VisiblePx(const TracedBox& box, double focal_px) {
  double sum = 0.0;
  for (const VisibleEdge& edge : VisibleEdges(box.faces)) {
    Vector2d a, b;
    if (FlatEnds(box, edge, focal_px, &a, &b)) sum += (b - a).norm();
  }
  return sum;
}

std::vector<TracedBox> TraceLines(const std::vector<DetectedLine>& lines,
                                  const std::vector<FlatLine>& flat, const Camera& camera,
                                  const std::vector<Eigen::Matrix3d>& axes) {
  AxesVote vote(flat, camera.fx);
  for (const Eigen::Matrix3d& candidate : axes) {
    for (int k = 0; k < 3; ++k) vote.Try(candidate.col(k));
  }
  std::vector<DetectedPencil> pencils;
  if (DetectPencils(lines, kMaxPencils, kSeed, &pencils).ok()) {
    for (const DetectedPencil& pencil : pencils) {
      if (pencil.observation.fit) vote.Try(pencil.observation.fit->direction.normalized());
    }
  }
  vote.TryTriples(lines, camera);
  std::vector<Eigen::Matrix3d> all = vote.Best();
  all.insert(all.end(), axes.begin(), axes.end());
  std::vector<TracedBox> found;
  for (const Eigen::Matrix3d& candidate : all)
    found.push_back(BoxTracer(flat, candidate, camera.fx).Find());
  return found;
}

}  // namespace circline::apps
