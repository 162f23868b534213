#include "circline/ransac/detection/ellipses/ellipse_evidence.h"

#include <cstddef>
#include <string>
#include <vector>

#include "circline/estimators/exactness.h"

namespace circline {
namespace {

using Eigen::Vector2d;

// Neighbouring edge points share the noise of the pixels under the smoothing Gaussian (sigma 1 px):
// the correlation at a distance d is exp(-d^2 / 4). Every second point carries nearly all that
// there is to know; taking every point (1 px) for independent makes a sum of them 1.9 times too
// sure.
constexpr std::size_t kThinFrom = 60;  // Points from which every second one is dropped.
constexpr double kCorrelationDense = 1.9;
// No contour lies farther than this from the edges it was fitted to, pixels.
constexpr double kMaxBiasPx = 1.0;

}  // namespace

void FillCircle(const EdgeMap& edges, const DetectedEllipse& ellipse, const Camera& camera,
                const NoiseModel& noise, CircleObservation* circle) {
  const bool thin = ellipse.contour.size() >= kThinFrom;
  // The contour of a second look is not that of the edges.
  const bool has_normals = ellipse.contour.size() == ellipse.points.size();
  circle->points.clear();
  circle->normals.clear();
  for (std::size_t k = 0; k < ellipse.contour.size(); k += thin ? 2 : 1) {
    circle->points.push_back(ellipse.contour[k]);
    if (!has_normals) continue;
    const EdgePoint& edge = edges.points[static_cast<std::size_t>(ellipse.points[k])];
    const bool is_near = (edge.Position() - ellipse.contour[k]).norm() < kMaxBiasPx;
    circle->normals.push_back(is_near ? edge.Normal() : Vector2d::Zero());
  }
  // The scatter of a smooth contour says little of its error: the estimate measures that, on all
  // circles.
  circle->sigma_px = 0.0;
  circle->fit = ellipse.fit;
  // The fit used every point: their correlation is that of dense points.
  circle->fit->ScaleCovariance(
      kCorrelationDense * kCorrelationDense /
      noise.ContourWeight(kCorrelationDense * ellipse.sigma_px, ellipse.contour, {}));
  std::vector<CalibratedPoint> calibrated;
  PixelsToCalibrated(camera, circle->points, &calibrated);
  circle->fit->irregularity = Irregularity(calibrated, circle->fit->conic, noise);
  circle->inliers.clear();
  circle->second.reset();
}

std::vector<std::uint8_t> EllipsePoints(const EdgeMap& edges,
                                        const std::vector<DetectedEllipse>& ellipses) {
  std::vector<std::uint8_t> mask(edges.points.size(), 0);
  for (const DetectedEllipse& ellipse : ellipses) {
    for (const int i : ellipse.points) mask[static_cast<std::size_t>(i)] = 1;
  }
  return mask;
}

Status CheckDetectionInput(const cv::Mat& image, const Camera& camera,
                           const DetectionOptions& options) {
  Status status = options.Validate();
  if (status.ok()) status = camera.Validate();
  if (!status.ok()) return status;
  if (image.empty()) return Status::Invalid("the image is empty");
  if ((camera.width > 0 && camera.width != image.cols) ||
      (camera.height > 0 && camera.height != image.rows)) {
    return Status::Invalid("the image is " + std::to_string(image.cols) + " x " +
                           std::to_string(image.rows) + " pixels, its camera " +
                           std::to_string(camera.width) + " x " + std::to_string(camera.height));
  }
  return Status::Ok();
}

}  // namespace circline
