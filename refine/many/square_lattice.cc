#include "circline/refine/many/square_lattice.h"

#include <ceres/autodiff_cost_function.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/refine/many/square_grid.h"

namespace circline {
namespace {

// Points of the plane, and places with whole coordinates: z = origin + place * side.
using Complex = std::complex<double>;

struct Point {
  Complex z;
  double radius;
  const std::string* id;
};

// The least squares of points at their places.
class LatticeFit {
 public:
  void Add(const Complex& place, const Complex& z) {
    count_ += 1.0;
    places_ += place;
    points_ += z;
    squares_ += std::norm(place);
    products_ += std::conj(place) * z;
  }
  // False where all are at one place.
  bool Solve(Complex* origin, Complex* side) const {
    const double spread = count_ * squares_ - std::norm(places_);
    if (!(spread > 0.5)) return false;  // Whole numbers.
    *side = (count_ * products_ - std::conj(places_) * points_) / spread;
    *origin = (points_ - places_ * *side) / count_;
    return true;
  }

 private:
  double count_ = 0.0, squares_ = 0.0;
  Complex places_, points_, products_;
};

struct Frame {
  Complex origin, side;

  Complex At(const Complex& z) const { return (z - origin) / side; }
};

Complex Nearest(const Complex& at) { return {std::round(at.real()), std::round(at.imag())}; }

std::vector<Point> ByDistance(std::vector<Point> points, const Complex& from) {
  std::sort(points.begin(), points.end(), [&](const Point& a, const Point& b) {
    return std::norm(a.z - from) < std::norm(b.z - from);
  });
  return points;
}

// The frame that two neighbours start, taken on from circle to circle, the nearest first.
Frame Grown(const std::vector<Point>& by_distance, Frame frame) {
  constexpr double kReach = 0.12;  // Squares.
  LatticeFit fit;
  for (const Point& point : by_distance) {
    const Complex at = frame.At(point.z), place = Nearest(at);
    if (std::abs(at - place) > kReach) continue;
    fit.Add(place, point.z);
    fit.Solve(&frame.origin, &frame.side);
  }
  return frame;
}

// How much likelier the circles are half of them on the lattice, about whose places they have
// Gaussians and half of which are taken, half anywhere, than all anywhere. Two circles are on a
// lattice in any case.
double LogOdds(const std::vector<Point>& points, const Frame& frame) {
  constexpr double kOnLattice = 0.5;  // Share of the circles; and of the places.
  constexpr double kPeak = 1.0 / (2.0 * kPi * kLooseOnGrid * kLooseOnGrid);
  double odds = -2.0 * std::log(kPeak), num_on = 0.0;
  Eigen::AlignedBox2d box;
  for (const Point& point : points) {
    const Complex at = frame.At(point.z), place = Nearest(at);
    const double square = std::norm(at - place) / (kLooseOnGrid * kLooseOnGrid);
    const double on = kPeak * std::exp(-0.5 * square);
    odds += std::log(1.0 - kOnLattice + kOnLattice * on);
    if (on < 1.0) continue;
    num_on += 1.0;
    box.extend(Eigen::Vector2d(place.real(), place.imag()));
  }
  const double places = box.isEmpty() ? 0.0 : (box.sizes().array() + 1.0).prod();
  return odds + std::log(1.0 - kOnLattice) * std::max(0.0, places - num_on);
}

struct LatticeResidual {
  double column, row, sigma;

  template <typename T>
  bool operator()(const T* center, const T* origin, const T* side, T* residual) const {
    residual[0] = (center[0] - origin[0] - column * side[0] + row * side[1]) / sigma;
    residual[1] = (center[1] - origin[1] - column * side[1] - row * side[0]) / sigma;
    return true;
  }
};

// The middle one of all, and each circle's nearest neighbours as its side, as many as are tried.
Frame BestFrame(const std::vector<Point>& points, double* log_odds) {
  constexpr std::size_t kSeeds = 30, kNeighbours = 4;
  Complex middle;
  for (const Point& point : points) middle += point.z / static_cast<double>(points.size());
  const std::vector<Point> seeds = ByDistance(points, middle);
  Frame best;
  *log_odds = 0.0;
  int tried = 1;
  for (std::size_t i = 0; i < std::min(kSeeds, seeds.size()); ++i) {
    const std::vector<Point> near = ByDistance(points, seeds[i].z);
    for (std::size_t k = 1; k < std::min(kNeighbours + 1, near.size()); ++k) {
      const Complex side = near[k].z - near[0].z;
      // Circles about one centre are no neighbours.
      if (!(std::abs(side) > near[0].radius)) continue;
      ++tried;
      const Frame frame = Grown(near, {near[0].z, side});
      const double odds = LogOdds(points, frame);
      if (odds <= *log_odds) continue;
      *log_odds = odds;
      best = frame;
    }
  }
  *log_odds -= std::log(static_cast<double>(tried));
  return best;
}

}  // namespace

int SquareLattice::Width() const {
  if (circles.empty()) return 0;
  int columns[2] = {circles.begin()->first.first, circles.begin()->first.first};
  int rows[2] = {circles.begin()->first.second, circles.begin()->first.second};
  for (const auto& [place, id] : circles) {
    columns[0] = std::min(columns[0], place.first);
    columns[1] = std::max(columns[1], place.first);
    rows[0] = std::min(rows[0], place.second);
    rows[1] = std::max(rows[1], place.second);
  }
  return std::max(columns[1] - columns[0], rows[1] - rows[0]);
}

bool SquareLattice::Fit(const Layout& layout, Eigen::Vector2d* origin,
                        Eigen::Vector2d* side) const {
  LatticeFit fit;
  for (const auto& [place, id] : circles) {
    const auto at = layout.find(id);
    if (at == layout.end()) continue;
    const Eigen::Vector2d& z = at->second.center;
    fit.Add(Complex(place.first, place.second), {z.x(), z.y()});
  }
  Frame frame;
  if (!fit.Solve(&frame.origin, &frame.side)) return false;
  *origin = {frame.origin.real(), frame.origin.imag()};
  *side = {frame.side.real(), frame.side.imag()};
  return true;
}

SquareLattice FindSquareLattice(const Layout& layout) {
  constexpr double kSure = 15.0;  // Of log odds.
  constexpr double kReach = 3.0;  // Standard deviations.
  std::vector<Point> points;
  for (const auto& [id, circle] : layout)
    points.push_back({{circle.center.x(), circle.center.y()}, circle.radius, &id});
  double log_odds = 0.0;
  const Frame frame = BestFrame(points, &log_odds);
  SquareLattice lattice;
  if (log_odds < kSure) return lattice;
  std::sort(points.begin(), points.end(),
            [](const Point& a, const Point& b) { return a.radius > b.radius; });
  for (const Point& point : points) {
    const Complex at = frame.At(point.z), place = Nearest(at);
    if (std::abs(at - place) > kReach * kLooseOnGrid) continue;
    const std::pair<int, int> where(static_cast<int>(place.real()), static_cast<int>(place.imag()));
    lattice.circles.emplace(where, *point.id);
  }
  if (!lattice.HasEnough()) lattice.circles.clear();
  return lattice;
}

ceres::CostFunction* NewLatticePrior(const std::pair<int, int>& place, double sigma) {
  return new ceres::AutoDiffCostFunction<LatticeResidual, 2, 2, 2, 2>(
      new LatticeResidual{1.0 * place.first, 1.0 * place.second, sigma});
}

}  // namespace circline
