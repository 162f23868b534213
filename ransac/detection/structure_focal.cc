#include "circline/ransac/detection/structure_focal.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "circline/estimators/conic.h"
#include "circline/ransac/detection/orthogonal_evidence.h"
#include "circline/ransac/detection/uncertain_direction.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Steps of log focal length: a third of what a degree of a right angle is worth at 30 degrees of
// tilt.
constexpr double kStep = 0.02;
// The prior is searched over so many of its standard deviations.
constexpr double kReach = 2.5;
// Half the longer side of the photo over the focal length: tangents of 5 and 60 degrees.
constexpr double kNarrowest = 0.0874887, kWidest = 1.7320508;
// More circles, and more pencils, add little but accidents.
constexpr std::size_t kMaxCircles = 16, kMaxSeeds = 6, kMaxPencils = 4, kMaxEdges = 40;
// Edges of one thing may miss their direction by this, radians.
constexpr double kSpreadRad = 3e-3;
// Of circles that are of the plane that most are of.
constexpr double kPlaneShare = 0.5;
// The circles of a plane have its normal within this of that of one of them, degrees.
constexpr double kSeedSigmaDeg = 5.0;
// Pencils nearer than this (a sine; 3 degrees) are one.
constexpr double kDistinctSine = 0.0523;

// Calibrated coordinates at another focal length: x' = A x.
Vector3d Scale(double log_focal) {
  const double s = std::exp(-log_focal);
  return {s, s, 1.0};
}

UncertainDirection Refocused(const UncertainDirection& direction, const Vector3d& scale) {
  UncertainDirection out;
  const Vector3d moved = scale.cwiseProduct(direction.vector);
  out.vector = moved.normalized();
  const Matrix3d J = (Matrix3d::Identity() - out.vector * out.vector.transpose()) *
                     scale.asDiagonal() / moved.norm();
  out.covariance = J * direction.covariance * J.transpose();
  return out;
}

LineFit Refocused(const LineFit& fit, const Vector3d& scale) {
  const UncertainDirection normal =
      Refocused(UncertainDirection{fit.line, fit.covariance}, scale.cwiseInverse());
  LineFit out = fit;
  out.line = normal.vector;
  out.covariance = normal.covariance;
  return out;
}

ConicFit Refocused(const ConicFit& fit, const Vector3d& scale) {
  const Matrix3d inverse = scale.cwiseInverse().asDiagonal();
  ConicFit out = fit;
  out.conic = inverse * fit.conic * inverse;
  Matrix6d J;
  for (int k = 0; k < 6; ++k)
    J.col(k) = ConicToVector(inverse * VectorToConic(Vector6d::Unit(k)) * inverse);
  Eigen::Map<Matrix6d>(out.covariance.data()) = J * fit.Covariance() * J.transpose();
  return out;
}

class StructureEvidence {
 public:
  StructureEvidence(const PhotoEvidence& evidence, const std::vector<DetectedPencil>& pencils,
                    double diagonal_px) {
    for (const CircleEvidence& circle : evidence.circles) {
      conics_.push_back(&*circle.observation.fit);
      const UncertainDirection& normal = circle.normals[0];
      // The plane is known as well as the circle's own normal.
      peaks_.push_back(
          circle.num_normals > 0
              ? LikelihoodRatio({normal.vector, 2.0 * normal.covariance}, normal.vector)
              : 0.0);
    }
    for (const DetectedPencil& pencil : pencils) {
      const UncertainDirection direction{pencil.observation.fit->direction,
                                         pencil.observation.fit->covariance};
      const bool is_new = std::none_of(directions_.begin(), directions_.end(), [&](const auto& d) {
        return d.vector.cross(direction.vector).norm() < kDistinctSine;
      });
      if (is_new && directions_.size() < kMaxPencils) directions_.push_back(direction);
    }
    if (IsEmpty() && !pencils.empty()) {
      edges_ = EdgesAround(evidence.lines, pencils[0], diagonal_px);
      if (edges_.size() > kMaxEdges) edges_.resize(kMaxEdges);
    }
  }

  bool IsEmpty() const { return conics_.size() < 2 && directions_.size() < 2 && edges_.size() < 2; }

  // Logarithm of the evidence at a focal length, against that of no structure.
  double At(double log_focal) const {
    const Vector3d scale = Scale(log_focal);
    std::vector<UncertainDirection> directions;
    for (const UncertainDirection& d : directions_) directions.push_back(Refocused(d, scale));
    return RightAngles(directions) + EdgesAtRightAngles(directions, scale) + Circles(scale);
  }

 private:
  static double RightAngles(const std::vector<UncertainDirection>& directions) {
    double sum = 0.0;
    for (std::size_t i = 0; i < directions.size(); ++i) {
      for (std::size_t j = i + 1; j < directions.size(); ++j) {
        sum += std::log(0.5 + 0.5 * std::exp(LogOddsOfRightAngle(directions[i], directions[j])));
      }
    }
    return sum;
  }

  // Of the edges around the only pencil as those of one thing with it.
  double EdgesAtRightAngles(const std::vector<UncertainDirection>& directions,
                            const Vector3d& scale) const {
    if (edges_.empty()) return 0.0;
    std::vector<LineFit> edges;
    for (const LineFit& edge : edges_) edges.push_back(Refocused(edge, scale));
    const OrthogonalEvidence evidence(edges, directions[0].vector, kSpreadRad);
    return std::log1p(std::exp(evidence.HighestLogOdds()));
  }

  // Of the plane that explains most of them.
  double Circles(const Vector3d& scale) const {
    if (conics_.size() < 2) return 0.0;
    std::vector<ConicFit> all(std::min(conics_.size(), kMaxCircles));
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = Refocused(*conics_[i], scale);
    double best = 0.0;
    for (std::size_t seed = 0; seed < std::min(all.size(), kMaxSeeds); ++seed) {
      std::array<UncertainDirection, 2> normals;
      const int count = CircleNormals(all[seed], &normals);
      for (int k = 0; k < count; ++k) {
        const UncertainDirection mean = MeanOfPlane(all, normals[static_cast<std::size_t>(k)]);
        best = std::max(best, PlaneEvidence(all, mean));
      }
    }
    return best;
  }

  static UncertainDirection MeanOfPlane(const std::vector<ConicFit>& all,
                                        const UncertainDirection& seed) {
    std::vector<const ConicFit*> members;
    for (const ConicFit& circle : all) {
      if (CanLieIn(circle, seed)) members.push_back(&circle);
    }
    return NormalOfCircles(seed, kSeedSigmaDeg, members);
  }

  // How much likelier circles are as those of one plane than as any. What a circle's normal is
  // known to changes with the focal length, what its contour is known to does not: that alone
  // counts, so that all focal lengths are compared by the same data.
  double PlaneEvidence(const std::vector<ConicFit>& all, const UncertainDirection& plane) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double chi2 = CircleEquations(all[i], plane.vector).Chi2(plane);
      sum += std::log(1.0 - kPlaneShare + kPlaneShare * peaks_[i] * std::exp(-0.5 * chi2));
    }
    return sum;
  }

  std::vector<const ConicFit*> conics_;
  std::vector<double> peaks_;  // Of each circle's likelihood, against that of any plane.
  std::vector<UncertainDirection> directions_;
  std::vector<LineFit> edges_;  // Around the only pencil.
};

double LogPrior(double off, const CameraSigma& sigma) {
  const auto gaussian = [off](double s) { return std::exp(-0.5 * off * off / (s * s)) / s; };
  if (!(sigma.doubtful_log_focal > sigma.log_focal)) {
    return -0.5 * off * off / (sigma.log_focal * sigma.log_focal);
  }
  return std::log((1.0 - kDoubtfulShare) * gaussian(sigma.log_focal) +
                  kDoubtfulShare * gaussian(sigma.doubtful_log_focal));
}

}  // namespace

double LikeliestLogFocal(const PhotoEvidence& evidence, const std::vector<DetectedPencil>& pencils,
                         const Camera& camera, const CameraSigma& sigma, double prior_log_focal,
                         double diagonal_px) {
  const StructureEvidence structure(evidence, pencils, diagonal_px);
  if (structure.IsEmpty()) return prior_log_focal;
  const double half = 0.5 * std::max(camera.width, camera.height) / camera.fx;
  // No lens is further from another one than that, however little is known.
  const double reach = std::min(kReach * sigma.LargestLogFocal(), std::log(kWidest / kNarrowest));
  double low = prior_log_focal - reach, high = prior_log_focal + reach;
  if (half > 0.0) {
    low = std::max(low, std::log(half / kWidest));
    high = std::min(high, std::log(half / kNarrowest));
  }
  double best = -std::numeric_limits<double>::infinity(), likeliest = prior_log_focal;
  const int steps = high >= low ? static_cast<int>((high - low) / kStep) : -1;
  for (int k = 0; k <= steps; ++k) {
    const double log_focal = low + k * kStep;
    const double evidence_here =
        structure.At(log_focal) + LogPrior(log_focal - prior_log_focal, sigma);
    if (!(evidence_here > best)) continue;
    best = evidence_here;
    likeliest = log_focal;
  }
  return likeliest;
}

}  // namespace circline
