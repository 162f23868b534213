#include "apps/reconstruct/snap_box.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "apps/reconstruct/box_geometry.h"
#include "circline/ransac/detection/lines/segment_meetings.h"

namespace circline::apps {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kSpacingPx = 1.0;     // Of samples along an edge.
constexpr double kCornerShare = 0.05;  // Of an edge at either end, where corners are rounded.
constexpr double kLeastCosine =
    0.94;  // Of an edge point's gradient against across the edge: 20 deg.
constexpr double kOnLinePx = 1.0;
constexpr double kStepPx = 0.5;       // Of the offsets tried at either end.
constexpr double kLeastShare = 0.34;  // Of the samples that must have a point on the line.
// Of the best line's points that another one must have to be its rival, which may be the edge.
constexpr double kRivalShare = 0.6;
// Probability that a rival, and not the line taken, is the edge. Chosen on box-camprodon.
constexpr double kRivalIsRight = 0.25;
constexpr double kLeastSigmaPx = 0.05;
constexpr double kProlongedShare = 0.6;  // Of an edge, beyond its ends.

// An edge point near a sample.
struct NearPoint {
  double share;   // Of the way along the edge.
  double offset;  // Across it, outwards, pixels.
  int sample;
  const EdgePoint* point;
};

// An edge as the photo should show it.
struct ExpectedEdge {
  std::vector<Vector2d> samples;
  Vector2d across;         // Unit; of the outline: outwards.
  double length_px = 0.0;  // From corner to corner.
  bool is_outline = false;
};

// False where none of its two faces is seen.
bool Expect(const BoxFit& fit, int axis, int corner, ExpectedEdge* edge) {
  const int seen = NumSeenFaces(fit, axis, corner);
  if (seen == 0) return false;
  edge->is_outline = seen == 1;
  const Vector3d a = BoxCorner(fit.length, corner), b = BoxCorner(fit.length, corner | 1 << axis);
  Vector2d from, to, middle;
  if (!CameraToPixel(fit.camera, fit.InCamera(a), &from) ||
      !CameraToPixel(fit.camera, fit.InCamera(b), &to) ||
      !CameraToPixel(fit.camera, fit.InCamera(0.5 * fit.length), &middle)) {
    return false;
  }
  const Vector2d along = (to - from).normalized();
  edge->length_px = (to - from).norm();
  edge->across = {-along.y(), along.x()};
  if (edge->across.dot(middle - from) > 0.0) edge->across = -edge->across;
  const int steps = std::max(2, static_cast<int>(edge->length_px / kSpacingPx));
  for (int i = 0; i <= steps; ++i) {
    const double share = kCornerShare + (1.0 - 2.0 * kCornerShare) * i / steps;
    Vector2d pixel;
    if (!CameraToPixel(fit.camera, fit.InCamera(a + share * (b - a)), &pixel)) return false;
    edge->samples.push_back(pixel);
  }
  return true;
}

// The point in the pixel, if it lies on an edge across `across`.
const EdgePoint* PointAcross(const EdgeMap& edges, const Vector2d& at, const Vector2d& across) {
  const int index =
      edges.PointAt(static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y())));
  if (index < 0) return nullptr;
  const EdgePoint& point = edges.points[static_cast<std::size_t>(index)];
  return std::abs(point.Normal().dot(across)) < kLeastCosine ? nullptr : &point;
}

// By sample.
std::vector<NearPoint> PointsNear(const PhotoEdges& edges, const ExpectedEdge& edge,
                                  double reach_px) {
  std::vector<NearPoint> near;
  for (std::size_t i = 0; i < edge.samples.size(); ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(edge.samples.size() - 1);
    for (const EdgeMap& map : edges) {
      const EdgePoint* last = nullptr;
      for (double offset = -reach_px; offset <= reach_px; offset += 0.5) {
        const Vector2d at = edge.samples[i] + offset * edge.across;
        const EdgePoint* point = PointAcross(map, at, edge.across);
        if (point == nullptr || point == last) continue;
        last = point;
        near.push_back({share, edge.across.dot(point->Position() - edge.samples[i]),
                        static_cast<int>(i), point});
      }
    }
  }
  return near;
}

// Samples with a point on the line from offset `a` to offset `b`.
int CountOnLine(const std::vector<NearPoint>& near, double a, double b) {
  int count = 0, last = -1;
  for (const NearPoint& point : near) {
    if (point.sample == last || std::abs(point.offset - a - point.share * (b - a)) > kOnLinePx)
      continue;
    last = point.sample;
    ++count;
  }
  return count;
}

// A line by its offsets at both ends, and how many samples have a point on it.
struct Candidate {
  double a, b;
  int count;
};

// Root mean square distance, along the edge, of the lines with at least `least` points from the one
// with offsets `a` and `b`.
double RivalsPx(const std::vector<Candidate>& candidates, double least, double a, double b) {
  double squares = 0.0, count = 0.0;
  for (const Candidate& candidate : candidates) {
    if (candidate.count < least) continue;
    const double da = candidate.a - a, db = candidate.b - b;
    squares += (da * da + da * db + db * db) / 3.0;
    count += 1.0;
  }
  return std::sqrt(squares / count);
}

// The line's offsets at both ends, and what its points share as it may be another line. False where
// none has points on a third of the samples.
bool FindOffsets(const std::vector<NearPoint>& near, const ExpectedEdge& edge, double reach_px,
                 bool is_marked, double* a, double* b, double* shared_px) {
  std::vector<Candidate> candidates;
  int most = 0;
  for (double p = -reach_px; p <= reach_px; p += kStepPx) {
    for (double q = -reach_px; q <= reach_px; q += kStepPx) {
      candidates.push_back({p, q, CountOnLine(near, p, q)});
      most = std::max(most, candidates.back().count);
    }
  }
  if (most < kLeastShare * static_cast<double>(edge.samples.size())) return false;
  const double least =
      std::max(kRivalShare * most, kLeastShare * static_cast<double>(edge.samples.size()));
  const double least_of_edge = edge.is_outline || is_marked ? least : most;
  double best = -1e9;
  for (const Candidate& candidate : candidates) {
    if (candidate.count < least_of_edge) continue;
    // Of the outline how far out, of others how near to where it was expected.
    const double merit = edge.is_outline ? candidate.a + candidate.b
                                         : -std::abs(candidate.a) - std::abs(candidate.b);
    if (merit <= best) continue;
    best = merit;
    *a = candidate.a;
    *b = candidate.b;
  }
  if (is_marked) *shared_px = std::sqrt(kRivalIsRight) * RivalsPx(candidates, least, *a, *b);
  // To the middle of its points.
  for (int pass = 0; pass < 3; ++pass) {
    Eigen::Matrix2d moments = 1e-6 * Eigen::Matrix2d::Identity();
    Vector2d sums = 1e-6 * Vector2d(*a, *b);
    for (const NearPoint& point : near) {
      if (std::abs(point.offset - *a - point.share * (*b - *a)) > 1.5 * kOnLinePx) continue;
      const Vector2d row(1.0 - point.share, point.share);
      moments += row * row.transpose();
      sums += row * point.offset;
    }
    const Vector2d solved = moments.inverse() * sums;
    *a = solved.x();
    *b = solved.y();
  }
  return true;
}

// Pixels with an edge point on the prolonged line, from a little beyond either corner on.
double Overrun(const PhotoEdges& edges, const ExpectedEdge& edge, double a, double b) {
  const Vector2d from = edge.samples.front() + a * edge.across,
                 to = edge.samples.back() + b * edge.across, along = (to - from).normalized(),
                 across(-along.y(), along.x());
  const double length = (to - from).norm();
  double overrun = 0.0;
  for (const double sense : {-1.0, 1.0}) {
    for (double beyond = kCornerShare * length + 4.0; beyond < kProlongedShare * length + 4.0;
         beyond += 1.0) {
      const Vector2d at = (sense < 0.0 ? from : to) + sense * beyond * along;
      const bool runs_on = std::any_of(edges.begin(), edges.end(), [&](const EdgeMap& map) {
        return PointAcross(map, at, across) != nullptr;
      });
      if (runs_on) overrun += 1.0;
    }
  }
  return overrun;
}

// ---- Lines on its faces ----

// Of a line's plane through the camera against an axis along which it is taken to be, radians: what
// a fit's direction may be off. This and the next two are guesses, tried with no other value.
constexpr double kLineAlongRad = 0.04;
// Of the photo's longer side: shorter lines are letters.
constexpr double kLeastLineShare = 0.03;
// Of a face, about its middle: its edges are no lines on it.
constexpr double kWithinFace = 0.98;

// Where the photo has the face across `axis`; none if it is not seen.
std::optional<ConvexRegion> SeenFace(const BoxFit& fit, int axis, bool far) {
  if (!FaceIsSeen(fit, axis, far)) return std::nullopt;
  std::vector<Eigen::Vector2d> corners;
  for (int corner = 0; corner < 8; ++corner) {
    if ((corner >> axis & 1) != (far ? 1 : 0)) continue;
    corners.emplace_back();
    const Eigen::Vector3d at = fit.InCamera(BoxCorner(fit.length, corner));
    if (!CameraToPixel(fit.camera, at, &corners.back())) return std::nullopt;
  }
  return ConvexRegion(corners, kWithinFace);
}

}  // namespace

SnappedBox SnapBox(const PhotoEdges& edges, const BoxFit& fit, double reach_px, bool is_marked) {
  SnappedBox snapped;
  for (int axis = 0; axis < 3; ++axis) {
    for (int corner = 0; corner < 8; ++corner) {
      ExpectedEdge expected;
      if ((corner >> axis & 1) != 0 || !Expect(fit, axis, corner, &expected)) continue;
      const std::vector<NearPoint> near = PointsNear(edges, expected, reach_px);
      double a = 0.0, b = 0.0, shared_px = 0.0;
      if (!FindOffsets(near, expected, reach_px, is_marked, &a, &b, &shared_px)) continue;
      snapped.overrun_px += Overrun(edges, expected, a, b);
      snapped.covered_px += expected.length_px * CountOnLine(near, a, b) /
                            static_cast<double>(expected.samples.size());
      BoxEdge edge;
      edge.axis = axis;
      for (int k = 0; k < 3; ++k) edge.far[static_cast<std::size_t>(k)] = (corner >> k & 1) != 0;
      edge.sigma_px = kLeastSigmaPx;
      edge.shared_px = shared_px;
      std::set<const EdgePoint*> taken;  // A point may be near to several samples.
      for (const NearPoint& point : near) {
        if (std::abs(point.offset - a - point.share * (b - a)) > kOnLinePx) continue;
        if (!taken.insert(point.point).second) continue;
        edge.points.push_back(point.point->Position());
        edge.sigma_px = std::max(edge.sigma_px, static_cast<double>(point.point->sigma_px));
      }
      if (edge.points.size() >= 3) snapped.edges.push_back(std::move(edge));
    }
  }
  return snapped;
}

std::vector<FaceLine> FaceLines(const std::vector<DetectedLine>& lines, const BoxFit& fit) {
  std::vector<FaceLine> found;
  const double least_px = kLeastLineShare * std::max(fit.camera.width, fit.camera.height);
  for (int across = 0; across < 3; ++across) {
    for (const bool far : {false, true}) {
      const std::optional<ConvexRegion> face = SeenFace(fit, across, far);
      if (!face) continue;
      for (const DetectedLine& line : lines) {
        if (line.length_px < least_px || !face->Contains(line.ends)) continue;
        for (int axis = 0; axis < 3; ++axis) {
          const double sine = fit.cam_from_box.rotation.col(axis).dot(line.fit.line.normalized());
          if (axis == across || std::abs(sine) > kLineAlongRad) continue;
          found.push_back({axis, line.points, line.sigma_px});
        }
      }
    }
  }
  return found;
}

}  // namespace circline::apps
