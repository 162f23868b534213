#include "circline/ransac/detection/structure/detect_pencils.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <iterator>
#include <numeric>
#include <optional>
#include <utility>

#include "circline/ransac/detection/lines/segment_meetings.h"
#include "circline/ransac/detection/structure/orthogonal_evidence.h"
#include "circline/ransac/detection/structure/pencil_fitter.h"
#include "circline/ransac/detection/structure/uncertain_direction.h"
#include "circline/ransac/robust_pencils.h"

namespace circline {
namespace {

using Eigen::Vector3d;

// For so many of the longest pencils, so many are searched among the lines that meet theirs.
constexpr std::size_t kMaxSearchedAround = 3;
constexpr int kFoundAround = 2;
// The two sides of a thin line are so near to each other, a share of the photo's diagonal.
constexpr double kTwinShareOfPhoto = 4.0 / kUsualDiagonalPx;

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

void LongestFirst(std::vector<DetectedPencil>* pencils) {
  std::stable_sort(
      pencils->begin(), pencils->end(),
      [](const DetectedPencil& a, const DetectedPencil& b) { return a.support_px > b.support_px; });
}

// Pencils among all lines, each fitted to its own ones, longest first.
std::vector<DetectedPencil> Search(const LineSet& set, int max_pencils, std::uint64_t seed) {
  PencilOptions options;
  options.ransac.seed = seed;
  options.model_sigma_rad = kParallelSigmaRad;
  options.max_pencils = max_pencils;
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
  for (FoundPencil& f : found) {
    for (int& i : f.lines) i = subset[static_cast<std::size_t>(i)];
    std::optional<DetectedPencil> pencil = FitPencil(
        set, WithTwins(set, f.lines), DensestDirection(set, f.lines, f.fit.direction, seed),
        kParallelSigmaRad, options.min_lines);
    if (pencil) pencils.push_back(std::move(*pencil));
  }
  LongestFirst(&pencils);
  return pencils;
}

// The lines that are near one of the pencils', and of none of them.
std::vector<int> LinesAround(const LineSet& set, const std::vector<DetectedPencil>& pencils) {
  std::vector<int> around;
  for (int i = 0; i < static_cast<int>(set.lines.size()); ++i) {
    const Segment& ends = set.lines[static_cast<std::size_t>(i)].ends;
    const auto has = [i](const DetectedPencil& pencil) { return pencil.Has(i); };
    const auto meets = [&](const DetectedPencil& pencil) {
      return std::any_of(pencil.ends.begin(), pencil.ends.end(),
                         [&](const Segment& s) { return AreNear(s, ends, set.diagonal_px); });
    };
    if (std::none_of(pencils.begin(), pencils.end(), has) &&
        std::any_of(pencils.begin(), pencils.end(), meets))
      around.push_back(i);
  }
  return around;
}

// An edge that is broken into pieces is one line: where it meets another, all of them do. Of each
// edge in lines[subset] the fit of the first piece, which is the longest.
std::vector<LineFit> OneOfEachEdge(const LineSet& set, const std::vector<int>& subset) {
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
  std::vector<LineFit> fits;
  for (const int i : edges) fits.push_back(set.fits[static_cast<std::size_t>(i)]);
  return fits;
}

// Boxes, boards and rooms have right angles: the direction orthogonal to that of a pencil that
// lines[subset] have the best evidence of, if any.
std::optional<DetectedPencil> SearchOrthogonal(const LineSet& set, const std::vector<int>& subset,
                                               const DetectedPencil& pencil) {
  const OrthogonalEvidence evidence(OneOfEachEdge(set, subset), pencil.observation.fit->direction,
                                    pencil.members.size());
  const std::optional<Vector3d> best = evidence.Best();
  if (!best) return std::nullopt;
  return FitPencil(set, subset, *best, kParallelSigmaRad, PencilOptions().min_lines);
}

// The pencils orthogonal to one, among the lines that meet its own.
std::vector<DetectedPencil> SearchAround(const LineSet& set, const DetectedPencil& pencil) {
  std::vector<int> left = LinesAround(set, {pencil});
  std::vector<DetectedPencil> found;
  for (int k = 0; k < kFoundAround; ++k) {
    std::optional<DetectedPencil> next = SearchOrthogonal(set, left, pencil);
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

std::vector<DetectedPencil> DetectPencilsApart(const std::vector<DetectedLine>& lines,
                                               int max_pencils, std::uint64_t seed,
                                               double diagonal_px) {
  return Search(LineSet(lines, diagonal_px), max_pencils, seed);
}

std::vector<DetectedPencil> DetectPencils(const std::vector<DetectedLine>& lines, int max_pencils,
                                          std::uint64_t seed, double diagonal_px) {
  const LineSet set(lines, diagonal_px);
  std::vector<DetectedPencil> pencils = Search(set, max_pencils, seed);
  const std::size_t num_around = std::min(kMaxSearchedAround, pencils.size());
  for (std::size_t k = 0; k < num_around; ++k) {
    for (DetectedPencil& found : SearchAround(set, pencils[k])) {
      if (!IsKnown(found, pencils)) pencils.push_back(std::move(found));
    }
  }
  LongestFirst(&pencils);
  return pencils;
}

std::vector<LineFit> EdgesAround(const std::vector<DetectedLine>& lines,
                                 const std::vector<DetectedPencil>& pencils, double diagonal_px) {
  const LineSet set(lines, diagonal_px);
  return OneOfEachEdge(set, LinesAround(set, pencils));
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
