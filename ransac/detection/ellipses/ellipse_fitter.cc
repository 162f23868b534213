#include "circline/ransac/detection/ellipses/ellipse_fitter.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "circline/estimators/conic.h"
#include "circline/estimators/conic_fit.h"
#include "circline/estimators/statistics.h"
#include "circline/ransac/detection/ellipses/ellipse_shape.h"

namespace circline {
namespace {

// Points that a candidate is fitted to, of each arc.
constexpr int kFitPoints = 24;
// An arc fits its candidate when the root-mean-square distance stays below this, pixels.
constexpr double kMaxArcRmsPx = 1.0;
// ... and on this share of its points the gradient is within 15 degrees, plus two standard
// deviations of its noise, of the contour's normal. (A sine.)
constexpr double kArcNormalSine = 0.26;
constexpr double kArcNormalSigmas = 2.0;
constexpr double kArcAgreement = 0.85;
// Points farther off than this many standard deviations (at least so many pixels each) are left out
// of a candidate's refit.
constexpr double kTrimSigmas = 2.5;
constexpr double kTrimMinSigmaPx = 0.1;
// A first look at this many samples drops candidates with less than this share of support.
constexpr int kQuickSamples = 24;
constexpr double kQuickPx = 2.0;
constexpr double kQuickShare = 0.25;
// Samples of a contour, at most, while a candidate is being improved.
constexpr int kRoughSamples = 120;
// While a candidate is still being refined, it may miss the limits by this factor.
constexpr double kShapeSlack = 1.5;
// Largest ellipse, in diagonals of the photo.
constexpr double kMaxAxisDiagonals = 2.0;
// How many times smaller than chance allows the support may be: log10 of the number of ellipses as
// well supported that are expected in unrelated edges (Desolneux, Moisan, Morel, IJCV 2000).
constexpr double kMaxLog10FalseAlarms = -1.0;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

BrightSide SideOf(std::initializer_list<const Arc*> arcs) {
  const bool inside = (*arcs.begin())->bright_inside;
  for (const Arc* arc : arcs) {
    if (arc->bright_inside != inside) return BrightSide::kEither;
  }
  return inside ? BrightSide::kInside : BrightSide::kOutside;
}

}  // namespace

EllipseFitter::EllipseFitter(const EdgeMap& map, const Camera& camera,
                             const EllipseOptions& options)
    : map_(map),
      camera_(camera),
      options_(options),
      calibrated_(map, camera),
      contour_(camera),
      collector_(map),
      max_axis_px_(kMaxAxisDiagonals * std::hypot(map.width, map.height)) {}

bool EllipseFitter::FitArcs(std::initializer_list<const Arc*> arcs, EllipseCandidate* candidate) {
  fit_points_.clear();
  fit_indices_.clear();
  for (const Arc* arc : arcs) AppendPoints(*arc);
  candidate->bright = SideOf(arcs);
  if (!FitConicDirect(fit_points_, &candidate->conic).ok()) return false;
  return ArcsAgree(*candidate);
}

bool EllipseFitter::FindAlong(const Matrix3d& conic, EllipseCandidate* candidate) {
  if (!contour_.Project(conic, 0.5 * options_.min_axis_px, max_axis_px_)) return false;
  if (!contour_.SampleCount(kQuickSamples, &samples_)) return false;
  const double inside = collector_.QuickLook(samples_, BrightSide::kInside, kQuickPx);
  const double outside = collector_.QuickLook(samples_, BrightSide::kOutside, kQuickPx);
  candidate->conic = conic;
  candidate->bright = inside > outside ? BrightSide::kInside : BrightSide::kOutside;
  return std::max(inside, outside) >= kQuickShare && Refit(candidate);
}

bool EllipseFitter::Improve(EllipseCandidate* candidate) {
  if (!contour_.Project(candidate->conic, 0.5 * options_.min_axis_px, max_axis_px_)) return false;
  if (!contour_.SampleCount(kQuickSamples, &samples_)) return false;
  return collector_.QuickLook(samples_, candidate->bright, kQuickPx) >= kQuickShare &&
         Refit(candidate);
}

bool EllipseFitter::IsSupported(const EllipseCandidate& candidate) {
  return Gather(candidate, 1.5, kGatherPx.back()) && Plausible(candidate.bright);
}

bool EllipseFitter::LiesOn(const DetectedEllipse& e, const Matrix3d& conic, double reach_px) {
  for (std::size_t k = 0; k < e.points.size(); k += 1 + e.points.size() / 16) {
    CalibratedPoint p;
    if (!calibrated_.Get(e.points[k], &p)) continue;
    if (std::abs(ConicDistancePx(p, conic)) >= reach_px) return false;
  }
  return true;
}

void EllipseFitter::AppendPoints(const Arc& arc) {
  const int n = std::min(arc.size(), kFitPoints);
  for (int k = 0; k < n; ++k) {
    const int i = arc.begin +
                  static_cast<int>((static_cast<long>(k) * (arc.size() - 1)) / std::max(n - 1, 1));
    CalibratedPoint p;
    if (!calibrated_.Get(i, &p)) continue;
    fit_points_.push_back(p);
    fit_indices_.push_back(i);
  }
}

// Direct fit to `start`, and then to the points at hand without those that stand out, until these
// stay the same: the ends of an arc often follow a neighbour's edge, a shadow runs beside a rim,
// and a few such points spoil a least-squares fit.
bool EllipseFitter::FitTrimmed(const std::vector<CalibratedPoint>& start, int max_trims,
                               Matrix3d* conic) {
  if (!FitConicDirect(start, conic).ok()) return false;
  std::size_t before = fit_points_.size();
  for (int round = 0; round < max_trims; ++round) {
    Trim(*conic);
    if (trimmed_.size() == before || trimmed_.size() < 6) break;
    before = trimmed_.size();
    Matrix3d better;
    if (!FitConicDirect(trimmed_, &better).ok()) break;
    *conic = better;
  }
  return true;
}

void EllipseFitter::Trim(const Matrix3d& conic) {
  const double limit = kTrimSigmas * std::max(kTrimMinSigmaPx, RobustSigma(conic));
  trimmed_.clear();
  for (std::size_t k = 0; k < fit_points_.size(); ++k) {
    if (std::abs(distances_[k]) <= limit) trimmed_.push_back(fit_points_[k]);
  }
}

// Signed, of the points at hand, pixels.
void EllipseFitter::MeasureDistances(const Matrix3d& conic) {
  distances_.clear();
  for (const CalibratedPoint& p : fit_points_) distances_.push_back(ConicDistancePx(p, conic));
}

// Of the distances, the median of which it measures.
double EllipseFitter::RobustSigma(const Matrix3d& conic) {
  MeasureDistances(conic);
  std::vector<double> sizes;
  for (const double d : distances_) sizes.push_back(std::abs(d));
  // Median absolute deviation to standard deviation of a Gaussian.
  return 1.4826 * Median(std::move(sizes));
}

// Whether the points of the arcs are near the contour that was fitted to them, and the gradients
// there across it: a second opinion that costs little and is independent of the first. All in
// squares, without roots: nothing is asked more often.
bool EllipseFitter::ArcsAgree(const EllipseCandidate& candidate) const {
  const double side = candidate.bright == BrightSide::kInside ? -1.0 : 1.0;
  const bool either = candidate.bright == BrightSide::kEither;
  const double noise = kArcNormalSigmas * map_.gradient_noise;
  const Matrix3d& conic = candidate.conic;
  double squares = 0.0;
  int agree = 0;
  for (std::size_t k = 0; k < fit_points_.size(); ++k) {
    const CalibratedPoint& p = fit_points_[k];
    const Vector3d g = conic * p.Homogeneous();
    const Vector2d outward = p.GradientPerPixel(g.head<2>());
    const double length_squared = outward.squaredNorm();
    const double value = p.x.dot(g.head<2>()) + g.z();
    squares += value * value / (4.0 * length_squared);
    const EdgePoint& edge = map_.points[static_cast<std::size_t>(fit_indices_[k])];
    const double along = outward.dot(edge.Normal());
    const double strength = static_cast<double>(edge.gradient) * static_cast<double>(edge.gradient);
    // sin^2 < kArcNormalSine^2 + (noise / gradient)^2, times both denominators.
    const bool across =
        (length_squared - along * along) * strength <
        (kArcNormalSine * kArcNormalSine * strength + noise * noise) * length_squared;
    agree += across && (either || side * along >= 0.0) ? 1 : 0;
  }
  const double n = static_cast<double>(fit_points_.size());
  return squares <= kMaxArcRmsPx * kMaxArcRmsPx * n && agree >= kArcAgreement * n;
}

double EllipseFitter::Rms(const std::vector<CalibratedPoint>& points, const Matrix3d& conic) {
  double sum = 0.0;
  for (const CalibratedPoint& p : points) {
    const double d = ConicDistancePx(p, conic);
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(points.size(), 1)));
}

// Refits a candidate to the points along its contour; false if there are too few.
bool EllipseFitter::Refit(EllipseCandidate* candidate) {
  for (std::size_t round = 0; round + 1 < kGatherPx.size(); ++round) {
    if (!Gather(*candidate, 1.5, kGatherPx[round], kRoughSamples)) return false;
    CalibrateSupport(kRoughSamples);
    if (!FitTrimmed(fit_points_, 1, &candidate->conic)) return false;
  }
  if (!Gather(*candidate, 1.5, kGatherPx.back(), 2 * kRoughSamples)) return false;
  if (!Plausible(candidate->bright)) return false;
  CalibrateSupport(kRoughSamples);
  Trim(candidate->conic);
  const double rms_px = Rms(trimmed_, candidate->conic);
  const double deviation = MeasureShape(rms_px, candidate->conic, fit_indices_);
  candidate->score = RimLogOdds(Log10FalseAlarms(support_, candidate->bright), deviation);
  return rms_px <= kShapeSlack * kMaxRmsPx && deviation <= kShapeSlack;
}

// The ShapeDeviation of a contour; `points` are edge points near it.
double EllipseFitter::MeasureShape(double rms_px, const Matrix3d& conic,
                                   const std::vector<int>& points) {
  return ShapeDeviation(support_, rms_px, SlopeDeg(map_, conic, points, &calibrated_),
                        std::sqrt(contour_.major_px() * contour_.minor_px()), map_.gradient_noise);
}

bool EllipseFitter::Gather(const EllipseCandidate& candidate, double spacing, double reach,
                           int max_samples) {
  if (!contour_.Project(candidate.conic, 0.7 * options_.min_axis_px, max_axis_px_)) return false;
  if (!contour_.SampleEvery(spacing, &samples_, max_samples)) return false;
  collector_.Collect(samples_, candidate.bright, reach, &support_);
  return support_.points.size() >= 6;
}

// The calibrated support, or about `limit` points of it, evenly.
void EllipseFitter::CalibrateSupport(std::size_t limit) {
  fit_points_.clear();
  fit_indices_.clear();
  const std::size_t n = support_.points.size(), m = std::min(n, limit);
  for (std::size_t k = 0; k < m; ++k) {
    const int i = support_.points[k * n / m];
    CalibratedPoint p;
    if (!calibrated_.Get(i, &p)) continue;
    fit_points_.push_back(p);
    fit_indices_.push_back(i);
  }
}

// Enough of the contour, and more than chance explains.
bool EllipseFitter::Plausible(BrightSide bright) const {
  if (support_.Coverage() * 360.0 < options_.min_arc_deg) return false;
  if (ToDegrees(support_.turn) < options_.min_arc_deg) return false;
  return Log10FalseAlarms(support_, bright) <= kMaxLog10FalseAlarms;
}

}  // namespace circline
