#include "circline/ransac/detection/structure/structure_focal.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "circline/estimators/basics.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/conic.h"
#include "circline/ransac/detection/structure/line_odds.h"
#include "circline/ransac/detection/structure/orthogonal_evidence.h"
#include "circline/ransac/detection/structure/straight_lens.h"
#include "circline/ransac/detection/structure/third_direction.h"
#include "circline/ransac/detection/structure/uncertain_direction.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The prior is searched over so many of its standard deviations.
constexpr double kSearchedSigmas = 2.5;
// Half the longer side of the photo over the focal length: tangents of 5 and 60 degrees.
constexpr double kNarrowest = 0.0874887, kWidest = 1.7320508;
// Circles whose normals are tried as that of the plane.
constexpr std::size_t kTriedNormals = 6;
// Of circles that are of the plane that most are of.
constexpr double kPlaneShare = 0.5;
// Odds that two directions are at right angles below which a third to both is not looked for.
constexpr double kNegligible = 0.05;
// Beyond these the odds are the same.
constexpr double kMostLogOdds = 300.0;
// The circles of a plane have its normal within this of that of one of them, degrees.
constexpr double kSeedSigmaDeg = 5.0;

// More circles, pencils and edges add little but accidents.
constexpr std::size_t kMaxCircles = 16, kMaxPencils = 4, kMaxEdges = 40;

// A conic seen through a camera of another focal length, its logarithm over that of the first.
ConicFit Refocus(const ConicFit& fit, double log_focal) {
  const double s = std::exp(log_focal);
  const Matrix3d scale = Vector3d(s, s, 1.0).asDiagonal();
  ConicFit out = fit;
  out.conic = scale * fit.conic * scale;
  Vector6d entries;  // What ConicToVector's are multiplied by.
  entries << s * s, s * s, 1.0, s * s, s, s;
  Eigen::Map<Matrix6d>(out.covariance.data()) =
      entries.asDiagonal() * fit.Covariance() * entries.asDiagonal();
  return out;
}

// The features by which the structure of a photo is judged: the best circles, the directions of the
// longest pencils, and edges around these where they tell more. What was fitted is seen through
// another focal length as through a lens that bends the photo alike: a photo is looked at again
// where that leads.
struct Features {
  std::vector<ConicFit> circles;
  std::vector<UncertainDirection> pencils;
  std::vector<LineFit> edges;
  std::size_t num_along = 0;  // Lines of the first pencil.

  Features(const PhotoEvidence& evidence, const std::vector<DetectedPencil>& detected,
           double diagonal_px) {
    for (const CircleEvidence& circle : evidence.circles) {
      if (circles.size() < kMaxCircles) circles.push_back(*circle.observation.fit);
    }
    for (const DetectedPencil& pencil : detected) {
      const VanishingPointFit& fit = *pencil.observation.fit;
      const bool is_known = std::any_of(pencils.begin(), pencils.end(), [&](const auto& other) {
        return AreAlike(other.direction, fit.direction);
      });
      if (!is_known && pencils.size() < kMaxPencils) pencils.push_back(fit);
    }
    if (!detected.empty()) num_along = detected[0].members.size();
    const bool tell_a_third = pencils.size() > 1 && circles.size() < 2;
    if (!tell_a_third && !IsEmpty()) return;
    edges = EdgesAround(evidence.lines, detected, diagonal_px);
    if (edges.size() > kMaxEdges) edges.resize(kMaxEdges);
  }

  // Whether all focal lengths are alike to them.
  bool IsEmpty() const { return circles.size() < 2 && pencils.size() < 2 && edges.size() < 2; }

  // At a focal length, its logarithm over that of the camera.
  Features At(double log_focal) const {
    Features at = *this;
    for (ConicFit& circle : at.circles) circle = Refocus(circle, log_focal);
    for (UncertainDirection& pencil : at.pencils) pencil = Refocus(pencil, log_focal);
    for (LineFit& edge : at.edges) {
      const auto moved = Refocus(UncertainDirection{edge.line, edge.covariance}, -log_focal);
      edge.line = moved.direction;
      edge.covariance = moved.covariance;
    }
    return at;
  }
};

class StructureEvidence {
 public:
  StructureEvidence(const PhotoEvidence& evidence, const std::vector<DetectedPencil>& pencils,
                    double middle_rad, double diagonal_px)
      : features_(evidence, pencils, diagonal_px), middle_rad_(middle_rad) {
    for (const CircleEvidence& circle : evidence.circles) {
      const UncertainDirection& normal = circle.normals[0];
      // The plane is known as well as the circle's own normal.
      peaks_.push_back(
          LikelihoodRatio({normal.direction, 2.0 * normal.covariance}, normal.direction));
    }
  }

  bool IsEmpty() const { return features_.IsEmpty(); }

  struct Odds {
    double log_common = 0.0;  // Right angles and a common plane to neither, logarithm.
    double others = 0.0;      // Other lines at right angles to the pencils to any way.
  };
  Odds At(double log_focal) const {
    const Features features = features_.At(log_focal);
    const CameraError camera{middle_rad_ * std::exp(-log_focal), 0.0};
    return {RightAngles(features.pencils, camera) + OnePlane(features.circles),
            features.edges.size() < 2      ? 0.0
            : features.pencils.size() == 1 ? EdgesAtRightAngles(features)
                                           : EdgesAlongThird(features, camera)};
  }

 private:
  static double RightAngles(const std::vector<UncertainDirection>& directions,
                            const CameraError& camera) {
    double sum = 0.0;
    for (std::size_t j = 0; j < directions.size(); ++j) {
      for (std::size_t i = 0; i < j; ++i) {
        const double odds = std::exp(RightAngle(directions[i], directions[j], camera).LogOdds());
        sum += std::log(0.5 + 0.5 * odds);
      }
    }
    return sum;
  }

  // Of the edges around the only pencil as those of one thing with it.
  static double EdgesAtRightAngles(const Features& features) {
    const OrthogonalEvidence evidence(features.edges, features.pencils[0].direction,
                                      features.num_along);
    return std::exp(std::min(evidence.HighestLogOdds(), kMostLogOdds));
  }

  // Of the lines outside the pencils as those of the third direction of one thing with two of them.
  static double EdgesAlongThird(const Features& features, const CameraError& camera) {
    std::vector<LineOdds> lines;
    for (const LineFit& edge : features.edges)
      lines.emplace_back(WithDirectionError(edge, kParallelSigmaRad));
    double sum = 0.0, pairs = 0.0;
    for (std::size_t i = 0; i < features.pencils.size(); ++i) {
      for (std::size_t j = i + 1; j < features.pencils.size(); ++j) {
        pairs += 1.0;
        const UncertainDirection &a = features.pencils[i], &b = features.pencils[j];
        const double odds = std::exp(RightAngle(a, b, camera).LogOdds());
        if (odds < kNegligible) continue;
        if (const auto third = ThirdDirection(a, b, camera))
          sum += odds / (1.0 + odds) * LinesAlong(lines, *third).ratio;
      }
    }
    return sum / pairs;
  }

  // Of the plane that explains most of them.
  double OnePlane(const std::vector<ConicFit>& circles) const {
    if (circles.size() < 2) return 0.0;
    double best = 0.0;
    for (std::size_t seed = 0; seed < std::min(circles.size(), kTriedNormals); ++seed) {
      std::array<CirclePose, 2> poses;
      const int count = CirclePoses(circles[seed].conic, &poses);
      for (int k = 0; k < count; ++k) {
        const UncertainDirection mean =
            MeanOfPlane(circles, circles[seed], poses[static_cast<std::size_t>(k)].normal);
        best = std::max(best, PlaneEvidence(circles, mean));
      }
    }
    return best;
  }

  // Of the circles that can lie in a plane of one of them.
  static UncertainDirection MeanOfPlane(const std::vector<ConicFit>& circles, const ConicFit& one,
                                        const Vector3d& normal) {
    const UncertainDirection seed =
        NormalOfCircles({normal, Matrix3d::Zero()}, kSeedSigmaDeg, {&one});
    std::vector<const ConicFit*> members;
    for (const ConicFit& circle : circles) {
      if (CanLieIn(circle, seed)) members.push_back(&circle);
    }
    return NormalOfCircles(seed, kSeedSigmaDeg, members);
  }

  // How much likelier circles are as those of one plane than as any. What a circle's normal is
  // known to changes with the focal length, what its contour is known to does not: that alone
  // counts, so that all focal lengths are compared by the same data.
  double PlaneEvidence(const std::vector<ConicFit>& circles,
                       const UncertainDirection& plane) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < circles.size(); ++i) {
      const double chi2 = CircleEquations(circles[i], plane.direction).Chi2(plane);
      const double ratio = peaks_[i] * std::exp(-0.5 * chi2);
      sum += std::log(1.0 - kPlaneShare + kPlaneShare * ratio);
    }
    return sum;
  }

  Features features_;
  double middle_rad_;          // Standard deviation of the principal point, over the focal length.
  std::vector<double> peaks_;  // Of each circle's likelihood, against that of any plane.
};

double LogPrior(double off, const CameraSigma& sigma) {
  const auto gaussian = [off](double s) { return std::exp(-0.5 * off * off / (s * s)) / s; };
  if (!(sigma.doubtful_log_focal > sigma.log_focal))
    return -0.5 * off * off / (sigma.log_focal * sigma.log_focal);
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

// A focal length that is compared.
struct Step {
  double log_focal, log_prior;
  StructureEvidence::Odds odds;

  // `any`: what `others` is where lines are at right angles at another focal length. That they meet
  // is seen at all of them, that they do so at right angles tells: as likely they do not (half of
  // the corners are square), or are of nothing at all.
  double LogEvidence(double any) const {
    return log_prior + odds.log_common + std::log(1.0 + any + odds.others);
  }
};

// Over all focal lengths alike: directions that are not at right angles do not depend on it.
double MeanOfOthers(const std::vector<Step>& steps) {
  double sum = 0.0;
  for (const Step& step : steps) sum += step.odds.others;
  return sum / static_cast<double>(steps.size());
}

}  // namespace

LikelyFocal LikeliestFocal(const PhotoEvidence& evidence,
                           const std::vector<DetectedPencil>& pencils, const Camera& camera,
                           const CameraSigma& sigma, double prior_log_focal, double diagonal_px,
                           double found_k1) {
  const StructureEvidence structure(evidence, pencils, sigma.principal_point_px / camera.fx,
                                    diagonal_px);
  if (structure.IsEmpty()) {
    const bool is_there = std::abs(prior_log_focal) <= 0.5 * kFocalStep;
    return {prior_log_focal, is_there ? 0.0 : std::numeric_limits<double>::infinity()};
  }
  const double half = 0.5 * std::max(camera.width, camera.height) / camera.fx;
  // No lens is further from another one than that, however little is known.
  const double reach =
      std::min(kSearchedSigmas * sigma.LargestLogFocal(), std::log(kWidest / kNarrowest));
  double low = prior_log_focal - reach, high = prior_log_focal + reach;
  if (half > 0.0) {
    low = std::max(low, std::log(half / kWidest));
    high = std::min(high, std::log(half / kNarrowest));
  }
  const auto step_at = [&](double log_focal) {
    const double log_prior = LogPrior(log_focal - prior_log_focal, sigma) +
                             LogPriorOfLens(log_focal, camera, sigma, found_k1);
    return Step{log_focal, log_prior, structure.At(log_focal)};
  };
  std::vector<Step> steps = {step_at(0.0)};  // Where the camera is.
  for (double k = std::ceil(low / kFocalStep); k * kFocalStep <= high; ++k)
    steps.push_back(step_at(k * kFocalStep));
  const double any = MeanOfOthers(steps), here = steps.front().LogEvidence(any);
  LikelyFocal likeliest;
  for (const Step& step : steps) {
    const double gain = step.LogEvidence(any) - here;
    if (gain > likeliest.gain) likeliest = {step.log_focal, gain};
  }
  return likeliest;
}

}  // namespace circline
