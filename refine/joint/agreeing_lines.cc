#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/estimators/circle_planes.h"
#include "circline/refine/joint/readings.h"

namespace circline {
namespace {

// A line of a pencil along X or Y.
struct AxisLine {
  std::size_t feature;
  int pencil, axis;  // 0: X, 1: Y.
  Eigen::Vector3d line;
  Eigen::Matrix3d covariance;
};

std::vector<AxisLine> LinesAlongAxes(const JointProblem& problem) {
  std::vector<AxisLine> lines;
  for (std::size_t i = 0; i < problem.features().size(); ++i) {
    const Feature& f = problem.features()[i];
    if (f.kind != Feature::Kind::kLine || f.line < 0) continue;
    const PencilObservation& pencil =
        problem.observations().pencils[static_cast<std::size_t>(f.observation)];
    if (pencil.direction != PencilDirection::kX && pencil.direction != PencilDirection::kY)
      continue;
    const LineFit& fit = *problem.LineOf(f).fit;
    lines.push_back(
        {i, f.observation, static_cast<int>(pencil.direction), fit.line, fit.covariance});
  }
  return lines;
}

// A seed at a plane of its own circle.
struct PlaneSeed {
  Seed seed;
  Eigen::Matrix3d covariance;  // CirclePlane's.
};

std::vector<PlaneSeed> CirclePlaneSeeds(const JointProblem& problem,
                                        const std::vector<Seed>& seeds) {
  std::vector<PlaneSeed> found;
  for (const Seed& seed : seeds) {
    constexpr int kBestCircle = -1;  // Seed::source.
    if (seed.source != kBestCircle || seed.log_focal != 0.0) continue;
    std::array<CirclePlane, 2> planes;
    const ConicFit& fit =
        *problem.observations().circles[static_cast<std::size_t>(seed.circle)].fit;
    const int count = CirclePlanes(fit, &planes);
    if (count == 0) continue;
    const auto off = [&seed](const CirclePlane& plane) {
      return plane.pose.normal.cross(seed.pose.rotation.col(2)).squaredNorm();
    };
    const CirclePlane& plane =
        count == 2 && off(planes[1]) < off(planes[0]) ? planes[1] : planes[0];
    found.push_back({seed, plane.covariance});
  }
  return found;
}

// The seed turned about its normal such that the line runs along its axis; the senses of the axes
// as drawn, or X to the right (WorldRotation). False where the line does not say.
bool Turn(const AxisLine& line, const FrameObservation& frame, Seed* seed) {
  Eigen::Matrix3d& R = seed->pose.rotation;
  const Eigen::Vector3d along = R.transpose() * R.col(2).cross(line.line);
  if (!(along.head<2>().norm() > 0.0)) return false;
  double angle = std::atan2(along.y(), along.x()) - (line.axis == 1 ? 0.5 * kPi : 0.0);
  angle = std::remainder(angle, kPi);
  R = R * Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ());
  if (!frame.x_axis && !frame.y_axis && R(0, 0) < 0.0)
    R = R * Eigen::AngleAxisd(kPi, Eigen::Vector3d::UnitZ());
  return true;
}

// By how much `other` deviates from its axis where `line` fixes the turn, standard deviations: of
// the plane's normal, of both lines, and of the noise model.
double Deviation(const PlaneSeed& plane, const NoiseModel& noise, const AxisLine& line,
                 const AxisLine& other) {
  const Eigen::Vector3d n = plane.seed.pose.rotation.col(2);
  const Eigen::Vector3d &l = line.line, &k = other.line;
  const double size = n.cross(l).norm();
  if (!(size > 0.0)) return std::numeric_limits<double>::infinity();
  Eigen::Vector3d along, by_normal, by_line;
  double squares = 2.0 * noise.line_direction_rad * noise.line_direction_rad;
  if (line.axis == other.axis) {
    along = n.cross(l);
    by_normal = l.cross(k);
    by_line = k.cross(n);
  } else {
    along = n.dot(l) * n - l;  // n x (n x l).
    by_normal = n.dot(l) * k + n.dot(k) * l;
    by_line = n.dot(k) * n - k;
  }
  if (line.pencil != other.pencil) squares += 2.0 * noise.pencil_axis_rad * noise.pencil_axis_rad;
  const double variance = by_normal.dot(plane.covariance * by_normal) +
                          by_line.dot(line.covariance * by_line) +
                          along.dot(other.covariance * along);
  return std::abs(along.dot(k)) / std::sqrt(variance + size * size * squares);
}

}  // namespace

void KeepFullest(std::size_t most, std::vector<AgreeingLines>* readings) {
  const auto size = [](const AgreeingLines& lines) {
    return std::count(lines.reading.begin(), lines.reading.end(), 1);
  };
  std::stable_sort(
      readings->begin(), readings->end(),
      [&](const AgreeingLines& a, const AgreeingLines& b) { return size(a) > size(b); });
  readings->resize(std::min(readings->size(), most));
}

std::vector<AgreeingLines> FindAgreeingLines(const JointProblem& problem,
                                             const std::vector<Seed>& seeds,
                                             std::size_t max_readings) {
  constexpr std::size_t kMost = 20;  // Of more, fits of their pencils tell; for time, not tuned.
  const std::vector<AxisLine> lines = LinesAlongAxes(problem);
  if (lines.size() > kMost) return {};
  const std::vector<PlaneSeed> planes = CirclePlaneSeeds(problem, seeds);
  const Reading everything(problem.features().size(), 1);
  std::vector<AgreeingLines> found;
  for (const AxisLine& line : lines) {
    std::vector<Seed> turned;
    for (const PlaneSeed& plane : planes) {
      Seed seed = plane.seed;
      if (Turn(line, problem.observations().frame, &seed)) turned.push_back(seed);
    }
    for (const PlaneSeed& plane : planes) {
      AgreeingLines agreeing{everything, {}};
      for (const AxisLine& other : lines) {
        const bool agrees = &other == &line || Deviation(plane, problem.options().noise_model, line,
                                                         other) <= kInlierSigmas;
        agreeing.reading[other.feature] = agrees ? 1 : 0;
      }
      const bool is_known = std::any_of(found.begin(), found.end(), [&](const AgreeingLines& a) {
        return a.reading == agreeing.reading;
      });
      if (is_known || agreeing.reading == everything) continue;
      agreeing.seeds = turned;
      found.push_back(std::move(agreeing));
    }
  }
  KeepFullest(max_readings, &found);
  return found;
}

}  // namespace circline
