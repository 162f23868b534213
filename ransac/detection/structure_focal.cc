#include "circline/ransac/detection/structure_focal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "circline/ransac/detection/focused_features.h"
#include "circline/ransac/detection/orthogonal_evidence.h"
#include "circline/ransac/detection/straight_lens.h"
#include "circline/ransac/detection/uncertain_direction.h"

namespace circline {
namespace {

using Circles = std::vector<std::optional<ConicFit>>;
using Directions = std::vector<std::optional<UncertainDirection>>;

// The prior is searched over so many of its standard deviations.
constexpr double kReach = 2.5;
// Half the longer side of the photo over the focal length: tangents of 5 and 60 degrees.
constexpr double kNarrowest = 0.0874887, kWidest = 1.7320508;
// Circles whose normals are tried as that of the plane.
constexpr std::size_t kMaxSeeds = 6;
// Edges of one thing may miss their direction by this, radians.
constexpr double kSpreadRad = 3e-3;
// Of circles that are of the plane that most are of.
constexpr double kPlaneShare = 0.5;
// The circles of a plane have its normal within this of that of one of them, degrees.
constexpr double kSeedSigmaDeg = 5.0;

class StructureEvidence {
 public:
  StructureEvidence(const PhotoEvidence& evidence, const std::vector<DetectedPencil>& pencils,
                    const Camera& camera, const CameraSigma& sigma, double diagonal_px)
      : features_(evidence, pencils, camera, sigma, diagonal_px) {
    for (const CircleEvidence& circle : evidence.circles) {
      const UncertainDirection& normal = circle.normals[0];
      // The plane is known as well as the circle's own normal.
      peaks_.push_back(
          circle.num_normals > 0
              ? LikelihoodRatio({normal.vector, 2.0 * normal.covariance}, normal.vector)
              : 0.0);
    }
  }

  bool IsEmpty() const { return features_.IsEmpty(); }

  // Logarithm of the evidence at a focal length, against that of no structure.
  double At(double log_focal) {
    const FocusedFeatures features = features_.At(log_focal);
    return RightAngles(features.pencils) + EdgesAtRightAngles(features) +
           OnePlane(features.circles);
  }

 private:
  static double RightAngles(const Directions& directions) {
    double sum = 0.0;
    for (std::size_t i = 0; i < directions.size(); ++i) {
      for (std::size_t j = i + 1; j < directions.size(); ++j) {
        const bool is_seen = directions[i] && directions[j];
        const double odds =
            is_seen ? std::exp(LogOddsOfRightAngle(*directions[i], *directions[j])) : 0.0;
        sum += std::log(0.5 + 0.5 * odds);
      }
    }
    return sum;
  }

  // Of the edges around the only pencil as those of one thing with it.
  static double EdgesAtRightAngles(const FocusedFeatures& features) {
    if (features.edges.empty() || !features.pencils[0]) return 0.0;
    std::vector<LineFit> edges;
    for (const std::optional<UncertainDirection>& edge : features.edges) {
      if (edge) edges.push_back({edge->vector, edge->covariance, 0.0});
    }
    const OrthogonalEvidence evidence(edges, features.pencils[0]->vector, kSpreadRad);
    return std::log1p(std::exp(evidence.HighestLogOdds()));
  }

  // Of the plane that explains most of them.
  double OnePlane(const Circles& circles) const {
    if (circles.size() < 2) return 0.0;
    double best = 0.0;
    for (std::size_t seed = 0; seed < std::min(circles.size(), kMaxSeeds); ++seed) {
      if (!circles[seed]) continue;
      std::array<UncertainDirection, 2> normals;
      const int count = CircleNormals(*circles[seed], &normals);
      for (int k = 0; k < count; ++k) {
        const UncertainDirection mean = MeanOfPlane(circles, normals[static_cast<std::size_t>(k)]);
        best = std::max(best, PlaneEvidence(circles, mean));
      }
    }
    return best;
  }

  static UncertainDirection MeanOfPlane(const Circles& circles, const UncertainDirection& seed) {
    std::vector<const ConicFit*> members;
    for (const std::optional<ConicFit>& circle : circles) {
      if (circle && CanLieIn(*circle, seed)) members.push_back(&*circle);
    }
    return NormalOfCircles(seed, kSeedSigmaDeg, members);
  }

  // How much likelier circles are as those of one plane than as any. What a circle's normal is
  // known to changes with the focal length, what its contour is known to does not: that alone
  // counts, so that all focal lengths are compared by the same data.
  double PlaneEvidence(const Circles& circles, const UncertainDirection& plane) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < circles.size(); ++i) {
      const double ratio =
          circles[i]
              ? peaks_[i] * std::exp(-0.5 * CircleEquations(*circles[i], plane.vector).Chi2(plane))
              : 0.0;
      sum += std::log(1.0 - kPlaneShare + kPlaneShare * ratio);
    }
    return sum;
  }

  FeaturesByFocal features_;
  std::vector<double> peaks_;  // Of each circle's likelihood, against that of any plane.
};

double LogPrior(double off, const CameraSigma& sigma) {
  const auto gaussian = [off](double s) { return std::exp(-0.5 * off * off / (s * s)) / s; };
  if (!(sigma.doubtful_log_focal > sigma.log_focal)) {
    return -0.5 * off * off / (sigma.log_focal * sigma.log_focal);
  }
  return std::log((1.0 - kDoubtfulShare) * gaussian(sigma.log_focal) +
                  kDoubtfulShare * gaussian(sigma.doubtful_log_focal));
}

double LogPriorOfLens(double log_focal, Camera camera, const CameraSigma& sigma, double found_k1) {
  if (!sigma.IsLensOpen()) return 0.0;
  const double stated = camera.distortion[0] - found_k1;
  SetFocal(log_focal, sigma, &camera);
  const double off = (camera.distortion[0] - stated) / sigma.k1;
  return -0.5 * off * off;
}

}  // namespace

LikelyFocal LikeliestFocal(const PhotoEvidence& evidence,
                           const std::vector<DetectedPencil>& pencils, const Camera& camera,
                           const CameraSigma& sigma, double prior_log_focal, double diagonal_px,
                           double found_k1) {
  StructureEvidence structure(evidence, pencils, camera, sigma, diagonal_px);
  if (structure.IsEmpty()) {
    const bool is_there = std::abs(prior_log_focal) <= 0.5 * kFocalStep;
    return {prior_log_focal, is_there ? 0.0 : std::numeric_limits<double>::infinity()};
  }
  const double half = 0.5 * std::max(camera.width, camera.height) / camera.fx;
  // No lens is further from another one than that, however little is known.
  const double reach = std::min(kReach * sigma.LargestLogFocal(), std::log(kWidest / kNarrowest));
  double low = prior_log_focal - reach, high = prior_log_focal + reach;
  if (half > 0.0) {
    low = std::max(low, std::log(half / kWidest));
    high = std::min(high, std::log(half / kNarrowest));
  }
  const auto evidence_at = [&](double log_focal) {
    return structure.At(log_focal) + LogPrior(log_focal - prior_log_focal, sigma) +
           LogPriorOfLens(log_focal, camera, sigma, found_k1);
  };
  const double here = evidence_at(0.0);
  LikelyFocal likeliest;
  for (double k = std::ceil(low / kFocalStep); k * kFocalStep <= high; ++k) {
    const double log_focal = k * kFocalStep, gain = evidence_at(log_focal) - here;
    if (gain > likeliest.gain) likeliest = {log_focal, gain};
  }
  return likeliest;
}

}  // namespace circline
