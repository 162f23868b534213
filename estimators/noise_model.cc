#include "circline/estimators/noise_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "circline/estimators/basics.h"

namespace circline {
namespace {

using Field = std::pair<const char*, double>;

template <std::size_t kSize>
Status NonNegative(const Field (&fields)[kSize]) {
  for (const auto& [name, value] : fields) {
    if (!(value >= 0.0) || !std::isfinite(value))
      return Status::Invalid(std::string(name) + " must be 0 or more");
  }
  return Status::Ok();
}

struct Extent {
  double num_points = 0.0;
  Eigen::Vector2d size = Eigen::Vector2d::Zero();  // Of the box of the points.

  Extent(const std::vector<Eigen::Vector2d>& points, const std::vector<std::uint8_t>& inliers) {
    Eigen::AlignedBox2d box;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!inliers.empty() && inliers[i] == 0) continue;
      box.extend(points[i]);
      num_points += 1.0;
    }
    if (num_points > 0.0) size = box.sizes();
  }
  // Of an ellipse in the box, about.
  double Perimeter() const { return kRightAngle * size.sum(); }
};

}  // namespace

bool CameraSigma::BendsWithFocal(const Camera& camera) const {
  return camera.model == CameraModel::kFisheye ||
         (camera.distortion != Camera().distortion && !IsLensOpen());
}

Status CameraSigma::Validate() const {
  if (doubtful_log_focal > 0.0 && !(log_focal > 0.0))
    return Status::Invalid("camera.doubtful_log_focal takes a camera.log_focal that is positive");
  return NonNegative({{"camera.log_focal", log_focal},
                      {"camera.log_aspect", log_aspect},
                      {"camera.principal_point_px", principal_point_px},
                      {"camera.k1", k1},
                      {"camera.doubtful_log_focal", doubtful_log_focal}});
}

NoiseModel NoiseModel::Exact() {
  NoiseModel m;
  m.contour_px = m.line_px = m.contour_offset_px = 0.0;
  m.circle_tilt_rad = m.circle_height = m.circle_shape = 0.0;
  m.line_direction_rad = m.pencil_axis_rad = m.grid_line = 0.0;
  m.radius = m.length = 0.0;
  m.camera = CameraSigma::Exact();
  return m;
}

Status NoiseModel::Validate() const {
  if (!(correlation_px > 0.0) || !std::isfinite(correlation_px))
    return Status::Invalid("correlation_px must be positive");
  const Status status = NonNegative({{"contour_px", contour_px},
                                     {"line_px", line_px},
                                     {"contour_offset_px", contour_offset_px},
                                     {"circle_tilt_rad", circle_tilt_rad},
                                     {"circle_height", circle_height},
                                     {"circle_shape", circle_shape},
                                     {"line_direction_rad", line_direction_rad},
                                     {"pencil_axis_rad", pencil_axis_rad},
                                     {"grid_line", grid_line},
                                     {"radius", radius},
                                     {"length", length},
                                     {"spread", spread}});
  return status.ok() ? camera.Validate() : status;
}

CameraSigma NoiseModel::SigmaOf(const Camera& taken_by) const {
  constexpr double kOfAnalogueVideo = 0.02;
  CameraSigma sigma = camera;
  if (sigma.log_aspect > 0.0) {
    const double found = std::abs(std::log(taken_by.fy / taken_by.fx));
    sigma.log_aspect = std::max(sigma.log_aspect, std::min(found, kOfAnalogueVideo));
  }
  return sigma;
}

double NoiseModel::Weight(double shared_px, double sigma_px, double num_points,
                          double length_px) const {
  const double independent =
      std::min(std::max(1.0, length_px / correlation_px), std::max(1.0, num_points));
  const double variance = sigma_px * sigma_px;
  const double shared = num_points / independent * shared_px * shared_px;
  return variance > 0.0 ? variance / (variance + shared) : 0.0;
}

double NoiseModel::Freedom(double shared_px, double rms_px, double num_points,
                           double length_px) const {
  const double independent =
      std::min(std::max(1.0, length_px / correlation_px), std::max(1.0, num_points));
  const double total = rms_px * rms_px, shared = std::min(shared_px * shared_px, total),
               own = total - shared;
  const double variance =
      (own * own + 2.0 * own * shared) / num_points + shared * shared / independent;
  return variance > 0.0 ? total * total / variance : num_points;
}

double NoiseModel::ContourFreedom(double rms_px, const std::vector<Eigen::Vector2d>& points,
                                  const std::vector<std::uint8_t>& inliers) const {
  const Extent extent(points, inliers);
  return Freedom(contour_px, rms_px, extent.num_points, extent.Perimeter());
}

double NoiseModel::LineFreedom(double rms_px, const std::vector<Eigen::Vector2d>& points,
                               const std::vector<std::uint8_t>& inliers) const {
  const Extent extent(points, inliers);
  return Freedom(line_px, rms_px, extent.num_points, extent.size.norm());
}

double NoiseModel::ContourWeight(double sigma_px, const std::vector<Eigen::Vector2d>& points,
                                 const std::vector<std::uint8_t>& inliers) const {
  if (contour_px == 0.0) return 1.0;
  const Extent extent(points, inliers);
  return Weight(contour_px, sigma_px, extent.num_points, extent.Perimeter());
}

double NoiseModel::LineWeight(double sigma_px, const std::vector<Eigen::Vector2d>& points,
                              const std::vector<std::uint8_t>& inliers) const {
  if (line_px == 0.0) return 1.0;
  const Extent extent(points, inliers);
  return Weight(line_px, sigma_px, extent.num_points, extent.size.norm());
}

}  // namespace circline
