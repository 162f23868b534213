#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "circline/ransac/detection/ellipses/contour_support.h"
#include "circline/ransac/detection/ellipses/ellipse_fitter.h"
#include "circline/ransac/detection/follow/follow_observations.h"
#include "circline/ransac/robust_conic.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;

// Of points of one contour about an ellipse that is only a start, pixels.
constexpr double kInlierPx = 1.0;
// Draws: with directions enough for a contour among four times as many strangers.
constexpr int kMaxDraws = 300;
// Points, at most, that the robust fit is asked of.
constexpr std::size_t kMaxBandPoints = 400;
// More of the known points than this on one side: that is the bright one.
constexpr double kOneSided = 0.8;

Vector2d Outward(const CalibratedPoint& p, const Matrix3d& conic) {
  return p.GradientPerPixel((conic * p.Homogeneous()).head<2>()).normalized();
}

BrightSide SideOf(const CircleObservation& circle, const Camera& camera) {
  double inside = 0.0, known = 0.0;
  const std::size_t n = std::min(circle.points.size(), circle.normals.size());
  for (std::size_t k = 0; k < n; k += 1 + n / 16) {
    CalibratedPoint p;
    if (circle.normals[k].isZero() || !PixelToCalibrated(camera, circle.points[k], &p)) continue;
    known += 1.0;
    inside += Outward(p, circle.fit->conic).dot(circle.normals[k]) < 0.0 ? 1.0 : 0.0;
  }
  if (known > 0.0 && inside >= kOneSided * known) return BrightSide::kInside;
  if (known > 0.0 && inside <= (1.0 - kOneSided) * known) return BrightSide::kOutside;
  return BrightSide::kEither;
}

class CircleFollower {
 public:
  CircleFollower(const EdgeMap& map, const Camera& camera, const EllipseOptions& options,
                 double search_px)
      : map_(map), camera_(camera), search_px_(search_px), fitter_(map, camera, options) {}

  // Where the circle is to within the reach of the cold detector's own refits, or `far`: anywhere
  // in the band, as the ellipse that most of its free edges support. Nothing where there is none.
  void Follow(const CircleObservation& circle, bool far, DetectedEllipse* e) {
    EllipseCandidate candidate{circle.fit->conic, SideOf(circle, camera_), 0.0};
    if (far && !FindInBand(&candidate)) return;
    DetectedEllipse found;
    if (!fitter_.Improve(&candidate) || !fitter_.Fit(candidate, &found)) return;
    if (!fitter_.LiesOn(found, circle.fit->conic, search_px_)) return;
    Ellipse before, now;
    if (!ConicToEllipse(circle.fit->conic, &before) || !ConicToEllipse(found.fit.conic, &now)) {
      return;
    }
    const double growth = now.a / before.a;
    if (!(growth < kMaxGrowth && growth > 1.0 / kMaxGrowth)) return;
    fitter_.Take(found);
    *e = std::move(found);
  }

 private:
  bool FindInBand(EllipseCandidate* candidate) {
    CollectBand(*candidate);
    RobustFitOptions options;
    options.ransac.threshold = kInlierPx;
    options.ransac.max_iterations = kMaxDraws;
    ConicFit fit;
    if (!FitConicRobust(band_, options, &fit, nullptr, directions_).ok()) return false;
    candidate->conic = fit.conic;
    return true;
  }

  // The free edges that run along the predicted contour, on the right side of the light.
  void CollectBand(const EllipseCandidate& predicted) {
    band_.clear();
    directions_.normals.clear();
    for (std::size_t i = 0; i < map_.points.size(); ++i) {
      CalibratedPoint p;
      const int point = static_cast<int>(i);
      if (fitter_.IsTaken(point) || !fitter_.Calibrate(point, &p)) continue;
      if (!(std::abs(ConicDistancePx(p, predicted.conic)) < search_px_)) continue;
      const Vector2d normal = map_.points[i].Normal();
      const double cosine = Outward(p, predicted.conic).dot(normal);
      if (std::abs(cosine) < kMinNormalCosine) continue;
      if (predicted.bright != BrightSide::kEither &&
          (cosine < 0.0) != (predicted.bright == BrightSide::kInside)) {
        continue;
      }
      band_.push_back(p);
      directions_.normals.push_back(normal);
    }
    Thin();
  }

  void Thin() {
    const std::size_t n = band_.size(), m = std::min(n, kMaxBandPoints);
    for (std::size_t k = 0; k < m; ++k) {
      band_[k] = band_[k * n / m];
      directions_.normals[k] = directions_.normals[k * n / m];
    }
    band_.resize(m);
    directions_.normals.resize(m);
  }

  const EdgeMap& map_;
  const Camera& camera_;
  const double search_px_;
  EllipseFitter fitter_;
  // Scratch.
  std::vector<CalibratedPoint> band_;
  EdgeDirections directions_;
};

}  // namespace

std::vector<DetectedEllipse> FollowCircles(const EdgeMap& edges, const Camera& camera,
                                           const std::vector<CircleObservation>& predicted,
                                           const EllipseOptions& options, double search_px) {
  std::vector<DetectedEllipse> found(predicted.size());
  CircleFollower follower(edges, camera, options, search_px);
  // Those that hardly moved first: they take their edges, and leave fewer to the others.
  for (const bool far : {false, true}) {
    for (std::size_t k = 0; k < predicted.size(); ++k) {
      if (!predicted[k].fit || !found[k].points.empty()) continue;
      follower.Follow(predicted[k], far, &found[k]);
    }
  }
  return found;
}

void Continue(const CircleObservation& predicted, CircleObservation* circle) {
  circle->id = predicted.id;
  if (!predicted.plane.empty()) circle->plane = predicted.plane;
  circle->contrast = predicted.contrast;
  circle->radius = predicted.radius;
  circle->radius_sigma = predicted.radius_sigma;
  circle->radius_group = predicted.radius_group;
}

}  // namespace circline
