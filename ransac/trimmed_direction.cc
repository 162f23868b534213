#include "circline/ransac/trimmed_direction.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "circline/ransac/pencil_model.h"

namespace circline {

Status FitTrimmedDirection(const std::vector<LineFit>& lines, std::size_t num_kept,
                           VanishingPointFit* fit) {
  const std::size_t n = lines.size();
  if (num_kept < 2 || n < num_kept) return Status::Refused("too few lines for a direction");
  std::vector<std::pair<double, std::size_t>> squares(n);
  // Sum of the smallest squares; brings those to the front.
  const auto trimmed_sum = [&](const Eigen::Vector3d& direction) {
    for (std::size_t i = 0; i < n; ++i) {
      const double r = VanishingPointResidual(lines[i], direction);
      squares[i] = {r * r, i};
    }
    const auto end = squares.begin() + static_cast<std::ptrdiff_t>(num_kept);
    std::nth_element(squares.begin(), end - 1, squares.end());
    double sum = 0.0;
    for (auto s = squares.begin(); s != end; ++s) sum += s->first;
    return sum;
  };
  constexpr std::size_t kMostPairs = 200;
  const std::size_t num_pairs = n * (n - 1) / 2, stride = num_pairs / kMostPairs + 1;
  double best = std::numeric_limits<double>::infinity();
  std::size_t i = 0, first = 0;  // The number of the first pair of line i with a later one.
  for (std::size_t pair = 0; pair < num_pairs; pair += stride) {
    for (; pair - first >= n - 1 - i; ++i) first += n - 1 - i;
    const std::size_t j = i + 1 + pair - first;
    const Eigen::Vector3d crossing = lines[i].line.cross(lines[j].line);
    if (!(crossing.norm() > kCoincidentRad)) continue;
    const double sum = trimmed_sum(crossing.normalized());
    if (!(sum < best)) continue;
    best = sum;
    fit->direction = crossing.normalized();
  }
  if (!std::isfinite(best)) return Status::Refused("the lines of the pencil coincide");
  constexpr int kSteps = 2;
  for (int step = 0; step <= kSteps; ++step) {
    trimmed_sum(fit->direction);
    std::vector<LineFit> chosen;
    for (std::size_t k = 0; k < num_kept; ++k) chosen.push_back(lines[squares[k].second]);
    const Status status = FitVanishingPoint(chosen, fit);
    if (!status.ok()) return status;
  }
  return Status::Ok();
}

}  // namespace circline
