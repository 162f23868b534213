#include "apps/benchmark/detection_contours.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "apps/benchmark/detection_statistics.h"
#include "apps/benchmark/detection_truth.h"
#include "apps/benchmark/ellipse_overlap.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/conic.h"

namespace circline::benchmark {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;

struct Sums {
  double n = 0.0, sum = 0.0, squares = 0.0;

  void Add(double d) {
    n += 1.0;
    sum += d;
    squares += d * d;
  }
  double Rms() const { return std::sqrt(squares / n); }
  double Deviation() const { return std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n))); }
};

void AddDistance(const Camera& camera, const Matrix3d& conic, const Vector2d& pixel, Sums* sums) {
  CalibratedPoint p;
  if (PixelToCalibrated(camera, pixel, &p)) sums->Add(ConicDistancePx(p, conic));
}

// The point that lies in the direction of `pixel` from the centre to within a pixel's width, or
// null.
const Vector2d* InDirection(const Vector2d& center, const Vector2d& pixel,
                            const std::vector<Vector2d>& points) {
  const Vector2d along = (pixel - center).normalized();
  const Vector2d* best = nullptr;
  double nearest = 0.5;
  for (const Vector2d& point : points) {
    const Vector2d d = point - center;
    const double aside = std::abs(along.x() * d.y() - along.y() * d.x());
    if (along.dot(d) <= 0.0 || aside >= nearest) continue;
    nearest = aside;
    best = &point;
  }
  return best;
}

// The points of the circle found whose contour is the true one's, or null.
const std::vector<Vector2d>* PointsOf(const Matrix3d& conic, const Camera& camera,
                                      const Observations& found) {
  const PolygonPoints truth = ContourPolygon(camera, conic);
  for (const CircleObservation& circle : found.circles) {
    if (!circle.fit) continue;
    if (IntersectionOverUnion(truth, ContourPolygon(camera, circle.fit->conic)) >= 0.8) {
      return &circle.points;
    }
  }
  return nullptr;
}

}  // namespace

void ContourResiduals::Add(const cv::FileNode& node, const Camera& camera,
                           const Observations& found) {
  for (const cv::FileNode& circle : node["circles"]) AddCircle(circle, camera, found);
}

void ContourResiduals::AddCircle(const cv::FileNode& circle, const Camera& camera,
                                 const Observations& found) {
  const cv::Mat center = ReadMatrix(circle, "centre_cam"),
                normal = ReadMatrix(circle, "normal_cam");
  const cv::FileNode recorded = circle["contour_rms_to_ground_truth_px"];
  if (center.empty() || normal.empty() || recorded.empty() || circle["radius"].empty()) return;
  const double radius = static_cast<double>(circle["radius"]);
  radii_.insert(radius);
  ++circles_;
  CirclePose pose;
  pose.normal = ToVector(normal);
  pose.center = ToVector(center) / radius;
  const Matrix3d conic = ProjectCircle(pose);
  const std::vector<Vector2d>* points = PointsOf(conic, camera, found);
  if (points == nullptr) return;
  Sums sums;
  for (const Vector2d& pixel : *points) AddDistance(camera, conic, pixel, &sums);
  if (!(sums.n > 0.0)) return;
  found_.push_back(sums.Rms());
  about_mean_.push_back(sums.Deviation());
  recorded_.push_back(static_cast<double>(recorded));
  Vector2d pixel;
  if (CameraToPixel(camera, pose.center, &pixel)) AddBeside(circle, camera, conic, pixel, *points);
}

void ContourResiduals::AddBeside(const cv::FileNode& circle, const Camera& camera,
                                 const Matrix3d& conic, const Vector2d& center,
                                 const std::vector<Vector2d>& points) {
  const cv::Mat contour = ReadMatrix(circle, "contour");
  if (contour.empty() || contour.type() != CV_32F) return;
  Sums listed, beside;
  for (int i = 0; i < contour.rows; ++i) {
    const Vector2d pixel(static_cast<double>(contour.at<float>(i, 0)),
                         static_cast<double>(contour.at<float>(i, 1)));
    const Vector2d* point = InDirection(center, pixel, points);
    if (point == nullptr) continue;
    AddDistance(camera, conic, pixel, &listed);
    AddDistance(camera, conic, *point, &beside);
  }
  if (!(listed.n > 0.0 && beside.n > 0.0)) return;
  listed_.push_back(listed.Rms());
  beside_.push_back(beside.Rms());
}

void ContourResiduals::Print() const {
  if (found_.empty()) return;
  std::printf("  contour rms to the truth: median %.3f px of %d, the set's own edges %.3f px\n",
              Quantile(found_, 0.5), static_cast<int>(found_.size()), Quantile(recorded_, 0.5));
  if (!listed_.empty()) {
    std::printf(
        "    in the directions of the edge points that it lists: %.3f px of %d, these %.3f\n",
        Quantile(beside_, 0.5), static_cast<int>(beside_.size()), Quantile(listed_, 0.5));
  }
  if (circles_ > 1 && radii_.size() == static_cast<std::size_t>(circles_)) {
    std::printf(
        "    each circle has its own radius, fitted to the set's edges; apart from the size: "
        "%.3f px\n",
        Quantile(about_mean_, 0.5));
  }
}

}  // namespace circline::benchmark
