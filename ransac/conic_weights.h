// What each point says for an ellipse, by the sectors around it, for the final fits of
// robust_conic.h. Internal: not installed.
#ifndef CIRCLINE_RANSAC_CONIC_WEIGHTS_H_
#define CIRCLINE_RANSAC_CONIC_WEIGHTS_H_

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "circline/ransac/conic_model.h"

namespace circline {

// Sectors of an ellipse: eccentric anomalies in steps of 10 degrees, in which the points around it
// are counted.
constexpr int kConicSectors = 36;

// The sector of a point: the affine map that takes the ellipse to a circle (the Cholesky factor of
// its quadratic part) makes its eccentric anomaly an angle.
class ConicSectors {
 public:
  explicit ConicSectors(const ConicModel::Value& value) {
    const auto [a, b, c, d, e, f] = value;
    const double minor = a * c - b * b;
    center_ = {(b * e - c * d) / minor, (b * d - a * e) / minor};
    l00_ = std::sqrt(a);
    l10_ = b / l00_;
    l11_ = std::sqrt(std::max(0.0, c - l10_ * l10_));
  }
  std::size_t operator()(const Eigen::Vector2d& x) const {
    const Eigen::Vector2d p = x - center_;
    const double turns = Turns(l11_ * p.y(), l00_ * p.x() + l10_ * p.y());
    return static_cast<std::size_t>(
        std::clamp(static_cast<int>(turns * kConicSectors), 0, kConicSectors - 1));
  }

 private:
  // Angle of (x, y) as a share of the full turn, to 0.0006 of one: a twentieth of std::atan2's
  // time.
  static double Turns(double y, double x) {
    const double ax = std::abs(x), ay = std::abs(y);
    const double z = std::min(ax, ay) / std::max(std::max(ax, ay), 1e-300);
    double turns = z * (0.125 + 0.0434 * (1.0 - z));  // atan(z) / 2 pi, z in [0, 1].
    if (ay > ax) turns = 0.25 - turns;
    if (x < 0.0) turns = 0.5 - turns;
    return y < 0.0 ? 1.0 - turns : turns;
  }

  Eigen::Vector2d center_;
  double l00_, l10_, l11_;
};

// Inlier weights as InlierWeights has them, but with the densities of curve and
// background measured sector by sector: where a contour has a gap, a stray point near the ellipse
// gets no say; it would bend the free part.
struct ConicWeights {
  std::vector<float> weights;               // By the model's order.
  double sigma = 0.0;                       // Of the noise, pixels: in (0 = not known) and out.
  std::vector<float> squared_distances;     // Workspace, as are those below.
  std::vector<double> direction_residuals;  // Squared, in standard deviations.
  std::vector<std::uint8_t> sectors;

  // Logarithm of the ratio of likelihoods: curve with background over background alone.
  double LogLikelihood() const;
};

// Share of stray points whose directions look right by chance: a stray one's is anything.
double DirectionChance(const ConicModel& model);

// Weights of the model's data for the ellipse `value`; `threshold` in pixels. Reads and updates
// result->sigma.
void WeighConic(const ConicModel& model, const ConicModel::Value& value, double threshold,
                ConicWeights* result);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_CONIC_WEIGHTS_H_
