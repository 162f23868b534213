#include "circline/ransac/robust_conic.h"

#include <cmath>
#include <cstddef>
#include <optional>

#include "circline/ransac/conic_search.h"

namespace circline {

Status FitConicRobust(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
                      ConicFit* fit, std::vector<std::uint8_t>* mask,
                      const EdgeDirections& directions) {
  Status status = CheckConicInput(points, options, directions);
  if (!status.ok()) return status;
  const ConicSearch search(points, directions, options);
  ConicFit found;
  std::vector<std::uint8_t> found_mask;
  status = search.Best(&found, &found_mask);
  if (!status.ok()) return status;
  const ConicSupport support = search.Support(found.conic);
  if (support.IsRefused()) return support.Refusal();
  *fit = found;
  if (mask != nullptr) mask->swap(found_mask);
  return status;
}

Status RefitConicRobust(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
                        const Eigen::Matrix3d& initial, ConicFit* fit,
                        std::vector<std::uint8_t>* mask, const EdgeDirections& directions) {
  return FindConic(points, options, &initial, fit, mask, directions);
}

Status FitSecondConic(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
                      const Eigen::Matrix3d& first, ConicFit* fit, std::vector<std::uint8_t>* mask,
                      const EdgeDirections& directions) {
  Status status = CheckConicInput(points, options, directions);
  if (!status.ok()) return status;
  const Status none = Status::Refused("no second ellipse explains the points");
  std::vector<int> left;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double distance = std::abs(ConicDistancePx(points[i], first));
    if (!(distance <= 2.0 * options.ransac.threshold)) left.push_back(static_cast<int>(i));
  }
  if (left.size() <= 5) return none;
  const ContourSubset rest(points, directions, left);
  const ConicSearch search(rest.points, rest.directions, options);
  const std::optional<ConicCandidate> candidate = search.RunShort();
  if (!candidate) return none;
  std::vector<std::uint8_t> rest_mask;
  status = search.Finish(*candidate, fit, &rest_mask);
  if (!status.ok() || mask == nullptr) return status;
  mask->assign(points.size(), 0);
  for (std::size_t i = 0; i < left.size(); ++i)
    (*mask)[static_cast<std::size_t>(left[i])] = rest_mask[i];
  return status;
}

}  // namespace circline
