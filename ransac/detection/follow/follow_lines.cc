#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>

#include "circline/estimators/conic.h"
#include "circline/ransac/detection/follow/follow_observations.h"
#include "circline/ransac/detection/structure/pencil_fitter.h"

namespace circline {
namespace {

using Eigen::Vector2d;

// A line that covers more of the predicted one is the likelier to be it: what its whole length is
// worth, in search distances.
constexpr double kLengthWorth = 0.5;
// The two share this much of the shorter one.
constexpr double kMinOverlap = 0.5;
// The centre of a circle lies within this share of the semi-minor axis from that of its ellipse.
constexpr double kMaxCentreShare = 0.35;

// How unlike a detected line is to the predicted one; infinite where it cannot be the same.
double Unlikeness(const Segment& predicted, const Segment& detected, double search_px) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const double length = (predicted[1] - predicted[0]).norm();
  if (!(length > 0.0)) return kNever;
  const Vector2d along = (predicted[1] - predicted[0]) / length;
  const Vector2d across(-along.y(), along.x());
  double mean = 0.0, from = kNever, to = -kNever;
  for (const Vector2d& end : detected) {
    const double s = along.dot(end - predicted[0]);
    from = std::min(from, s);
    to = std::max(to, s);
  }
  const double overlap = std::min(to, length) - std::max(from, 0.0);
  if (!(overlap >= kMinOverlap * std::min(length, to - from))) return kNever;
  // The distances at the ends of what they share.
  const Eigen::Hyperplane<double, 2> line =
      Eigen::Hyperplane<double, 2>::Through(detected[0], detected[1]);
  for (const double s : {std::max(from, 0.0), std::min(to, length)}) {
    const double distance = line.absDistance(predicted[0] + s * along);
    if (!(distance < search_px)) return kNever;
    mean += 0.5 * distance;
  }
  const double angle = std::abs(across.dot((detected[1] - detected[0]).normalized()));
  constexpr double kMaxTurn = 0.2;  // A sine: 12 degrees from a frame to the next.
  if (angle > kMaxTurn) return kNever;
  return mean / search_px + kLengthWorth * (1.0 - overlap / length);
}

Segment Ends(const LineObservation& line) { return {line.points.front(), line.points.back()}; }

}  // namespace

std::vector<int> CheapestPairs(std::vector<FeaturePair> pairs, std::size_t num_first,
                               std::size_t num_second) {
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const FeaturePair& a, const FeaturePair& b) { return a.cost < b.cost; });
  std::vector<int> matches(num_first, -1);
  std::vector<bool> is_taken(num_second, false);
  for (const FeaturePair& pair : pairs) {
    if (matches[pair.first] >= 0 || is_taken[pair.second]) continue;
    matches[pair.first] = static_cast<int>(pair.second);
    is_taken[pair.second] = true;
  }
  return matches;
}

std::vector<std::vector<int>> MatchLines(const std::vector<PencilObservation>& predicted,
                                         const std::vector<DetectedLine>& lines, double search_px) {
  std::vector<FeaturePair> pairs;
  std::size_t num_predicted = 0;
  for (const PencilObservation& pencil : predicted) {
    for (const LineObservation& line : pencil.lines) {
      for (std::size_t i = 0; i < lines.size(); ++i) {
        const double cost = Unlikeness(Ends(line), lines[i].ends, search_px);
        if (std::isfinite(cost)) pairs.push_back({cost, num_predicted, i});
      }
      ++num_predicted;
    }
  }
  const std::vector<int> all = CheapestPairs(std::move(pairs), num_predicted, lines.size());
  std::vector<std::vector<int>> matches;
  auto next = all.begin();
  for (const PencilObservation& pencil : predicted) {
    const auto end = next + static_cast<std::ptrdiff_t>(pencil.lines.size());
    matches.emplace_back(next, end);
    next = end;
  }
  return matches;
}

PencilObservation FollowPencil(const PencilObservation& predicted,
                               const std::vector<DetectedLine>& lines,
                               const std::vector<int>& matches, double diagonal_px) {
  std::vector<DetectedLine> own;
  for (const int i : matches) {
    if (i >= 0) own.push_back(lines[static_cast<std::size_t>(i)]);
  }
  DetectedPencil pencil;
  if (!own.empty()) {
    std::vector<int> all(own.size());
    std::iota(all.begin(), all.end(), 0);
    pencil.observation.fit = predicted.fit;
    if (!predicted.fit || !RefitPencil(LineSet(own, diagonal_px), all, &pencil)) {
      // One line, or few that do not meet: no direction of their own, but evidence all the same
      // where the pencil has a role.
      std::vector<LineFit> fits;
      for (const DetectedLine& line : own) fits.push_back(line.fit);
      const Eigen::Vector3d direction =
          predicted.fit ? predicted.fit->direction
                        : own[0].fit.line.cross(Eigen::Vector3d::UnitZ()).stableNormalized().eval();
      pencil = MakePencil(own, all, fits, direction);
    }
  }
  Continue(predicted, &pencil.observation);
  return std::move(pencil.observation);
}

void Continue(const PencilObservation& predicted, PencilObservation* pencil) {
  pencil->id = predicted.id;
  if (!predicted.plane.empty()) pencil->plane = predicted.plane;
  if (predicted.direction != PencilDirection::kFree) pencil->direction = predicted.direction;
}

bool IsOfCentres(const Observations& predicted, const PencilObservation& pencil) {
  std::vector<Ellipse> ellipses(predicted.circles.size());
  for (std::size_t i = 0; i < ellipses.size(); ++i) {
    const CircleObservation& circle = predicted.circles[i];
    if (circle.fit) ConicToEllipse(circle.fit->conic, &ellipses[i]);
  }
  const auto is_centre = [&](const Vector2d& pixel) {
    CalibratedPoint p;
    return PixelToCalibrated(predicted.camera, pixel, &p) &&
           std::any_of(ellipses.begin(), ellipses.end(), [&](const Ellipse& e) {
             return (p.x - e.center).norm() < kMaxCentreShare * e.b;
           });
  };
  const auto is_of_centres = [&](const LineObservation& line) {
    return std::all_of(line.points.begin(), line.points.end(), is_centre);
  };
  return !pencil.lines.empty() &&
         std::all_of(pencil.lines.begin(), pencil.lines.end(), is_of_centres);
}

}  // namespace circline
