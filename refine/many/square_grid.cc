#include "circline/refine/many/square_grid.h"

#include <ceres/autodiff_cost_function.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/noise_model.h"
#include "circline/refine/camera_shifts.h"

namespace circline {
namespace {

// Where a line of the plane lies across its direction, in distances of the plane.
struct PlaneOffset {
  std::size_t pencil, line;
  double offset, variance;
};
using Offsets = std::vector<PlaneOffset>;

// False where the line is not seen on the plane.
bool OffsetOf(const Observations& photo, const LineObservation& line, const Eigen::Matrix3d& R,
              int axis, PlaneOffset* out) {
  std::vector<CalibratedPoint> points;
  CalibrateInliers(photo.camera, line.points, line.inliers, &points);
  if (points.empty()) return false;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const CalibratedPoint& p : points) middle += p.x.homogeneous();
  const Eigen::Vector3d& l = line.fit->line;
  const Eigen::Vector3d q = middle / middle.z() - l.dot(middle / middle.z()) * l;
  const Eigen::Vector3d n = -R.col(2), across = R.col(axis);  // Away from the camera.
  const double depth = n.dot(q);
  constexpr double kHorizon = 0.01;
  if (!(depth > kHorizon * q.norm())) return false;
  out->offset = across.dot(q) / depth;
  const double slope = (across.dot(l) - out->offset * n.dot(l)) / depth;
  out->variance = slope * slope * q.dot(line.fit->covariance * q);
  return std::isfinite(out->offset) && out->variance > 0.0;
}

// Of the lines across an axis of the world: those that run along the other one. Sorted.
Offsets OffsetsAlong(const Observations& photo, const Eigen::Matrix3d& R, int axis) {
  Offsets offsets;
  for (std::size_t i = 0; i < photo.pencils.size(); ++i) {
    const PencilObservation& pencil = photo.pencils[i];
    const PencilDirection along = axis == 1 ? PencilDirection::kX : PencilDirection::kY;
    if (!pencil.fit || pencil.direction != along) continue;
    for (std::size_t j = 0; j < pencil.lines.size(); ++j) {
      PlaneOffset made{i, j, 0.0, 0.0};
      if (pencil.lines[j].fit && OffsetOf(photo, pencil.lines[j], R, axis, &made))
        offsets.push_back(made);
    }
  }
  std::sort(offsets.begin(), offsets.end(),
            [](const PlaneOffset& a, const PlaneOffset& b) { return a.offset < b.offset; });
  return offsets;
}

// One for all pieces of a line.
Offsets Merged(const Offsets& sorted) {
  Offsets merged;
  for (const PlaneOffset& o : sorted) {
    if (!merged.empty()) {
      PlaneOffset& last = merged.back();
      const double variance = last.variance + o.variance;
      if (std::abs(o.offset - last.offset) < kInlierSigmas * std::sqrt(variance)) {
        last.offset = (last.offset * o.variance + o.offset * last.variance) / variance;
        last.variance *= o.variance / variance;
        continue;
      }
    }
    merged.push_back(o);
  }
  return merged;
}

double NearestPlace(const PlaneOffset& o, double first, double square) {
  return std::round((o.offset - first) / square);
}

// How much likelier lines are on such a grid, whose places they miss by Gaussians and every other
// of which has one, than anywhere. Sorted.
double LogOdds(const Offsets& offsets, double first, double square) {
  constexpr double kOnGrid = 0.5;  // Share of the lines; and of the places that are seen.
  double odds = 0.0;
  std::optional<double> last;
  for (const PlaneOffset& o : offsets) {
    const double sigma = std::sqrt(o.variance / (square * square) + kLooseOnGrid * kLooseOnGrid);
    const double place = NearestPlace(o, first, square);
    const double miss = ((o.offset - first) / square - place) / sigma;
    const double on_grid = std::exp(-0.5 * miss * miss) / (std::sqrt(2.0 * kPi) * sigma);
    odds += std::log(1.0 - kOnGrid + kOnGrid * on_grid);
    if (on_grid < 1.0) continue;
    if (last) odds += std::log(1.0 - kOnGrid) * std::max(0.0, place - *last - 1.0);
    last = place;
  }
  return odds;
}

// offset = first + place * square.
struct Found {
  double log_odds = 0.0, square = 0.0;
  std::array<double, 2> first{};  // By axis.
};

// Least squares of lines at their places along an axis. False where these are too few.
bool Refit(const Offsets& offsets, double* first, double* square) {
  Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  for (const PlaneOffset& o : offsets) {
    const Eigen::Vector2d row(1.0, NearestPlace(o, *first, *square));
    const double weight = 1.0 / (o.variance + kLooseOnGrid * kLooseOnGrid * *square * *square);
    A += weight * row * row.transpose();
    b += weight * o.offset * row;
  }
  constexpr double kOnePlace = 1e-9;
  if (!(A.determinant() > kOnePlace * A.trace() * A.trace())) return false;
  const Eigen::Vector2d fit = A.inverse() * b;
  *first = fit[0];
  *square = fit[1];
  return fit.allFinite() && *square > 0.0;
}

// The grid that two neighbours start, taken on from line to line, the nearest first.
bool Grow(const Offsets& offsets, double* first, double* square) {
  constexpr double kReach = 0.12;  // Squares.
  Offsets by_distance = offsets, taken;
  const double start = *first;
  std::sort(by_distance.begin(), by_distance.end(), [&](const auto& a, const auto& b) {
    return std::abs(a.offset - start) < std::abs(b.offset - start);
  });
  for (const PlaneOffset& o : by_distance) {
    if (std::abs(o.offset - *first - NearestPlace(o, *first, *square) * *square) > kReach * *square)
      continue;
    taken.push_back(o);
    if (taken.size() > 2 && !Refit(taken, first, square)) return false;
  }
  return true;
}

// The best grid that two neighbours across the X axis start, and lines across the Y axis in squares
// of that size.
Found Search(const Offsets& x, const Offsets& y) {
  constexpr std::size_t kNeighbours = 3;
  constexpr double kMostSquares = 100.0;  // Of all lines; boards have fewer.
  Found best;
  int tried = 1;
  for (std::size_t i = 0; i < x.size(); ++i) {
    for (std::size_t j = i + 1; j < std::min(x.size(), i + 1 + kNeighbours); ++j) {
      Found made;
      made.first[0] = x[i].offset;
      made.square = x[j].offset - x[i].offset;
      ++tried;
      const double finest = (x.back().offset - x.front().offset) / kMostSquares;
      if (made.square < finest || !Grow(x, &made.first[0], &made.square) || made.square < finest)
        continue;
      double most = -1.0;
      for (const PlaneOffset& o : y) {
        const double odds = LogOdds(y, o.offset, made.square);
        if (odds <= most) continue;
        most = odds;
        made.first[1] = o.offset;
      }
      made.log_odds = LogOdds(x, made.first[0], made.square) + most;
      if (made.log_odds > best.log_odds) best = made;
    }
  }
  best.log_odds -= std::log(static_cast<double>(tried) * static_cast<double>(y.size() + 1));
  return best;
}

// Gives lines their places across an axis, from 0; returns the offset of 0.
double SetPlaces(const Offsets& offsets, double first, double square, SquareGrid* grid) {
  std::vector<std::pair<const PlaneOffset*, int>> on_grid;
  int least = std::numeric_limits<int>::max(), most = std::numeric_limits<int>::min();
  for (const PlaneOffset& o : offsets) {
    const int place = static_cast<int>(NearestPlace(o, first, square));
    const double sigma = std::sqrt(o.variance + kLooseOnGrid * kLooseOnGrid * square * square);
    if (std::abs(o.offset - first - place * square) > kInlierSigmas * sigma) continue;
    on_grid.emplace_back(&o, place);
    least = std::min(least, place);
    most = std::max(most, place);
  }
  if (on_grid.empty()) return first;
  for (const auto& [o, place] : on_grid) grid->places[{o->pencil, o->line}] = place - least;
  grid->width = std::max(grid->width, most - least);
  return first + least * square;
}

}  // namespace

int AxisAcross(const PencilObservation& pencil) {
  return pencil.direction == PencilDirection::kX ? 1 : 0;
}

void SquareGrid::Remove(const Observations& photo, int axis, int place) {
  for (auto at = places.begin(); at != places.end();) {
    const bool is_it = at->second == place && AxisAcross(photo.pencils[at->first.first]) == axis;
    at = is_it ? places.erase(at) : std::next(at);
  }
}

bool SquareGrid::HasBothAxes(const Observations& photo) const {
  std::array<std::set<int>, 2> kept;
  for (const auto& [at, place] : places)
    kept[static_cast<std::size_t>(AxisAcross(photo.pencils[at.first]))].insert(place);
  constexpr std::size_t kFewest = 4;
  return std::min(kept[0].size(), kept[1].size()) >= kFewest;
}

std::optional<SquareGrid> FindSquareGrid(const Observations& photo,
                                         const Eigen::Matrix3d& rotation) {
  constexpr double kSure = 15.0;  // Of log odds.
  const std::array<Offsets, 2> offsets = {OffsetsAlong(photo, rotation, 0),
                                          OffsetsAlong(photo, rotation, 1)};
  const Found best = Search(Merged(offsets[0]), Merged(offsets[1]));
  if (best.log_odds < kSure) return std::nullopt;
  SquareGrid grid;
  Eigen::Vector3d origin = -rotation.col(2);
  for (const std::size_t axis : {0U, 1U}) {
    origin += SetPlaces(offsets[axis], best.first[axis], best.square, &grid) *
              rotation.col(static_cast<Eigen::Index>(axis));
  }
  if (!grid.HasBothAxes(photo)) return std::nullopt;
  grid.cam_from_board = {rotation, origin / best.square};
  return grid;
}

namespace {

struct GridLineResidual {
  Camera camera;
  Eigen::Vector3d fit;
  Eigen::Vector2d middle;
  bool line_deviates;
  int axis;
  double place, sigma;

  template <typename T>
  bool operator()(const T* q, const T* t, const T* direction, const T* line, const T* off,
                  const T* shifts, T* residual) const {
    using std::cos;
    using std::isfinite;
    using std::sin;
    using Vector = Eigen::Matrix<T, 3, 1>;
    using Block = Eigen::Map<const Vector>;
    const Eigen::Matrix<T, 3, 3> R =
        Eigen::Map<const Eigen::Quaternion<T>>(q).normalized().toRotationMatrix();
    // As DirectionLineCost has it.
    const Vector d = R * Block(direction).normalized();
    const Vector seen = ShiftedLine(camera, shifts, fit),
                 point = ShiftedPoint(camera, shifts, middle);
    Vector m = seen - d.dot(seen) * d;
    m.normalize();
    Vector l = cos(line[0]) * m + sin(line[0]) * d.cross(m);
    if (line_deviates) l += line[1] * d;
    const Vector ray = point - (l.dot(point) / l.squaredNorm()) * l;
    const Vector n = R.col(2);
    const Vector in_camera = (n.dot(Block(t)) / n.dot(ray)) * ray;
    residual[0] = (R.col(axis).dot(in_camera - Block(t)) - place - off[0]) / sigma;
    return isfinite(residual[0]);
  }
};

}  // namespace

ceres::CostFunction* NewGridLinePrior(const Camera& camera, const Eigen::Vector3d& fit,
                                      const Eigen::Vector2d& middle, bool line_deviates, int axis,
                                      int place, double sigma) {
  auto* residual = new GridLineResidual{camera, fit.normalized(),           middle, line_deviates,
                                        axis,   static_cast<double>(place), sigma};
  if (line_deviates)
    return new ceres::AutoDiffCostFunction<GridLineResidual, 1, 4, 3, 3, 2, 1, kCameraSize>(
        residual);
  return new ceres::AutoDiffCostFunction<GridLineResidual, 1, 4, 3, 3, 1, 1, kCameraSize>(residual);
}

}  // namespace circline
