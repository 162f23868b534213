#include "circline/ransac/robust_conic.h"

#include <cmath>
#include <optional>
#include <utility>

#include "circline/ransac/conic_search.h"

namespace circline {
namespace {

Status Check(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
             const ConicLimits& limits, const EdgeDirections* directions) {
  Status status = options.Validate();
  if (status.ok()) status = limits.Validate();
  if (status.ok() && directions != nullptr) status = directions->Validate(points.size());
  return status;
}

}  // namespace

Status FitConicRobust(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
                      ConicFit* fit, std::vector<std::uint8_t>* mask, const ConicLimits& limits,
                      const EdgeDirections* directions) {
  Status status = Check(points, options, limits, directions);
  if (!status.ok()) return status;
  if (points.size() < 5) return Status::Refused("an ellipse needs five points");
  const ConicSearch search(points, directions, options, limits);
  ConicFit result;
  std::vector<std::uint8_t> result_mask;
  status = NoEllipse();
  for (const ConicCandidate& candidate : search.Run()) {
    status = search.Finish(candidate, &result, &result_mask);
    if (status.ok()) break;
  }
  if (!status.ok()) return status;
  *fit = result;
  if (mask != nullptr) *mask = std::move(result_mask);
  return Status::Ok();
}

Status RefitConicRobust(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
                        const Eigen::Matrix3d& initial, ConicFit* fit,
                        std::vector<std::uint8_t>* mask, const ConicLimits& limits,
                        const EdgeDirections* directions) {
  Status status = Check(points, options, limits, directions);
  if (!status.ok()) return status;
  if (points.size() < 5) return Status::Refused("an ellipse needs five points");
  const ConicSearch search(points, directions, options, limits);
  ConicModel::Value value;
  if (!search.model().FromConic(initial, &value)) return NoEllipse();
  ConicFit result;
  std::vector<std::uint8_t> result_mask;
  status = search.Finish(search.Polished(value), &result, &result_mask);
  if (!status.ok()) return status;
  *fit = result;
  if (mask != nullptr) *mask = std::move(result_mask);
  return Status::Ok();
}

Status FitSecondConic(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
                      const Eigen::Matrix3d& first, ConicFit* fit, std::vector<std::uint8_t>* mask,
                      const ConicLimits& limits, const EdgeDirections* directions) {
  const Status status = Check(points, options, limits, directions);
  if (!status.ok()) return status;
  std::vector<int> left;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double distance = std::abs(ConicDistancePx(points[i], first));
    if (!(distance <= 2.0 * options.ransac.threshold)) left.push_back(static_cast<int>(i));
  }
  if (left.size() <= 5) return NoEllipse();
  const ContourSubset rest = SelectPoints(points, directions, left);
  const ConicSearch search(rest.points, rest.Directions(), options, limits);
  const std::optional<ConicCandidate> candidate = search.RunShort();
  if (!candidate) return NoEllipse();
  ConicFit result;
  std::vector<std::uint8_t> rest_mask;
  const Status finished = search.Finish(*candidate, &result, &rest_mask);
  if (!finished.ok()) return finished;
  *fit = result;
  if (mask == nullptr) return finished;
  mask->assign(points.size(), 0);
  for (std::size_t i = 0; i < left.size(); ++i)
    (*mask)[static_cast<std::size_t>(left[i])] = rest_mask[i];
  return finished;
}

}  // namespace circline
