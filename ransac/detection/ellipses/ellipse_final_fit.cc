// The last fit of an ellipse, and the second look at what is too ragged for one.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/conic_fit.h"
#include "circline/estimators/statistics.h"
#include "circline/ransac/detection/ellipses/ellipse_fitter.h"
#include "circline/ransac/detection/ellipses/ellipse_shape.h"

namespace circline {
namespace {

// What a second look needs of the contour.
constexpr double kSecondCoverage = 0.7;
// The second look at a ragged contour: smoothing, and the largest part of the photo, pixels.
constexpr double kSecondSmoothingPx = 1.6;
constexpr int kMaxSecondLookPx = 200;
// Points beyond this many standard deviations take no part in the final fit.
constexpr double kOutlierSigmas = 3.5;
// Times that points which stand out are left out of the fit to start from.
constexpr int kMaxTrims = 10;
// What edge points of a photographed rim leave at most but for their noise, pixels. Where they
// scatter by more, a contour is fitted anew to so many stretches of it, each with this share of its
// points: one keeps clear of what hides up to 0.4 of a rim.
constexpr double kRimSigmaPx = 0.1;
constexpr std::size_t kStretches = 8;
constexpr double kStretchShare = 0.6;
constexpr int kStretchTrims = 1;
// As many points as this, at least half as many, tell which fit is the best.
constexpr std::size_t kStretchPoints = 120;
// However much of it there is, a contour whose shape deviates by more is a blob's.
constexpr double kMostDeviation = 1.4;
// Radius of the sharper ends, pixels: edges cannot tell such an end from a corner. Labelled and
// rendered rims have 0.45 and more; what stripes, blades and shadows passed for, in rendered and
// Debian's photographs, 0.02 to 0.37.
constexpr double kMinTipPx = 0.4;
// No contour is known better than this, whatever its scatter says.
constexpr double kMinEllipseSigmaPx = 0.05;

using Eigen::Matrix3d;
using Eigen::Vector2d;

Vector2d FromPixels(const CalibratedPoint& p, const Vector2d& shift) {
  return {p.x_from_pixel[0] * shift.x() + p.x_from_pixel[1] * shift.y(),
          p.x_from_pixel[2] * shift.x() + p.x_from_pixel[3] * shift.y()};
}

// Curvature, 1 / pixels of the photo, of the level line of a conic through a point, and the unit
// normal that points outward: t^T H t / |g| with gradient g, Hessian H, unit tangent t.
double CurvatureAt(const Matrix3d& conic, const CalibratedPoint& p, Vector2d* outward) {
  const Vector2d g = p.GradientPerPixel((conic * p.Homogeneous()).head<2>());
  const double length = g.norm();
  if (!(length > 0.0)) {
    outward->setZero();
    return 0.0;
  }
  *outward = g / length;
  const Vector2d along = FromPixels(p, Vector2d(-outward->y(), outward->x()));
  return along.dot(conic.topLeftCorner<2, 2>() * along) / length;
}

}  // namespace

bool EllipseFitter::Fit(EllipseCandidate candidate, DetectedEllipse* e) {
  EllipseCandidate smooth = candidate;
  if (!(FinalFit(&candidate, e) > 0.0) && !SecondLook(&smooth, e)) return false;
  e->bright = candidate.bright;
  return true;
}

// What surrounds a contour but is too ragged for an ellipse at the first scale - a penumbra, a
// blur by motion, the steps of a bad print - is looked at once more, through a wider Gaussian,
// which averages over it.
bool EllipseFitter::SecondLook(EllipseCandidate* candidate, DetectedEllipse* e) {
  if (!Gather(*candidate, 1.5, kGatherPx.back()) || support_.Coverage() < kSecondCoverage) {
    return false;
  }
  const cv::Rect box = Surroundings();
  if (box.empty() || box.width > kMaxSecondLookPx || box.height > kMaxSecondLookPx) return false;
  const EdgeMap map = DetectEdges(map_.gray(box), kSecondSmoothingPx);
  Camera camera = camera_;  // Seen from the corner of the box; fits stay valid.
  camera.cx -= box.x;
  camera.cy -= box.y;
  if (EllipseFitter(map, camera, options_).FinalFit(candidate, e) <= 0.0) return false;
  for (Vector2d& p : e->contour) p += Vector2d(box.x, box.y);
  // The points of the first scale that it explains.
  if (!Gather(*candidate, 0.7, kGatherPx[0])) return false;
  e->points = support_.points;
  return true;
}

// The samples at hand with a margin for the smoothing, within the photo.
cv::Rect EllipseFitter::Surroundings() const {
  Eigen::AlignedBox2d box;
  for (const ContourSample& s : samples_) box.extend(s.pixel);
  constexpr int kMargin = 8;
  const cv::Point low(static_cast<int>(box.min().x()), static_cast<int>(box.min().y()));
  const cv::Point high(static_cast<int>(box.max().x()), static_cast<int>(box.max().y()));
  const cv::Point margin(kMargin, kMargin);
  return cv::Rect(low - margin, high + margin) & cv::Rect({}, map_.gray.size());
}

// Maximum likelihood on all points of the contour, outliers left out; from a direct fit to all
// points, which brings the contour near enough for the nearest points to be its own. Returns the
// log-odds of a rim; minus infinity where there is no ellipse at all.
double EllipseFitter::FinalFit(EllipseCandidate* candidate, DetectedEllipse* e) {
  constexpr double kNone = -std::numeric_limits<double>::infinity();
  if (!GatherUnbiased(*candidate, kGatherPx.back(), e) || !FitLikeliest(&candidate->conic))
    return kNone;
  const double reach = std::clamp(6.0 * Rms(trimmed_, candidate->conic), 0.8, kGatherPx.back());
  // What is gathered about a fit to all that is as near depends less on where the first started.
  if (!GatherUnbiased(*candidate, reach, e) || !FitTrimmed(fit_points_, 1, &candidate->conic))
    return kNone;
  if (!GatherUnbiased(*candidate, reach, e) || !FitUnbiased(candidate->conic, e)) return kNone;
  candidate->conic = e->fit.conic;
  const double minor_px = contour_.minor_px(), tip_px = minor_px * minor_px / contour_.major_px();
  if (!Plausible(candidate->bright) || minor_px < options_.min_axis_px ||
      e->fit.rms_px > kMaxRmsPx || tip_px < kMinTipPx) {
    return kNone;
  }
  e->coverage_deg = 360.0 * support_.Coverage();
  e->length_px = support_.length_px;
  const double deviation = MeasureShape(e->fit.rms_px, candidate->conic, e->points);
  if (deviation > kMostDeviation) return kNone;
  return RimLogOdds(Log10FalseAlarms(support_, candidate->bright), deviation);
}

// Direct fits to the points at hand and, where these scatter, to stretches of them, each with what
// else agrees: what hides a part of a rim often runs beside it, and a fit to all lies between the
// two. The one that the points are likeliest for, each of the rim or anywhere within reach.
bool EllipseFitter::FitLikeliest(Matrix3d* conic) {
  if (!FitTrimmed(fit_points_, kMaxTrims, conic)) return false;
  const double sigma_px = std::hypot(kRimSigmaPx, support_.sigma_px);
  if (Rms(fit_points_, *conic) < sigma_px) return true;
  const std::size_t step = 1 + fit_points_.size() / kStretchPoints;
  const std::size_t n = fit_points_.size() / step;
  for (std::size_t i = 0; i < n; ++i) fit_points_[i] = fit_points_[i * step];
  fit_points_.resize(n);
  double least = TruncatedCost(*conic, sigma_px);
  stretch_.resize(static_cast<std::size_t>(kStretchShare * static_cast<double>(n)));
  for (std::size_t k = 0; k < kStretches; ++k) {
    for (std::size_t i = 0; i < stretch_.size(); ++i)
      stretch_[i] = fit_points_[(i + n * k / kStretches) % n];
    Matrix3d other;
    if (!FitTrimmed(stretch_, kStretchTrims, &other)) continue;
    const double cost = TruncatedCost(other, sigma_px);
    if (!(cost < least)) continue;
    least = cost;
    *conic = other;
  }
  Trim(*conic);
  return true;
}

// Twice the logarithm of the likelihood ratio, negative, of the points at hand to points anywhere
// within reach; to the larger of both for each point (Torr and Zisserman, CVIU 2000).
double EllipseFitter::TruncatedCost(const Matrix3d& conic, double sigma_px) {
  MeasureDistances(conic);
  const double anywhere =
      2.0 * std::log(2.0 * kGatherPx.back() / (std::sqrt(2.0 * kPi) * sigma_px));
  double sum = 0.0;
  for (const double d : distances_) sum += std::min(d * d / (sigma_px * sigma_px), anywhere);
  return sum;
}

// The edge points along the candidate where they would lie if it were straight; false where they
// are too few.
bool EllipseFitter::GatherUnbiased(const EllipseCandidate& candidate, double reach,
                                   DetectedEllipse* e) {
  if (!Gather(candidate, 0.7, reach)) return false;
  e->points.clear();
  e->contour.clear();
  fit_points_.clear();
  std::vector<double> blurs;
  for (const int i : support_.points) {
    blurs.push_back(static_cast<double>(map_.points[static_cast<std::size_t>(i)].blur_px));
  }
  const double blur = Median(std::move(blurs));
  for (const int i : support_.points) {
    CalibratedPoint moved;
    if (!calibrated_.Get(i, &moved)) continue;
    const EdgePoint& edge = map_.points[static_cast<std::size_t>(i)];
    Vector2d outward;
    const double curvature = CurvatureAt(candidate.conic, moved, &outward);
    const Vector2d shift = CurvatureBias(edge, blur, curvature) * outward;
    moved.x += FromPixels(moved, shift);
    e->points.push_back(i);
    e->contour.push_back(edge.Position() + shift);
    fit_points_.push_back(moved);
  }
  return fit_points_.size() >= 6;
}

bool EllipseFitter::FitUnbiased(const Matrix3d& initial, DetectedEllipse* e) {
  if (!RefineConic(fit_points_, 1.0, initial, &e->fit).ok()) return false;
  if (DropOutliers(e) &&
      (fit_points_.size() < 6 || !RefineConic(fit_points_, 1.0, e->fit.conic, &e->fit).ok())) {
    return false;
  }
  // Degrees of freedom: five go into the ellipse.
  const double n = static_cast<double>(fit_points_.size());
  e->sigma_px = std::max(kMinEllipseSigmaPx, e->fit.rms_px * std::sqrt(n / (n - 5.0)));
  e->fit.ScaleCovariance(e->sigma_px * e->sigma_px);
  return true;
}

// False if there are none.
bool EllipseFitter::DropOutliers(DetectedEllipse* e) {
  const double limit = kOutlierSigmas * std::max(kMinEllipseSigmaPx, RobustSigma(e->fit.conic));
  std::size_t kept = 0;
  for (std::size_t k = 0; k < distances_.size(); ++k) {
    if (std::abs(distances_[k]) > limit) continue;
    fit_points_[kept] = fit_points_[k];
    e->contour[kept] = e->contour[k];
    e->points[kept++] = e->points[k];
  }
  if (kept == fit_points_.size()) return false;
  fit_points_.resize(kept);
  e->contour.resize(kept);
  e->points.resize(kept);
  return true;
}

}  // namespace circline
