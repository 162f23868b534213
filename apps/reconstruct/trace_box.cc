#include "apps/reconstruct/trace_box.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "apps/reconstruct/box_geometry.h"
#include "apps/reconstruct/box_tracer.h"
#include "apps/reconstruct/snap_box.h"
#include "circline/ransac/detection/edges.h"
#include "circline/ransac/detection/lines/edge_shift.h"
#include "circline/ransac/detection/lines/segment_meetings.h"

namespace circline::apps {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t kLeastEdges = 6;  // That the photo shows, of the seven or nine visible ones.
// Least share of the visible edges' length with edge points. Of 37 traces on photos of two boxes
// the 20 with a length more than 12 % off had 0.78 or less, two with an axis 7 degrees or more off
// 0.82 (apps/benchmark/boxes.py, which has no photos that were kept out of this).
constexpr double kLeastCovered = 0.83;
// Least length of the shortest visible edge, share of the photo's longer side: of boxes found right
// 0.10, of three false ones in streets (scene-lund, scene-lund-more) 0.014 to 0.023.
constexpr double kLeastEdgeShare = 0.05;
constexpr std::size_t kMostPolished = 24;  // Traces that are fitted, the best supported ones.
constexpr double kMinLinePx = 20.0;        // Of the lines that are traced.
constexpr double kCoarseReachPx = 8.0;     // From where a trace has an edge, and a fit.
constexpr double kFineReachPx = 3.0;
// From where a person has marked an edge: up to 5 px, and often a printed border (box-camprodon).
constexpr double kMarkedReachPx = 5.0;
constexpr double kAgreeSigmas = 2.0;  // Of lengths by the marks, and by what the photo shows there.
constexpr double kUncoveredWeight = 0.25;  // Of what no edge point covers.
constexpr double kCopyPx = 1.5;            // Of a line from the same one in another channel.
constexpr char kNoBox[] =
    "no box is sure enough in the photo: too few edges lie where its own would; mark its edges";
constexpr char kTooSlender[] =
    "no box is sure enough in the photo: the one found has an edge shorter than a twentieth of the "
    "photo; mark its edges";

// The same box with axes that a person would name: z upwards, x the longer of the other two.
BoxFit Named(const TracedBox& box, const Camera& camera) {
  std::size_t down = 0;
  double steepest = -2.0;
  const Vector2d at = camera.fx * box.corner.head<2>() / box.corner.z();
  for (std::size_t k = 0; k < 3; ++k) {
    const double fall = FlatDirection(box.axis[k], at, camera.fx).normalized().y();
    if (fall <= steepest) continue;
    steepest = fall;
    down = k;
  }
  std::size_t x = (down + 1) % 3, y = (down + 2) % 3;
  if (box.length[x] < box.length[y]) std::swap(x, y);
  BoxFit fit;
  fit.camera = camera;
  fit.length = {box.length[x], box.length[y], box.length[down]};
  Vector3d origin = box.corner + box.length[down] * box.axis[down], along_y = box.axis[y];
  if (box.axis[x].cross(along_y).dot(box.axis[down]) > 0.0) {  // Else left-handed.
    origin += box.length[y] * along_y;
    along_y = -along_y;
  }
  fit.cam_from_box.rotation << box.axis[x], along_y, -box.axis[down];
  fit.cam_from_box.translation = origin;
  return fit;
}

// Whether all faces that are seen meet at the corner.
bool IsOnSeenFaces(const BoxFit& fit, int corner) {
  for (int k = 0; k < 3; ++k) {
    if (FaceIsSeen(fit, k, (corner >> k & 1) == 0)) return false;
  }
  return true;
}

// By the corner of all seen faces; where that leaves a choice, the one nearest to that of `before`.
TracedBox FromFit(const BoxFit& fit, const TracedBox& before) {
  int nearest = 0;
  double best = -2.0;
  for (int corner = 0; corner < 8; ++corner) {
    if (!IsOnSeenFaces(fit, corner)) continue;
    const Vector3d seen = fit.InCamera(BoxCorner(fit.length, corner));
    const double cosine = seen.normalized().dot(before.corner.normalized());
    if (cosine <= best) continue;
    best = cosine;
    nearest = corner;
  }
  TracedBox box;
  const Vector3d corner = fit.InCamera(BoxCorner(fit.length, nearest));
  box.corner = corner / corner.z();
  for (int k = 0; k < 3; ++k) {
    const Vector3d axis = fit.cam_from_box.rotation.col(k);
    const auto i = static_cast<std::size_t>(k);
    box.axis[i] = (nearest >> k & 1) != 0 ? Vector3d(-axis) : axis;
    box.length[i] = fit.length[k] / corner.z();
    box.faces[i] = box.axis[i].dot(box.corner) > 0.0;
  }
  return box;
}

// Fitted to the edges that the photo has within each reach, one after the other; of a marked box
// also to the lines on its faces.
Status SnapAndFit(const PhotoEdges& edges, const std::vector<DetectedLine>& lines,
                  const Camera& camera, BoxOptions options, const std::vector<double>& reaches_px,
                  bool is_marked, BoxObservation* box, BoxFit* fit) {
  for (std::size_t i = 0; i < reaches_px.size(); ++i) {
    BoxObservation seen;
    seen.id = box->id;
    const Eigen::Matrix3d start = fit->cam_from_box.rotation;
    seen.edges = SnapBox(edges, *fit, reaches_px[i], is_marked).edges;
    if (is_marked) options.lines = FaceLines(lines, *fit);
    if (i + 1 == reaches_px.size()) {
      box->edges = seen.edges;
      seen = *box;
    }
    const Status status = FitBox(camera, seen, options, start, fit);
    if (!status.ok()) return status;
  }
  return Status::Ok();
}

// Whether the lengths of two fits of a box agree within their standard deviations.
bool Agree(const BoxFit& a, const BoxFit& b) {
  for (int k = 0; k < 3; ++k) {
    const double variance = a.covariance(6 + k, 6 + k) + b.covariance(6 + k, 6 + k);
    if (std::abs(a.length[k] - b.length[k]) > kAgreeSigmas * std::sqrt(variance)) return false;
  }
  return true;
}

// The photo, or each channel of it.
std::vector<cv::Mat> Channels(const cv::Mat& photo) {
  std::vector<cv::Mat> channels;
  cv::split(photo, channels);
  return channels;
}

double LengthPx(const DetectedLine& line) { return (line.ends[1] - line.ends[0]).norm(); }

// Of lines that lie along a longer one, as those of several channels do, the longer one.
void DropCopies(std::vector<DetectedLine>* lines) {
  std::stable_sort(lines->begin(), lines->end(), [](const DetectedLine& a, const DetectedLine& b) {
    return LengthPx(a) > LengthPx(b);
  });
  std::vector<DetectedLine> kept;
  for (DetectedLine& line : *lines) {
    const bool is_copy = std::any_of(kept.begin(), kept.end(), [&line](const DetectedLine& longer) {
      return LiesAlong(line.ends, longer.ends, kCopyPx);
    });
    if (!is_copy) kept.push_back(std::move(line));
  }
  *lines = std::move(kept);
}

Status DetectPhotoLines(const std::vector<cv::Mat>& channels, const Camera& camera,
                        PhotoEdges* edges, std::vector<DetectedLine>* lines) {
  const Status status = camera.Validate();
  if (!status.ok()) return status;
  for (const cv::Mat& channel : channels) {
    edges->push_back(DetectEdges(channel));
    std::vector<DetectedLine> bent;  // Worn edges are bent.
    std::vector<DetectedLine> straight =
        DetectLines(edges->back(), camera, kMinLinePx, nullptr, &bent);
    UndoEdgeShift(edges->back(), camera, &straight);
    lines->insert(lines->end(), straight.begin(), straight.end());
    lines->insert(lines->end(), bent.begin(), bent.end());
  }
  if (edges->size() > 1) DropCopies(lines);
  return Status::Ok();
}

// The traces that lines support best, fitted to the photo's edges, and of these the one of which
// edge points cover most, less gaps and what runs on beyond corners.
TracedBox Polished(const PhotoEdges& edges, const Camera& camera, const BoxOptions& options,
                   std::vector<TracedBox> found) {
  std::stable_sort(found.begin(), found.end(),
                   [](const TracedBox& a, const TracedBox& b) { return a.score > b.score; });
  if (found.size() > kMostPolished) found.resize(kMostPolished);
  TracedBox best;
  for (const TracedBox& trace : found) {
    if (!std::isfinite(trace.score)) continue;
    BoxFit fit = Named(trace, camera);
    BoxObservation box;
    if (!SnapAndFit(edges, {}, camera, options, {kCoarseReachPx}, false, &box, &fit).ok()) continue;
    TracedBox fitted = FromFit(fit, trace);
    const SnappedBox seen = SnapBox(edges, fit, kFineReachPx, false);
    const double gaps_px =
        std::max(0.0, VisibleEdgesPx(fitted, camera.fx).all_px - seen.covered_px);
    fitted.score = seen.covered_px - kUncoveredWeight * gaps_px - seen.overrun_px;
    if (fitted.score > best.score) best = fitted;
  }
  return best;
}

}  // namespace

Status TraceBox(const cv::Mat& photo, const Camera& camera, const BoxOptions& options,
                const std::vector<Eigen::Matrix3d>& axes, BoxObservation* box, BoxFit* fit) {
  std::vector<DetectedLine> lines;
  PhotoEdges edges;
  cv::Mat gray;
  Status status = ToGray(photo, &gray);
  if (status.ok()) status = DetectPhotoLines({gray}, camera, &edges, &lines);
  if (!status.ok()) return status;
  const std::vector<FlatLine> flat = FlatLines(lines, camera);
  std::vector<TracedBox> found = TraceLines(lines, flat, camera, axes);
  const TracedBox best = Polished(edges, camera, options, std::move(found));
  if (!std::isfinite(best.score)) return Status::Refused(kNoBox);
  *fit = Named(best, camera);
  status =
      SnapAndFit(edges, {}, camera, options, {kCoarseReachPx, 5.0, kFineReachPx}, false, box, fit);
  if (!status.ok()) return status;
  const VisibleLength visible = VisibleEdgesPx(FromFit(*fit, best), camera.fx);
  if (fit->edges.size() < kLeastEdges || !(visible.all_px > 0.0) ||
      SnapBox(edges, *fit, kFineReachPx, false).covered_px < kLeastCovered * visible.all_px)
    return Status::Refused(kNoBox);
  if (visible.shortest_px < kLeastEdgeShare * std::max(photo.cols, photo.rows))
    return Status::Refused(kTooSlender);
  return Status::Ok();
}

Status FitMarkedBox(const cv::Mat& photo, const Camera& camera, const BoxOptions& options,
                    BoxObservation* box, BoxFit* fit) {
  const bool is_stated = std::any_of(box->edges.begin(), box->edges.end(),
                                     [](const BoxEdge& edge) { return edge.sigma_px > 0.0; });
  Status status = FitBox(camera, *box, options, {}, fit);
  if (!status.ok() || is_stated) return status;
  PhotoEdges edges;
  std::vector<DetectedLine> lines;
  status = DetectPhotoLines(Channels(photo), camera, &edges, &lines);
  if (!status.ok()) return status;
  BoxObservation seen = *box;
  BoxFit moved = *fit;
  status = SnapAndFit(edges, lines, camera, options, {kMarkedReachPx, 4.0, kFineReachPx}, true,
                      &seen, &moved);
  if (!status.ok() || moved.edges.size() < std::max(fit->edges.size(), kLeastEdges) ||
      !Agree(*fit, moved))
    return Status::Ok();
  moved.notes.insert(moved.notes.begin(), fit->notes.begin(), fit->notes.end());
  *fit = std::move(moved);
  *box = std::move(seen);
  return Status::Ok();
}

}  // namespace circline::apps
