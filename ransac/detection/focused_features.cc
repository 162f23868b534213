#include "circline/ransac/detection/focused_features.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "circline/estimators/conic.h"
#include "circline/ransac/detection/detect_pencils.h"
#include "circline/ransac/detection/straight_lens.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Of log focal length, between fits. Through a lens of k1 = -0.45, interpolation errs by less than
// a tenth of what the edges of a disc of 40 px are known to.
constexpr double kNodeStep = 0.14;
// More circles, and more pencils, add little but accidents.
constexpr std::size_t kMaxCircles = 16, kMaxPencils = 4, kMaxEdges = 40;
// More points of a contour, or of a line, take time and tell no more.
constexpr std::size_t kMostOfContour = 40, kMostOfLine = 8;
// A circle of which the camera undistorts a smaller share is not seen.
constexpr double kSeenShare = 0.8;
// Pencils nearer than this (a sine; 3 degrees) are one.
constexpr double kDistinctSine = 0.0523;

// Calibrated coordinates at another focal length: x' = A x.
ConicFit Refocus(const ConicFit& fit, double log_focal) {
  const double s = std::exp(log_focal);
  const Matrix3d inverse = Vector3d(s, s, 1.0).asDiagonal();
  ConicFit out = fit;
  out.conic = inverse * fit.conic * inverse;
  Matrix6d J;
  for (int k = 0; k < 6; ++k)
    J.col(k) = ConicToVector(inverse * VectorToConic(Vector6d::Unit(k)) * inverse);
  Eigen::Map<Matrix6d>(out.covariance.data()) = J * fit.Covariance() * J.transpose();
  return out;
}

UncertainDirection Between(const UncertainDirection& a, const UncertainDirection& b, double share) {
  const double sense = a.vector.dot(b.vector) < 0.0 ? -1.0 : 1.0;
  return {((1.0 - share) * a.vector + sense * share * b.vector).normalized(),
          (1.0 - share) * a.covariance + share * b.covariance};
}

ConicFit Between(const ConicFit& a, const ConicFit& b, double share) {
  ConicFit out;
  out.conic = (1.0 - share) * a.conic + share * b.conic;
  Eigen::Map<Matrix6d>(out.covariance.data()) =
      (1.0 - share) * a.Covariance() + share * b.Covariance();
  return out;
}

// Features of two focal lengths, each seen at the one between that lies at this share of the way.
template <typename Feature>
std::vector<std::optional<Feature>> Between(const std::vector<std::optional<Feature>>& low,
                                            const std::vector<std::optional<Feature>>& high,
                                            double share, double from_low, double from_high) {
  std::vector<std::optional<Feature>> out(low.size());
  for (std::size_t i = 0; i < low.size(); ++i) {
    if (low[i] && high[i])
      out[i] = Between(Refocus(*low[i], from_low), Refocus(*high[i], from_high), share);
  }
  return out;
}

}  // namespace

// Evenly spaced ones, together worth as much as all.
FeaturesByFocal::Points FeaturesByFocal::Some(const std::vector<Vector2d>& all, std::size_t most,
                                              double variance) {
  const std::size_t n = std::min(all.size(), most);
  Points some{{}, variance * static_cast<double>(n) / static_cast<double>(all.size())};
  for (std::size_t k = 0; k < n; ++k)
    some.pixels.push_back(all[k * (all.size() - 1) / std::max<std::size_t>(n - 1, 1)]);
  return some;
}

FeaturesByFocal::FeaturesByFocal(const PhotoEvidence& evidence,
                                 const std::vector<DetectedPencil>& pencils, const Camera& camera,
                                 const CameraSigma& sigma, double diagonal_px)
    : camera_(camera), sigma_(sigma) {
  AddCircles(evidence);
  AddPencils(pencils);
  const bool tell_a_third = pencils_.size() > 1 && circles_.size() < 2;
  if (tell_a_third || IsEmpty()) AddEdges(EdgesAround(evidence.lines, pencils, diagonal_px));
}

void FeaturesByFocal::AddCircles(const PhotoEvidence& evidence) {
  for (const CircleEvidence& circle : evidence.circles) {
    if (circles_.size() == kMaxCircles) break;
    circles_.push_back(Some(circle.observation.points, kMostOfContour, 1.0));
    ConicFit unit;
    if (FitCircle(camera_, circles_.back(), &unit)) {
      circles_.back().variance *=
          circle.observation.fit->Covariance().trace() / unit.Covariance().trace();
    }
  }
}

void FeaturesByFocal::AddPencils(const std::vector<DetectedPencil>& pencils) {
  std::vector<Vector3d> directions;
  for (const DetectedPencil& pencil : pencils) {
    const Vector3d& direction = pencil.observation.fit->direction;
    const bool is_new = std::none_of(directions.begin(), directions.end(), [&](const Vector3d& d) {
      return d.cross(direction).norm() < kDistinctSine;
    });
    if (!is_new || pencils_.size() == kMaxPencils) continue;
    directions.push_back(direction);
    pencils_.emplace_back();
    for (const LineObservation& line : pencil.observation.lines)
      pencils_.back().push_back(Some(line.points, kMostOfLine, line.sigma_px * line.sigma_px));
  }
}

void FeaturesByFocal::AddEdges(const std::vector<DetectedLine>& edges) {
  for (const DetectedLine& edge : edges) {
    if (edges_.size() == kMaxEdges) break;
    edges_.push_back(Some(edge.points, kMostOfLine, 1.0));
    LineFit unit;
    if (FitEdge(camera_, edges_.back(), &unit))
      edges_.back().variance *= edge.fit.covariance.trace() / unit.covariance.trace();
  }
}

bool FeaturesByFocal::FitCircle(const Camera& camera, const Points& points, ConicFit* fit) {
  CalibrateInliers(camera, points.pixels, {}, &calibrated_);
  const double seen =
      static_cast<double>(calibrated_.size()) / static_cast<double>(points.pixels.size());
  return seen > kSeenShare && FitConic(calibrated_, std::sqrt(points.variance), fit).ok();
}

bool FeaturesByFocal::FitEdge(const Camera& camera, const Points& points, LineFit* fit) {
  CalibrateInliers(camera, points.pixels, {}, &calibrated_);
  return FitLine(calibrated_, std::sqrt(points.variance), fit).ok();
}

FocusedFeatures FeaturesByFocal::Fit(double log_focal) {
  Camera camera = camera_;
  SetFocal(log_focal, sigma_, &camera);
  FocusedFeatures features;
  for (const Points& circle : circles_) {
    ConicFit fit;
    features.circles.emplace_back();
    if (FitCircle(camera, circle, &fit)) features.circles.back() = fit;
  }
  LineFit line;
  for (const std::vector<Points>& pencil : pencils_) {
    std::vector<LineFit> lines;
    for (const Points& points : pencil) {
      if (FitEdge(camera, points, &line)) lines.push_back(line);
    }
    VanishingPointFit fit;
    features.pencils.emplace_back();
    if (FitVanishingPoint(lines, &fit).ok())
      features.pencils.back() = UncertainDirection{fit.direction, fit.covariance};
  }
  for (const Points& edge : edges_) {
    features.edges.emplace_back();
    if (FitEdge(camera, edge, &line))
      features.edges.back() = UncertainDirection{line.line, line.covariance};
  }
  return features;
}

const FocusedFeatures& FeaturesByFocal::Node(int node) {
  const auto known = nodes_.find(node);
  if (known != nodes_.end()) return known->second;
  return nodes_.emplace(node, Fit(node * kNodeStep)).first->second;
}

FocusedFeatures FeaturesByFocal::At(double log_focal) {
  const int node = static_cast<int>(std::floor(log_focal / kNodeStep));
  const double share = log_focal / kNodeStep - node;
  const FocusedFeatures &low = Node(node), &high = Node(node + 1);
  const double from_low = share * kNodeStep, from_high = (share - 1.0) * kNodeStep;
  return {Between(low.circles, high.circles, share, from_low, from_high),
          Between(low.pencils, high.pencils, share, from_low, from_high),
          Between(low.edges, high.edges, share, -from_low, -from_high)};
}

}  // namespace circline
