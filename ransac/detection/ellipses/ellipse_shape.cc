#include "circline/ransac/detection/ellipses/ellipse_shape.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "circline/estimators/conic.h"
#include "circline/estimators/statistics.h"

namespace circline {
namespace {

using Eigen::Matrix3d;

// Share of random contour samples that find an edge point in place and direction by accident, in a
// busy photo: edge points on a tenth of the pixels, 3 of them looked at, 50 of 360 degrees.
constexpr double kChance = 0.08;
// Neighbouring edge points are not independent: one in this many pixels is.
constexpr double kIndependentPx = 3.0;
// Candidates that are tried, as the number of tests of the false-alarm count.
constexpr double kLog10Tests = 6.0;
// Blobs and rounded rectangles resemble ellipses; what tells them apart is how closely edge points
// keep to the contour, how nearly they run parallel to it, and how nearly their gradients are
// across it. Each is measured in units of what a true rim shows at most: its own imperfection, and
// in quadrature what the noise explains. Their sum may not exceed kShapeLimit.
//
// Root-mean-square distance, pixels. Prints, lenses and JPEG leave 0.05 to 0.15 px on photographed
// rims, at most 2 % of the radius on small ones, while a blob's shape is off in proportion to its
// size; long rims follow an ellipse less exactly (no blob follows one so far); and a short arc has
// less to keep to than a full contour.
constexpr double kShapeRmsPx = 0.17;
constexpr double kShapeRmsPerSize = 0.022;
constexpr double kShapeRmsPerPx = 5e-4;
constexpr double kShapeRmsPerCoverage = 0.8;
constexpr double kShapeUsualCoverage = 0.7;
// Median angle between the contour and the chord from the kSlopeReach-th point before to that
// behind on the chain, degrees: photographed rims leave 0.5 to 2.5.
constexpr int kSlopeReach = 2;
constexpr double kMaxChordPx = 3.0 * kSlopeReach;
constexpr double kShapeSlopeDeg = 1.8;
constexpr double kShapeSlopePerNoise = 0.5;
constexpr double kShapeSlopePerPx = 4e-3;
// Median angle between gradient and normal, degrees: mostly 0.5 to 3, but where the brightness
// changes along a rim, as in a penumbra, gradients lean by that change over their own length.
constexpr double kShapeNormalDeg = 6.0;
constexpr double kShapeNormalPerNoise = 2.0;
constexpr double kShapeLimit = 2.5;
// Log-odds of a rim: regression on what is found in renderings (seeds 1-3, 401-403; 1567 rims and
// 110 others) where the shape's limit is 1.4. A factor of ten in false alarms counts for a tenth of
// what it would among unrelated points: edges come in chains.
constexpr double kLogOdds = 3.47;
constexpr double kLogOddsPerFalseAlarm = -0.24;
constexpr double kLogOddsPerDeviation = -5.55;

// Logarithm (base 10) of the upper tail of the binomial distribution by Hoeffding's bound in its
// Chernoff form: k of n successes or more at probability p.
double Log10BinomialTail(double n, double k, double p) {
  const double q = k / n;
  if (q <= p) return 0.0;
  if (q >= 1.0) return n * std::log10(p);
  return -n * (q * std::log10(q / p) + (1.0 - q) * std::log10((1.0 - q) / (1.0 - p)));
}

}  // namespace

double Log10FalseAlarms(const Support& support, BrightSide bright) {
  const double n = support.perimeter_px / kIndependentPx;
  const double chance = bright == BrightSide::kEither ? 2.0 * kChance : kChance;
  return kLog10Tests + Log10BinomialTail(n, n * support.Coverage(), chance);
}

// (A chain's points follow each other in the map; where one ends, the next is elsewhere.)
double SlopeDeg(const EdgeMap& map, const Matrix3d& conic, const std::vector<int>& points,
                CalibratedEdges* calibrated) {
  const int n = static_cast<int>(map.points.size());
  const auto pixel = [&map](int i) { return map.points[static_cast<std::size_t>(i)].Position(); };
  std::vector<double> slopes;
  slopes.reserve(points.size());
  for (const int i : points) {
    if (i < kSlopeReach || i + kSlopeReach >= n) continue;
    CalibratedPoint a, b;
    if (!calibrated->Get(i - kSlopeReach, &a) || !calibrated->Get(i + kSlopeReach, &b)) continue;
    const double chord = (pixel(i + kSlopeReach) - pixel(i - kSlopeReach)).norm();
    if (chord > kMaxChordPx || !(chord > 0.0)) continue;
    slopes.push_back(std::abs(ConicDistancePx(b, conic) - ConicDistancePx(a, conic)) / chord);
  }
  return ToDegrees(Median(std::move(slopes)));
}

double ShapeDeviation(const Support& support, double rms_px, double slope_deg, double size_px,
                      double noise) {
  const double coverage = std::min(support.Coverage(), support.turn / (2.0 * kPi));
  const double rms_unit = std::hypot(std::min(kShapeRmsPx, kShapeRmsPerSize * size_px) +
                                         kShapeRmsPerPx * support.length_px,
                                     support.sigma_px) *
                          (1.0 + kShapeRmsPerCoverage * (coverage - kShapeUsualCoverage));
  const double noise_deg = ToDegrees(noise / std::max(support.gradient, 1e-9));
  const double slope_unit = std::hypot(kShapeSlopeDeg + kShapeSlopePerPx * support.length_px,
                                       kShapeSlopePerNoise * noise_deg);
  const double normal_unit = std::hypot(kShapeNormalDeg, kShapeNormalPerNoise * noise_deg);
  const double sum =
      rms_px / rms_unit + slope_deg / slope_unit + ToDegrees(support.normal_median) / normal_unit;
  return sum / kShapeLimit;
}

double RimLogOdds(double log10_false_alarms, double deviation) {
  return kLogOdds + kLogOddsPerFalseAlarm * log10_false_alarms + kLogOddsPerDeviation * deviation;
}

}  // namespace circline
