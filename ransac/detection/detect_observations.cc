#include "circline/ransac/detection/detect_observations.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "circline/ransac/detection/edges.h"
#include "circline/ransac/detection/ellipses/detect_ellipses.h"
#include "circline/ransac/detection/ellipses/ellipse_evidence.h"
#include "circline/ransac/detection/lines/detect_lines.h"
#include "circline/ransac/detection/lines/edge_shift.h"
#include "circline/ransac/detection/structure/look_for_focal.h"
#include "circline/ransac/detection/structure/observe_evidence.h"

namespace circline {
namespace {

using Eigen::Vector2d;

// A photo has no more directions worth telling apart.
constexpr int kMostDirections = 100;

// Where nothing tells a pose, edges of this share of the usual contrast are looked at: in haze, in
// the dark.
constexpr double kFaint = 0.5;

std::vector<CircleEvidence> MakeCircles(const EdgeMap& edges,
                                        const std::vector<DetectedEllipse>& ellipses,
                                        const Camera& camera, const NoiseModel& noise) {
  std::vector<CircleEvidence> circles;
  for (const DetectedEllipse& ellipse : ellipses) {
    CircleEvidence circle;
    FillCircle(edges, ellipse, camera, noise, &circle.observation);
    if (ellipse.concentric >= 0) {
      circle.observation.concentric = "g" + std::to_string(ellipse.concentric);
    }
    circle.support_px = ellipse.length_px;
    circle.num_normals = CircleNormals(*circle.observation.fit, &circle.normals);
    if (circle.num_normals > 0) circles.push_back(std::move(circle));
  }
  return circles;
}

PhotoEvidence CollectEvidence(const EdgeMap& edges, const Camera& camera,
                              const DetectionOptions& options) {
  PhotoEvidence evidence;
  std::vector<DetectedEllipse> ellipses =
      DetectEllipses(edges, camera, {options.min_ellipse_axis_px, options.min_arc_deg});
  const std::vector<std::uint8_t> on_ellipses = EllipsePoints(edges, ellipses);
  evidence.num_ellipses = ellipses.size();
  ellipses.resize(std::min(ellipses.size(), static_cast<std::size_t>(options.max_circles)));
  evidence.circles = MakeCircles(edges, ellipses, camera, options.noise_model);
  if (options.max_pencils == 0) return evidence;
  evidence.lines =
      DetectLines(edges, camera, options.min_segment_length_px, &on_ellipses, &evidence.bent);
  UndoEdgeShift(edges, camera, &evidence.lines);
  return evidence;
}

void Observe(const EdgeMap& edges, const Camera& camera, const DetectionOptions& options,
             Observations* observations) {
  *observations = Observations();
  observations->camera = camera;
  observations->camera.width = edges.width;
  observations->camera.height = edges.height;
  const double diagonal_px = DiagonalPx(edges.width, edges.height);
  const auto collect = [&](const Camera& through) {
    return CollectEvidence(edges, through, options);
  };
  PhotoEvidence evidence = options.noise_model.camera.IsWide()
                               ? LookForFocal(collect, options, diagonal_px, observations)
                               : collect(observations->camera);
  ObserveEvidence(options, diagonal_px, &evidence, observations);
}

}  // namespace

Status DetectionOptions::Validate() const {
  if (!(min_ellipse_axis_px > 0.0) || !std::isfinite(min_ellipse_axis_px))
    return Status::Invalid("min_ellipse_axis_px must be positive and finite");
  if (!(min_arc_deg > 0.0 && min_arc_deg <= 360.0)) {
    return Status::Invalid("min_arc_deg must be in (0, 360]");
  }
  if (!(min_segment_length_px > 0.0) || !std::isfinite(min_segment_length_px)) {
    return Status::Invalid("min_segment_length_px must be positive and finite");
  }
  if (max_circles < 0) return Status::Invalid("max_circles must not be negative");
  if (max_pencils < 0 || max_pencils > kMostDirections) {
    return Status::Invalid("max_pencils must be from 0 to " + std::to_string(kMostDirections));
  }
  if (!(max_shared_plane_deg > 0.0)) {
    return Status::Invalid("max_shared_plane_deg must be positive");
  }
  return noise_model.Validate();
}

Status DetectObservations(const cv::Mat& image, const Camera& camera,
                          const DetectionOptions& options, Observations* observations) {
  *observations = Observations();
  observations->camera = camera;
  cv::Mat gray;
  Status status = CheckDetectionInput(image, camera, options);
  if (status.ok()) status = ToGray(image, &gray);
  if (!status.ok()) return status;
  for (const double faintness : {1.0, kFaint}) {
    Observe(DetectEdges(gray, kEdgeSmoothingPx, nullptr, faintness), camera, options, observations);
    if (!observations->circles.empty() || observations->pencils.size() > 1) break;
  }
  return Status::Ok();
}

Status DetectCircleInRoi(const cv::Mat& image, const Camera& camera, const cv::Rect& roi,
                         const DetectionOptions& options, CircleObservation* circle) {
  Status status = CheckDetectionInput(image, camera, options);
  if (!status.ok()) return status;
  const cv::Rect inside = roi & cv::Rect(0, 0, image.cols, image.rows);
  if (inside.width < 3 || inside.height < 3) {
    return Status::Invalid("the rectangle does not overlap the image");
  }
  cv::Mat gray;
  status = ToGray(image(inside), &gray);
  if (!status.ok()) return status;
  // The same camera, seen from the rectangle's corner: fits are calibrated, so they stay valid.
  Camera shifted = camera;
  shifted.width = inside.width;
  shifted.height = inside.height;
  shifted.cx -= inside.x;
  shifted.cy -= inside.y;
  EdgeMap edges;
  std::vector<DetectedEllipse> ellipses;
  for (const double faintness : {1.0, kFaint}) {
    edges = DetectEdges(gray, kEdgeSmoothingPx, nullptr, faintness);
    ellipses = DetectEllipses(edges, shifted, {options.min_ellipse_axis_px, options.min_arc_deg});
    if (!ellipses.empty()) break;
  }
  if (ellipses.empty()) return Status::Refused("no ellipse found inside the rectangle");
  FillCircle(edges, ellipses.front(), shifted, options.noise_model, circle);
  for (Vector2d& p : circle->points) p += Vector2d(inside.x, inside.y);
  return Status::Ok();
}

}  // namespace circline
