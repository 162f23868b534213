#include "circline/ransac/detection/structure/circle_grid.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/line.h"
#include "circline/estimators/statistics.h"
#include "circline/estimators/vanishing_point.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t kMinPoints = 6;
constexpr int kMinPointsOfLine = 3;
// Steps are looked for about this many points in the middle, to neighbours up to this many times
// the usual distance of the nearest one (sqrt(2) is the diagonal of a square).
constexpr std::size_t kMiddlePoints = 12;
constexpr double kNeighbourFactor = 1.7;
// A point is where a step leads within this share of its length.
constexpr double kStepTolerance = 0.2;
// The steps of a lattice are this far from parallel (a sine).
constexpr double kMinStepSine = 0.5;
// Share of the points that must lie on the lattice.
constexpr double kMinShare = 0.5;
// Circles of one grid are of one size, within this factor.
constexpr double kSizeFactor = 1.25;
// No centre is known better than this, whatever the scatter of a few says, pixels.
constexpr double kMinCentreSigmaPx = 0.03;

class LatticeFinder {
 public:
  explicit LatticeFinder(const std::vector<Vector2d>& points) : points_(points) {}

  PointLattice Find() {
    PointLattice lattice;
    if (points_.size() < kMinPoints || !ChooseSteps()) return lattice;
    LabelLargest();
    const double n = static_cast<double>(points_.size());
    if (place_.size() < kMinPoints || static_cast<double>(place_.size()) < kMinShare * n) {
      return lattice;
    }
    lattice.lines = {LinesAlong(0), LinesAlong(1)};
    return lattice;
  }

 private:
  using Place = std::array<int, 2>;  // In steps.

  // The point that is nearest to where the step leads from point i; -1 if there is none.
  int After(std::size_t i, const Vector2d& step) const {
    int nearest = -1;
    double smallest = kStepTolerance * kStepTolerance * step.squaredNorm();
    for (std::size_t j = 0; j < points_.size(); ++j) {
      const double d = (points_[j] - points_[i] - step).squaredNorm();
      if (d >= smallest) continue;
      smallest = d;
      nearest = static_cast<int>(j);
    }
    return nearest;
  }

  // Points in the order of their distance to the middle one.
  std::vector<std::size_t> FromTheMiddle() const {
    std::vector<double> x, y;
    for (const Vector2d& p : points_) {
      x.push_back(p.x());
      y.push_back(p.y());
    }
    const Vector2d middle(Median(std::move(x)), Median(std::move(y)));
    std::vector<std::size_t> order(points_.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return (points_[a] - middle).squaredNorm() < (points_[b] - middle).squaredNorm();
    });
    return order;
  }

  double UsualDistance() const {
    std::vector<double> nearest;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      double smallest = 1e300;
      for (std::size_t j = 0; j < points_.size(); ++j) {
        if (i != j) smallest = std::min(smallest, (points_[i] - points_[j]).squaredNorm());
      }
      nearest.push_back(std::sqrt(smallest));
    }
    return Median(std::move(nearest));
  }

  // The two steps that most points can take; of equally good ones the shorter.
  bool ChooseSteps() {
    struct Step {
      Vector2d step;
      int support;
      double merit;
    };
    std::vector<Step> steps;
    const double n = static_cast<double>(points_.size());
    const double reach = kNeighbourFactor * UsualDistance();
    const std::vector<std::size_t> order = FromTheMiddle();
    for (std::size_t k = 0; k < std::min(kMiddlePoints, order.size()); ++k) {
      for (std::size_t j = 0; j < points_.size(); ++j) {
        const Vector2d step = points_[j] - points_[order[k]];
        if (j == order[k] || step.norm() > reach) continue;
        int support = 0;
        for (std::size_t i = 0; i < points_.size(); ++i) support += After(i, step) >= 0 ? 1 : 0;
        // A diagonal step is nearly as common: the whole reach costs three tenths of the points.
        steps.push_back({step, support, support - n * 0.3 * step.norm() / reach});
      }
    }
    std::stable_sort(steps.begin(), steps.end(),
                     [](const Step& a, const Step& b) { return a.merit > b.merit; });
    for (const Step& s : steps) {
      const Step& first = steps.front();
      const double sine = std::abs(Cross(first.step, s.step)) / (first.step.norm() * s.step.norm());
      if (sine < kMinStepSine) continue;
      steps_ = {first.step, s.step};
      return first.support >= kMinPointsOfLine && s.support >= kMinPointsOfLine;
    }
    return false;
  }

  // Places of the largest set of points that steps connect.
  void LabelLargest() {
    std::vector<std::uint8_t> seen(points_.size(), 0);
    for (const std::size_t start : FromTheMiddle()) {
      if (seen[start]) continue;
      const std::map<int, Place> component = LabelFrom(static_cast<int>(start));
      for (const auto& [i, place] : component) seen[static_cast<std::size_t>(i)] = 1;
      if (component.size() > place_.size()) place_ = component;
    }
  }

  std::map<int, Place> LabelFrom(int start) const {
    std::map<int, Place> place = {{start, {0, 0}}};
    std::vector<int> queue = {start};
    for (std::size_t k = 0; k < queue.size(); ++k) {
      const int i = queue[k];
      const Place here = place[i];
      for (std::size_t axis = 0; axis < 2; ++axis) {
        for (const int sign : {-1, 1}) {
          const int j = After(static_cast<std::size_t>(i), sign * steps_[axis]);
          if (j < 0) continue;
          Place there = here;
          there[axis] += sign;
          if (place.emplace(j, there).second) queue.push_back(j);
        }
      }
    }
    return place;
  }

  // Points of one place across, in the order of their places along `axis`.
  std::vector<std::vector<int>> LinesAlong(std::size_t axis) const {
    std::map<int, std::vector<std::pair<int, int>>> by_line;
    for (const auto& [i, place] : place_) {
      by_line[place[1 - axis]].emplace_back(place[axis], i);
    }
    std::vector<std::vector<int>> lines;
    for (auto& [across, members] : by_line) {
      if (static_cast<int>(members.size()) < kMinPointsOfLine) continue;
      std::sort(members.begin(), members.end());
      std::vector<int> line;
      for (const auto& [along, i] : members) line.push_back(i);
      lines.push_back(std::move(line));
    }
    return lines;
  }

  const std::vector<Vector2d>& points_;
  std::array<Vector2d, 2> steps_;
  std::map<int, Place> place_;
};

// Image of the centre of a circle on a plane: the pole of the plane's vanishing line.
Vector3d CentreRay(const Matrix3d& conic, const Vector3d& normal) {
  const Vector3d ray = conic.inverse() * normal;
  return ray / ray.z();
}

// Distance over radius, for the pose of the circle that is nearest to the plane.
double RelativeDistance(const Matrix3d& conic, const Vector3d& normal) {
  std::array<CirclePose, 2> poses;
  const int count = CirclePoses(conic, &poses);
  double best = -1.0, distance = 0.0;
  for (int k = 0; k < count; ++k) {
    const CirclePose& pose = poses[static_cast<std::size_t>(k)];
    const double agreement = std::abs(pose.normal.dot(normal));
    if (agreement <= best) continue;
    best = agreement;
    distance = std::abs(pose.normal.dot(pose.center));
  }
  return distance;
}

// Circles of one size on the plane and their centres, in plane coordinates at unit distance.
struct PlaneCentres {
  std::vector<int> circles;
  std::vector<Vector2d> points;
};

// The value that most others are within kSizeFactor of.
double Commonest(const std::vector<double>& values) {
  double best = 0.0;
  std::ptrdiff_t most = 0;
  for (const double value : values) {
    const std::ptrdiff_t count = std::count_if(values.begin(), values.end(), [value](double other) {
      return other < kSizeFactor * value && value < kSizeFactor * other;
    });
    if (count <= most) continue;
    most = count;
    best = value;
  }
  return best;
}

PlaneCentres LayOut(const std::vector<Matrix3d>& circles, const Vector3d& normal) {
  // The plane at unit distance: a circle `d` radii from the camera centre has radius 1 / d there.
  std::vector<double> distances;
  for (const Matrix3d& circle : circles) distances.push_back(RelativeDistance(circle, normal));
  const double usual = Commonest(distances);
  const Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  PlaneCentres centres;
  for (std::size_t i = 0; i < circles.size(); ++i) {
    const double ratio = distances[i] / usual;
    if (!(ratio < kSizeFactor && ratio > 1.0 / kSizeFactor)) continue;
    const Vector3d ray = CentreRay(circles[i], normal);
    const double depth = normal.dot(ray);
    if (!ray.allFinite() || std::abs(depth) < 1e-6) continue;
    centres.circles.push_back(static_cast<int>(i));
    centres.points.emplace_back(u.dot(ray) / depth, v.dot(ray) / depth);
  }
  return centres;
}

// The lines of one direction of the lattice as a pencil; none where fewer than two can be fitted.
std::optional<DetectedPencil> MakePencil(const Camera& camera, const std::vector<Matrix3d>& circles,
                                         const std::vector<std::vector<int>>& lines,
                                         const Vector3d& normal) {
  DetectedPencil pencil;
  double squares = 0.0, freedom = 0.0;
  for (const std::vector<int>& members : lines) {
    LineObservation line;
    std::vector<CalibratedPoint> calibrated;
    for (const int i : members) {
      Vector2d pixel;
      CalibratedPoint point;
      const Vector3d ray = CentreRay(circles[static_cast<std::size_t>(i)], normal);
      if (!CameraToPixel(camera, ray, &pixel)) continue;
      if (!PixelToCalibrated(camera, pixel, &point)) continue;
      line.points.push_back(pixel);
      calibrated.push_back(point);
    }
    LineFit fit;
    if (calibrated.size() < 3 || !FitLine(calibrated, 1.0, &fit).ok()) continue;
    const double n = static_cast<double>(calibrated.size());
    squares += n * fit.rms_px * fit.rms_px;
    freedom += n - 2.0;
    line.fit = fit;
    pencil.ends.push_back({line.points.front(), line.points.back()});
    pencil.support_px += (line.points.back() - line.points.front()).norm();
    pencil.observation.lines.push_back(std::move(line));
  }
  if (pencil.observation.lines.size() < 2) return std::nullopt;
  const double sigma = std::max(kMinCentreSigmaPx, std::sqrt(squares / freedom));
  pencil.observation.sigma_px = sigma;
  std::vector<LineFit> fits;
  for (LineObservation& line : pencil.observation.lines) {
    line.fit->covariance *= sigma * sigma;
    fits.push_back(*line.fit);
  }
  VanishingPointFit fit;
  if (!FitVanishingPoint(fits, &fit).ok()) return std::nullopt;
  pencil.observation.fit = fit;
  return pencil;
}

}  // namespace

PointLattice FindLattice(const std::vector<Vector2d>& points) {
  return LatticeFinder(points).Find();
}

std::vector<DetectedPencil> FindGridPencils(const Camera& camera,
                                            const std::vector<Matrix3d>& circles,
                                            const Vector3d& normal) {
  if (circles.size() < kMinPoints) return {};
  const PlaneCentres centres = LayOut(circles, normal);
  PointLattice lattice = FindLattice(centres.points);
  for (auto& direction : lattice.lines) {
    for (std::vector<int>& line : direction) {
      for (int& i : line) i = centres.circles[static_cast<std::size_t>(i)];
    }
  }
  std::vector<DetectedPencil> pencils;
  // The centres' images depend a little on the normal, and their lines know it better.
  Vector3d n = normal;
  for (int pass = 0; pass < 2; ++pass) {
    pencils.clear();
    for (const auto& lines : lattice.lines) {
      std::optional<DetectedPencil> pencil = MakePencil(camera, circles, lines, n);
      if (pencil) pencils.push_back(std::move(*pencil));
    }
    if (pencils.size() < 2) break;
    n = pencils[0].observation.fit->direction.cross(pencils[1].observation.fit->direction);
    n.normalize();
  }
  return pencils;
}

}  // namespace circline
