// The table of whole photographs: circles, pencils, and the contours of circles. Times are of
// DetectObservations, everything in it.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "apps/benchmark/detection_ellipses.h"
#include "apps/benchmark/detection_tables.h"
#include "apps/benchmark/detection_truth.h"
#include "apps/benchmark/timing.h"
#include "apps/common/pose_error.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/line_pose.h"
#include "circline/ransac/detection/detect_observations.h"

namespace circline::apps {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The circle found whose contour is that of the conic, or null.
const CircleObservation* CircleOf(const Matrix3d& conic, const Camera& camera,
                                  const Observations& found) {
  const PolygonPoints truth = ContourPolygon(camera, conic);
  for (const CircleObservation& circle : found.circles) {
    if (circle.fit &&
        IntersectionOverUnion(truth, ContourPolygon(camera, circle.fit->conic)) >= 0.8) {
      return &circle;
    }
  }
  return nullptr;
}

// Of the edge points of circles, root mean squares of the distances to the true conic, pixels; and
// what the set records of edge points of its own.
struct ContourResiduals {
  void Add(const cv::FileNode& circle, const Camera& camera, const Observations& observations) {
    const cv::Mat center = ReadMatrix(circle, "centre_cam"),
                  normal = ReadMatrix(circle, "normal_cam");
    const cv::FileNode recorded_rms = circle["contour_rms_to_ground_truth_px"];
    if (center.empty() || normal.empty() || recorded_rms.empty() || circle["radius"].empty())
      return;
    const CirclePose pose = {ToVector(normal),
                             ToVector(center) / static_cast<double>(circle["radius"])};
    const Matrix3d conic = ProjectCircle(pose);
    const CircleObservation* own = CircleOf(conic, camera, observations);
    if (own == nullptr) return;
    std::vector<CalibratedPoint> points;
    PixelsToCalibrated(camera, own->points, &points);
    double squares = 0.0;
    for (const CalibratedPoint& point : points)
      squares += std::pow(ConicDistancePx(point, conic), 2);
    found.push_back(std::sqrt(squares / static_cast<double>(points.size())));
    recorded.push_back(static_cast<double>(recorded_rms));
  }

  std::vector<double> found, recorded;
};

// What is true of one photo, and how far the observations are from it; NaN = not to be had.
struct PhotoErrors {
  int circles = 0, circles_found = 0;
  double normal_deg = std::nan("");    // Median over the circles found, better of two.
  double rotation_deg = std::nan("");  // From the two in-plane pencils, up to the board's symmetry.
  std::vector<double> directions_deg;
};

PhotoErrors MeasurePhoto(const cv::FileNode& node, const Camera& camera,
                         const Observations& found) {
  PhotoErrors errors;
  std::vector<PolygonPoints> truth, polygons;
  std::vector<Vector3d> normals;
  for (const char* key : {"circles", "ellipses"}) {
    for (const cv::FileNode& circle : node[key]) {
      const cv::Mat e = ReadMatrix(circle, "fitted_ellipse_raw");
      const cv::Mat n = ReadMatrix(circle, "normal_cam");
      if (e.empty()) continue;
      truth.push_back(EllipsePolygon(ReadEllipse(e)));
      normals.push_back(n.empty() ? Vector3d::Zero() : ToVector(n));
    }
  }
  for (const CircleObservation& circle : found.circles) {
    polygons.push_back(circle.fit ? ContourPolygon(camera, circle.fit->conic) : PolygonPoints());
  }
  std::vector<double> overlap, normal_errors;
  const std::vector<int> partner = Match(truth, polygons, &overlap);
  errors.circles = static_cast<int>(truth.size());
  for (std::size_t k = 0; k < partner.size(); ++k) {
    if (overlap[k] < 0.8) continue;
    ++errors.circles_found;
    const CircleObservation& circle = found.circles[static_cast<std::size_t>(partner[k])];
    if (!normals[k].isZero())
      normal_errors.push_back(BetterNormalDeg(circle.fit->conic, normals[k]));
  }
  if (!normal_errors.empty()) errors.normal_deg = Quantile(normal_errors, 0.5);
  const cv::Mat rotation = ReadMatrix(node, "R");
  std::vector<Vector3d> in_plane;
  for (const PencilObservation& pencil : found.pencils) {
    if (!pencil.plane.empty() && pencil.fit) in_plane.push_back(pencil.fit->direction);
  }
  Matrix3d estimate;
  if (!rotation.empty() && in_plane.size() >= 2 &&
      RotationFromOrthogonalDirections(in_plane[0], 1.0, in_plane[1], 1.0, &estimate)) {
    errors.rotation_deg = RotationErrorDeg(ToEigen(rotation), estimate, Symmetry::kD4);
  }
  for (const cv::FileNode& direction : node["directions"]) {
    const Vector3d d = ToVector(ReadMatrix(direction, "direction_cam"));
    double best = 90.0;
    for (const PencilObservation& pencil : found.pencils) {
      if (pencil.fit) best = std::min(best, AngleWithoutSenseDeg(pencil.fit->direction, d));
    }
    errors.directions_deg.push_back(best);
  }
  return errors;
}

}  // namespace

void MeasurePhotographs(const std::string& folder, const cv::FileNode& root) {
  std::printf(
      "photographs %s\n  photo                       circles pencils  normal deg  board deg"
      "  directions deg     ms\n",
      folder.c_str());
  std::vector<double> normals, rotations, ms;
  ContourResiduals contours;
  int circles = 0, circles_found = 0;
  for (const cv::FileNode& node : root["images"]) {
    const std::string file = ReadText(node, "file");
    const cv::Mat image = cv::imread(folder + "/" + file, cv::IMREAD_COLOR);
    Camera camera;
    if (image.empty() || !CameraOf(root, node, image.size(), &camera)) continue;
    Observations found;
    Status status;
    ms.push_back(Milliseconds(
        [&] { status = DetectObservations(image, camera, DetectionOptions(), &found); }));
    if (!status.ok()) {
      std::printf("  %s: %s\n", file.c_str(), status.message.c_str());
      continue;
    }
    const PhotoErrors e = MeasurePhoto(node, camera, found);
    for (const cv::FileNode& circle : node["circles"]) contours.Add(circle, camera, found);
    circles += e.circles;
    circles_found += e.circles_found;
    if (!std::isnan(e.normal_deg)) normals.push_back(e.normal_deg);
    if (!std::isnan(e.rotation_deg)) rotations.push_back(e.rotation_deg);
    std::printf("  %-26s %3d/%3d/%2d", file.c_str(), e.circles_found, e.circles,
                static_cast<int>(found.circles.size()));
    for (const PencilObservation& pencil : found.pencils) {
      std::printf(" %s%s%d", PencilDirectionName(pencil.direction), pencil.plane.c_str(),
                  static_cast<int>(pencil.lines.size()));
    }
    std::printf("  %.3f  %.3f ", e.normal_deg, e.rotation_deg);
    for (const double d : e.directions_deg) std::printf(" %.3f", d);
    std::printf("  %.1f  %s\n", ms.back(), found.message.c_str());
  }
  std::printf(
      "  circles %d of %d; median normal %.3f (90%% %.3f), board %.3f (90%% %.3f, %d photos)"
      "; ms median %.1f worst %.1f\n",
      circles_found, circles, Quantile(normals, 0.5), Quantile(normals, 0.9),
      Quantile(rotations, 0.5), Quantile(rotations, 0.9), static_cast<int>(rotations.size()),
      Quantile(ms, 0.5), Quantile(ms, 1.0));
  if (contours.found.empty()) return;
  std::printf("  contour rms to the truth: median %.3f px of %d, the set's own edges %.3f px\n",
              Quantile(contours.found, 0.5), static_cast<int>(contours.found.size()),
              Quantile(contours.recorded, 0.5));
}

}  // namespace circline::apps
