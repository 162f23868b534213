#include "circline/ransac/detection/structure/straight_lens.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/line.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Shorter lines say nothing of a lens and take time, pixels.
constexpr double kMinLengthPx = 25.0;
// A bow takes three points, and two more that say how well it is known.
constexpr std::size_t kMinPointsOfBow = 5;
// Of lines that are straight. What is not straight has any bow up to this, pixels: that of
// DetectLines' bent ones.
constexpr double kStraightShare = 0.5, kMostBowPx = 1.2;
// Of k1: over which bows are taken for linear, and in which it is compared.
constexpr double kSlopeStep = 0.01, kK1Step = 0.004;
// The prior is searched over so many of its standard deviations, and no further than lenses go.
constexpr double kReachOfPrior = 3.0, kMostK1 = 1.5;

// The bow of a line, pixels: what a parabola over it rises from its ends to its middle.
struct Bow {
  double value = 0.0, variance = 0.0;  // The variance for points known to a pixel.
};

std::optional<Bow> BowThrough(const Camera& camera, const DetectedLine& line,
                              std::vector<CalibratedPoint>* points) {
  LineFit fit;
  if (PixelsToCalibrated(camera, line.points, points) > 0 || !FitLine(*points, 1.0, &fit).ok())
    return {};
  const Vector2d along = Vector2d(-fit.line.y(), fit.line.x()).normalized();
  const double first = along.dot(points->front().x), last = along.dot(points->back().x);
  Matrix3d normal = Matrix3d::Zero();
  Vector3d right_side = Vector3d::Zero();
  for (const CalibratedPoint& point : *points) {
    const double u = (2.0 * along.dot(point.x) - first - last) / (last - first);
    const Vector3d row(1.0, u, u * u);
    normal += row * row.transpose();
    right_side += LineDistancePx(point, fit.line) * row;
  }
  const Matrix3d inverse = normal.inverse();
  const Bow bow{inverse.row(2).dot(right_side), inverse(2, 2)};
  if (!std::isfinite(bow.value) || !(bow.variance > 0.0)) return {};
  return bow;
}

// The bow of a line over k1.
struct BowByLens {
  double here, slope, sigma;
};

class Bows {
 public:
  Bows(const PhotoEvidence& evidence, const Camera& camera, const NoiseModel& noise) {
    Camera less = camera, more = camera;
    less.distortion[0] -= kSlopeStep;
    more.distortion[0] += kSlopeStep;
    std::vector<CalibratedPoint> points;
    for (const std::vector<DetectedLine>* lines : {&evidence.lines, &evidence.bent}) {
      for (const DetectedLine& line : *lines) {
        if (line.length_px < kMinLengthPx || line.points.size() < kMinPointsOfBow) continue;
        const std::optional<Bow> here = BowThrough(camera, line, &points),
                                 below = BowThrough(less, line, &points),
                                 above = BowThrough(more, line, &points);
        if (!here || !below || !above) continue;
        const double weight = noise.LineWeight(line.sigma_px, line.points, {});
        bows_.push_back({here->value, (above->value - below->value) / (2.0 * kSlopeStep),
                         line.sigma_px * std::sqrt(here->variance / weight)});
      }
    }
  }

  // Logarithm of how much likelier all bows are with k1 so much larger than if all were any.
  double LogEvidence(double more_k1) const {
    double sum = 0.0;
    for (const BowByLens& bow : bows_) {
      const double off = (bow.here + bow.slope * more_k1) / bow.sigma;
      const double ratio =
          2.0 * kMostBowPx / (std::sqrt(2.0 * kPi) * bow.sigma) * std::exp(-0.5 * off * off);
      sum += std::log(1.0 - kStraightShare + kStraightShare * ratio);
    }
    return sum;
  }

 private:
  std::vector<BowByLens> bows_;
};

}  // namespace

void SetFocal(double log_focal, const CameraSigma& sigma, Camera* camera) {
  const double factor = std::exp(log_focal);
  camera->fx *= factor;
  camera->fy *= factor;
  if (camera->model == CameraModel::kOpenCV && sigma.IsLensOpen())
    camera->distortion[0] *= factor * factor;
}

LikelyLens LikeliestLens(const PhotoEvidence& evidence, const Camera& camera,
                         const NoiseModel& noise, double stated_k1) {
  const Bows bows(evidence, camera, noise);
  const double sigma = noise.camera.k1, here = camera.distortion[0];
  const auto evidence_at = [&](double k1) {
    const double off = (k1 - stated_k1) / sigma;
    return bows.LogEvidence(k1 - here) - 0.5 * off * off;
  };
  const double stated = evidence_at(stated_k1);
  LikelyLens likeliest{stated_k1, 0.0};
  const int most = static_cast<int>(std::min(kReachOfPrior * sigma, kMostK1) / kK1Step);
  for (int k = -most; k <= most; ++k) {
    const double k1 = stated_k1 + k * kK1Step, gain = evidence_at(k1) - stated;
    if (gain > likeliest.gain) likeliest = {k1, gain};
  }
  return likeliest;
}

}  // namespace circline
