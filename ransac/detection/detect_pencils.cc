#include "circline/ransac/detection/detect_pencils.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <optional>
#include <utility>

#include "circline/ransac/detection/orthogonal_evidence.h"
#include "circline/ransac/detection/segment_meetings.h"
#include "circline/ransac/robust_pencils.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Lines that are parallel in space miss their common direction by more than edges explain: in old
// streets and on hand-made things by a third of a degree, on paper that bends by more. The search
// allows for this much, and the fit for more where the lines are known to be of one thing; it
// estimates how much it is, but not below what lens and calibration leave. Radians.
constexpr double kSearchSigmaRad = 3e-3;
constexpr double kExactSigmaRad = 5e-4;
constexpr double kMinSpreadRad = 2e-4;
constexpr double kMaxSpreadRad = 12e-3;
// For so many of the longest pencils, so many are searched among the lines that meet theirs.
constexpr std::size_t kMaxSearchedAround = 3;
constexpr int kFoundAround = 2;
// The two sides of a thin line are so near to each other, a share of the photo's diagonal.
constexpr double kTwinShareOfPhoto = 4.0 / kUsualDiagonalPx;
// What all points of a line share, pixels: no number of them averages it out. It turns short lines
// by more than long ones; measured on the sides of chessboard squares.
constexpr double kSharedErrorPx = 0.06;

// Detected lines with what the search for pencils knows of them.
struct LineSet {
  LineSet(const std::vector<DetectedLine>& detected, double photo_px)
      : lines(detected), diagonal_px(photo_px), twin_of(FindTwins(detected, photo_px)) {
    for (const DetectedLine& line : lines) fits.push_back(WithSharedError(line, kSharedErrorPx));
  }
  bool IsTwin(int i) const { return twin_of[static_cast<std::size_t>(i)] >= 0; }
  // Twins count once.
  int Count(const std::vector<int>& members) const {
    return static_cast<int>(
        std::count_if(members.begin(), members.end(), [this](int i) { return !IsTwin(i); }));
  }

  const std::vector<DetectedLine>& lines;
  double diagonal_px;         // Of the photo.
  std::vector<LineFit> fits;  // With the shared error.
  std::vector<int> twin_of;
};

// Fits the direction of one pencil to what it can have of all lines.
class PencilFitter {
 public:
  PencilFitter(const LineSet& set, double max_spread_rad)
      : set_(set), max_spread_(max_spread_rad) {}

  // The search finds what roughly shares a direction. Here the scatter of the lines about it is
  // estimated and the direction fitted to those of `candidates` within it, each with its own
  // covariance and the common scatter: the lines of a printed board all count for what they were
  // measured, those of an old street, each a third of a degree from parallel, count alike. False
  // where nothing fits.
  bool Fit(const std::vector<int>& candidates, FoundPencil* pencil, double* spread) const {
    *spread = max_spread_;
    constexpr int kPasses = 6;
    for (int pass = 0; pass < kPasses; ++pass) {
      const Vector3d direction = pencil->fit.direction;
      const std::vector<int> near = Near(candidates, direction, max_spread_);
      *spread = EstimateSpread(near, direction);
      pencil->lines = Near(near, direction, *spread);
      std::vector<LineFit> members;
      for (const int i : pencil->lines) members.push_back(WithDirectionError(Line(i), *spread));
      VanishingPointFit fit;
      if (!FitVanishingPoint(members, &fit).ok()) return false;
      pencil->fit = fit;
    }
    return true;
  }

  // Moves the direction to where the pencil's lines are densest, if most of them are exactly
  // parallel.
  void StartAtDensest(std::uint64_t seed, FoundPencil* pencil) const {
    std::vector<LineFit> members;
    for (const int i : pencil->lines) members.push_back(Line(i));
    PencilOptions exact;
    exact.ransac.seed = seed;
    exact.model_sigma_rad = kExactSigmaRad;
    exact.max_pencils = 1;
    exact.max_false_alarms = 1e300;  // However few they are.
    std::vector<FoundPencil> densest;
    if (FindPencils(members, exact, &densest).ok() && !densest.empty())
      pencil->fit = densest.front().fit;
  }

 private:
  const LineFit& Line(int i) const { return set_.fits[static_cast<std::size_t>(i)]; }

  double Variance(int i, const Vector3d& direction, double spread) const {
    return direction.dot(Line(i).covariance * direction) + spread * spread;
  }

  std::vector<int> Near(const std::vector<int>& candidates, const Vector3d& direction,
                        double spread) const {
    std::vector<int> near;
    for (const int i : candidates) {
      const double miss = Line(i).line.dot(direction);
      if (miss * miss <= kInlierSigmas * kInlierSigmas * Variance(i, direction, spread))
        near.push_back(i);
    }
    return near;
  }

  // The standard deviation (radians) by which lines miss the direction beyond what their own
  // covariances explain: chosen so that half of the total length has normalised residuals below the
  // median of a Gaussian's. Between kMinSpreadRad and the largest.
  double EstimateSpread(const std::vector<int>& members, const Vector3d& direction) const {
    const auto share_below = [&](double spread) {
      double below = 0.0, total = 0.0;
      for (const int i : members) {
        const double miss = Line(i).line.dot(direction);
        const double length = set_.lines[static_cast<std::size_t>(i)].length_px;
        total += length;
        if (miss * miss < 0.455 * Variance(i, direction, spread)) below += length;
      }
      return below / std::max(total, 1.0);
    };
    double low = kMinSpreadRad, high = max_spread_;
    if (share_below(low) >= 0.5) return low;
    if (share_below(high) <= 0.5) return high;
    for (int step = 0; step < 12; ++step) {  // To a part in 4000 of the interval.
      const double middle = 0.5 * (low + high);
      (share_below(middle) < 0.5 ? low : high) = middle;
    }
    return high;
  }

  const LineSet& set_;
  double max_spread_;
};

// With the fit that was found, and its lines' scatter about it in their covariances.
DetectedPencil MakePencil(const FoundPencil& found, const LineSet& set, double spread) {
  std::vector<LineFit> fits;
  for (const int i : found.lines) {
    fits.push_back(WithDirectionError(set.fits[static_cast<std::size_t>(i)], spread));
  }
  DetectedPencil pencil = MakePencil(set.lines, found.lines, fits, found.fit.direction);
  pencil.observation.fit = found.fit;
  return pencil;
}

PencilOptions SearchOptions(int max_pencils, std::uint64_t seed) {
  PencilOptions options;
  options.ransac.seed = seed;
  options.model_sigma_rad = kSearchSigmaRad;
  options.max_pencils = max_pencils;
  return options;
}

// Lines and their twins, ascending.
std::vector<int> WithTwins(const LineSet& set, std::vector<int> members) {
  const std::size_t own = members.size();
  for (std::size_t i = 0; i < set.twin_of.size(); ++i) {
    const auto end = members.begin() + static_cast<std::ptrdiff_t>(own);
    if (std::find(members.begin(), end, set.twin_of[i]) != end)
      members.push_back(static_cast<int>(i));
  }
  std::sort(members.begin(), members.end());
  return members;
}

// Pencils among all lines, each fitted to its own ones.
std::vector<DetectedPencil> Search(const LineSet& set, const PencilOptions& options) {
  std::vector<int> subset;
  std::vector<LineFit> chosen;
  for (int i = 0; i < static_cast<int>(set.lines.size()); ++i) {
    if (set.IsTwin(i)) continue;
    subset.push_back(i);
    chosen.push_back(set.fits[static_cast<std::size_t>(i)]);
  }
  std::vector<FoundPencil> found;
  std::vector<DetectedPencil> pencils;
  if (!FindPencils(chosen, options, &found).ok()) return pencils;
  const PencilFitter fitter(set, kSearchSigmaRad);
  for (FoundPencil& f : found) {
    for (int& i : f.lines) i = subset[static_cast<std::size_t>(i)];
    fitter.StartAtDensest(options.ransac.seed, &f);
    double spread;
    if (!fitter.Fit(WithTwins(set, f.lines), &f, &spread)) continue;
    if (set.Count(f.lines) < options.min_lines) continue;
    pencils.push_back(MakePencil(f, set, spread));
  }
  return pencils;
}

// The lines that are near one of the pencil's, and not of it.
std::vector<int> LinesAround(const LineSet& set, const DetectedPencil& pencil) {
  const std::vector<DetectedLine>& lines = set.lines;
  std::vector<int> around;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const int k = static_cast<int>(i);
    if (std::binary_search(pencil.members.begin(), pencil.members.end(), k)) continue;
    const bool meets = std::any_of(pencil.ends.begin(), pencil.ends.end(), [&](const Segment& s) {
      return AreNear(s, lines[i].ends, set.diagonal_px);
    });
    if (meets) around.push_back(k);
  }
  return around;
}

// An edge that is broken into pieces is one line: where it meets another, all of them do. Of each
// edge in lines[subset] the first piece, which is the longest.
std::vector<int> OneOfEachEdge(const LineSet& set, const std::vector<int>& subset) {
  std::vector<int> edges;
  const double px = kTwinShareOfPhoto * set.diagonal_px;
  for (const int i : subset) {
    const Segment& ends = set.lines[static_cast<std::size_t>(i)].ends;
    const bool is_piece = std::any_of(edges.begin(), edges.end(), [&](int k) {
      const Segment& edge = set.lines[static_cast<std::size_t>(k)].ends;
      const Eigen::ParametrizedLine<double, 2> line =
          Eigen::ParametrizedLine<double, 2>::Through(edge[0], edge[1]);
      return line.distance(ends[0]) <= px && line.distance(ends[1]) <= px;
    });
    if (!set.IsTwin(i) && !is_piece) edges.push_back(i);
  }
  return edges;
}

// Boxes, boards and rooms have right angles: the direction orthogonal to `axis` that lines[subset]
// have the best evidence of, if any.
std::optional<DetectedPencil> SearchOrthogonal(const LineSet& set, const std::vector<int>& subset,
                                               const Vector3d& axis) {
  std::vector<LineFit> pool;
  for (const int i : OneOfEachEdge(set, subset)) {
    pool.push_back(set.fits[static_cast<std::size_t>(i)]);
  }
  const std::optional<Vector3d> best = OrthogonalEvidence(pool, axis, kSearchSigmaRad).Best();
  if (!best) return std::nullopt;
  FoundPencil found;
  found.fit.direction = *best;
  double spread;
  if (!PencilFitter(set, kSearchSigmaRad).Fit(subset, &found, &spread)) return std::nullopt;
  if (set.Count(found.lines) < PencilOptions().min_lines) return std::nullopt;
  return MakePencil(found, set, spread);
}

// The pencils orthogonal to one, among the lines that meet its own.
std::vector<DetectedPencil> SearchAround(const LineSet& set, const DetectedPencil& pencil) {
  std::vector<int> left = LinesAround(set, pencil);
  std::vector<DetectedPencil> found;
  for (int k = 0; k < kFoundAround; ++k) {
    std::optional<DetectedPencil> next =
        SearchOrthogonal(set, left, pencil.observation.fit->direction);
    if (!next) break;
    std::vector<int> rest;
    std::set_difference(left.begin(), left.end(), next->members.begin(), next->members.end(),
                        std::back_inserter(rest));
    left = std::move(rest);
    found.push_back(std::move(*next));
  }
  return found;
}

// Whether most lines of `pencil` are those of one of the others already.
bool IsKnown(const DetectedPencil& pencil, const std::vector<DetectedPencil>& others) {
  return std::any_of(others.begin(), others.end(), [&](const DetectedPencil& other) {
    std::vector<int> common;
    std::set_intersection(pencil.members.begin(), pencil.members.end(), other.members.begin(),
                          other.members.end(), std::back_inserter(common));
    return 10 * common.size() >= 7 * pencil.members.size();
  });
}

}  // namespace

namespace {

void LongestFirst(std::vector<DetectedPencil>* pencils) {
  std::stable_sort(
      pencils->begin(), pencils->end(),
      [](const DetectedPencil& a, const DetectedPencil& b) { return a.support_px > b.support_px; });
}

}  // namespace

Status DetectPencilsApart(const std::vector<DetectedLine>& lines, int max_pencils,
                          std::uint64_t seed, std::vector<DetectedPencil>* pencils,
                          double diagonal_px) {
  pencils->clear();
  const PencilOptions options = SearchOptions(max_pencils, seed);
  const Status status = options.Validate();
  if (!status.ok()) return status;
  *pencils = Search(LineSet(lines, diagonal_px), options);
  LongestFirst(pencils);
  return Status::Ok();
}

Status DetectPencils(const std::vector<DetectedLine>& lines, int max_pencils, std::uint64_t seed,
                     std::vector<DetectedPencil>* pencils, double diagonal_px) {
  pencils->clear();
  const PencilOptions options = SearchOptions(max_pencils, seed);
  const Status status = options.Validate();
  if (!status.ok()) return status;
  const LineSet set(lines, diagonal_px);
  *pencils = Search(set, options);
  LongestFirst(pencils);
  const std::size_t num_around = std::min(kMaxSearchedAround, pencils->size());
  for (std::size_t k = 0; k < num_around; ++k) {
    for (DetectedPencil& found : SearchAround(set, (*pencils)[k])) {
      if (!IsKnown(found, *pencils)) pencils->push_back(std::move(found));
    }
  }
  LongestFirst(pencils);
  return Status::Ok();
}

bool RefitPencil(const std::vector<DetectedLine>& lines, const std::vector<int>& candidates,
                 DetectedPencil* pencil, double diagonal_px) {
  const LineSet set(lines, diagonal_px);
  FoundPencil found;
  found.fit = *pencil->observation.fit;
  double spread;
  if (!PencilFitter(set, kMaxSpreadRad).Fit(candidates, &found, &spread)) return false;
  *pencil = MakePencil(found, set, spread);
  return true;
}

DetectedPencil MakePencil(const std::vector<DetectedLine>& lines, const std::vector<int>& members,
                          const std::vector<LineFit>& fits, const Vector3d& direction) {
  DetectedPencil pencil;
  pencil.members = members;
  double variance = 0.0, points = 0.0;
  for (std::size_t k = 0; k < members.size(); ++k) {
    const DetectedLine& line = lines[static_cast<std::size_t>(members[k])];
    LineObservation observation;
    observation.points = line.points;
    observation.fit = line.fit;
    // Points of lines that are not quite parallel are no better than the lines.
    const double widening = direction.dot(fits[k].covariance * direction) /
                            direction.dot(line.fit.covariance * direction);
    observation.sigma_px = line.sigma_px * std::sqrt(widening);
    observation.fit->covariance *= widening;
    const double n = static_cast<double>(line.points.size());
    variance += n * line.sigma_px * line.sigma_px;
    points += n;
    pencil.observation.lines.push_back(std::move(observation));
    pencil.ends.push_back(line.ends);
    pencil.support_px += line.length_px;
  }
  pencil.observation.sigma_px = std::sqrt(variance / std::max(points, 1.0));
  return pencil;
}

LineFit WithSharedError(const DetectedLine& line, double shared_px) {
  LineFit fit = line.fit;
  const double n = static_cast<double>(line.points.size());
  fit.covariance *= 1.0 + n * shared_px * shared_px / (line.sigma_px * line.sigma_px);
  return fit;
}

std::vector<int> FindTwins(const std::vector<DetectedLine>& lines, double diagonal_px) {
  std::vector<int> order(lines.size());
  std::iota(order.begin(), order.end(), 0);
  const auto line = [&lines](int i) -> const DetectedLine& {
    return lines[static_cast<std::size_t>(i)];
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return line(a).length_px > line(b).length_px; });
  std::vector<int> twin_of(lines.size(), -1);
  for (std::size_t k = 0; k < order.size(); ++k) {
    const auto beside = [&](int longer) {
      return twin_of[static_cast<std::size_t>(longer)] < 0 &&
             LiesAlong(line(order[k]).ends, line(longer).ends, kTwinShareOfPhoto * diagonal_px);
    };
    const auto end = order.begin() + static_cast<std::ptrdiff_t>(k);
    const auto found = std::find_if(order.begin(), end, beside);
    if (found != end) twin_of[static_cast<std::size_t>(order[k])] = *found;
  }
  return twin_of;
}

}  // namespace circline
