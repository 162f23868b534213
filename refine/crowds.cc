#include "circline/refine/crowds.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "circline/refine/quadratic_models.h"

namespace circline {
namespace {

// `fit(points, &curve)` and `distance(point, curve)`, pixels: fits what is strung and an inlier,
// and gates what is strung again. False, with nothing changed, where a fit fails.
template <typename Curve, typename Fit, typename Distance>
bool Refit(const Camera& camera, const std::vector<Eigen::Vector2d>& pixels, double sigma_px,
           const Fit& fit, const Distance& distance, std::optional<Curve>* curve,
           std::vector<std::uint8_t>* inliers) {
  const std::vector<std::uint8_t> strung = NotCrowded(pixels, sigma_px);
  std::vector<std::uint8_t> mask = *inliers;
  for (std::size_t i = 0; i < mask.size(); ++i) mask[i] &= strung[i];
  if (mask == *inliers) return false;
  std::vector<CalibratedPoint> points;
  Curve found;
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    CalibrateInliers(camera, pixels, mask, &points);
    if (!fit(points, &found).ok()) return false;
    for (std::size_t i = 0; i < mask.size(); ++i) {
      CalibratedPoint p;
      mask[i] = strung[i] != 0 && PixelToCalibrated(camera, pixels[i], &p) &&
                        std::abs(distance(p, found)) <= kInlierSigmas * sigma_px
                    ? 1
                    : 0;
    }
  }
  *curve = found;
  *inliers = std::move(mask);
  return true;
}

// What a robust fit refused has got a direct one here, of everything: where that does not fit, its
// outliers are yet to be found.
template <typename Fit, typename Distance>
void GateMisfit(const Camera& camera, const std::vector<Eigen::Vector2d>& pixels, double sigma_px,
                const Fit& fit, const Distance& distance, std::vector<std::uint8_t>* inliers) {
  constexpr double kMisfitSigmas = 2.0;
  if (!inliers->empty() || !(fit.rms_px > kMisfitSigmas * sigma_px)) return;
  for (const Eigen::Vector2d& pixel : pixels) {
    CalibratedPoint p;
    const bool near = PixelToCalibrated(camera, pixel, &p) &&
                      std::abs(distance(p, fit)) <= kInlierSigmas * sigma_px;
    inliers->push_back(near ? 1 : 0);
  }
}

double ToConic(const CalibratedPoint& p, const ConicFit& fit) {
  return ConicDistancePx(p, fit.conic);
}

double ToLine(const CalibratedPoint& p, const LineFit& fit) { return LineDistancePx(p, fit.line); }

double SigmaPx(double stated, const LossOptions& loss) {
  return stated > 0.0 ? stated : loss.scale_px;
}

bool Refit(const Camera& camera, double sigma_px, CircleObservation* circle) {
  return Refit(
      camera, circle->points, sigma_px,
      [sigma_px](const std::vector<CalibratedPoint>& points, ConicFit* fit) {
        return FitConic(points, sigma_px, fit);
      },
      ToConic, &circle->fit, &circle->inliers);
}

bool Refit(const Camera& camera, double sigma_px, LineObservation* line) {
  return Refit(
      camera, line->points, sigma_px,
      [sigma_px](const std::vector<CalibratedPoint>& points, LineFit* fit) {
        return FitLine(points, sigma_px, fit);
      },
      ToLine, &line->fit, &line->inliers);
}

}  // namespace

bool Redescends(LossType type) {
  return type == LossType::kTukey || type == LossType::kGemanMcClure;
}

bool IsContaminated(const std::vector<std::uint8_t>& inliers) {
  constexpr double kShare = 0.15;
  const auto outliers = std::count(inliers.begin(), inliers.end(), 0);
  return static_cast<double>(outliers) > kShare * static_cast<double>(inliers.size());
}

std::vector<std::uint8_t> NotCrowded(const std::vector<Eigen::Vector2d>& pixels, double sigma_px) {
  constexpr double kRadiusSigmas = 5.0;
  constexpr int kTolerated = 3;  // Times the quarter's count, and as many by chance.
  const double radius2 = kRadiusSigmas * kRadiusSigmas * sigma_px * sigma_px;
  std::vector<int> neighbours(pixels.size(), 0);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const int near = (pixels[i] - pixels[j]).squaredNorm() <= radius2 ? 1 : 0;
      neighbours[i] += near;
      neighbours[j] += near;
    }
  }
  std::vector<int> sorted = neighbours;
  const auto quarter = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 4);
  std::nth_element(sorted.begin(), quarter, sorted.end());
  std::vector<std::uint8_t> result;
  for (const int n : neighbours) result.push_back(n <= kTolerated * (1 + *quarter) ? 1 : 0);
  return result;
}

void RefitWithoutCrowds(const EstimationOptions& options, Observations* observations) {
  const Camera& camera = observations->camera;
  for (CircleObservation& circle : observations->circles) {
    const double sigma = SigmaPx(circle.sigma_px, options.conic_loss);
    if (!circle.fit || !(sigma > 0.0) || !Redescends(options.conic_loss.type)) continue;
    GateMisfit(camera, circle.points, sigma, *circle.fit, ToConic, &circle.inliers);
    if (IsContaminated(circle.inliers)) Refit(camera, sigma, &circle);
  }
  for (PencilObservation& pencil : observations->pencils) {
    if (!Redescends(options.line_loss.type)) continue;
    bool changed = false;
    std::vector<LineFit> fits;
    for (LineObservation& line : pencil.lines) {
      const double sigma = SigmaPx(LineSigma(pencil, line), options.line_loss);
      if (!line.fit || !(sigma > 0.0)) continue;
      GateMisfit(camera, line.points, sigma, *line.fit, ToLine, &line.inliers);
      if (IsContaminated(line.inliers)) changed = Refit(camera, sigma, &line) || changed;
      fits.push_back(*line.fit);
    }
    VanishingPointFit fit;
    if (changed && FitVanishingPoint(fits, &fit).ok()) pencil.fit = fit;
  }
}

}  // namespace circline
