#include "circline/ransac/detection/lines/detect_lines.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "circline/estimators/line_moments.h"
#include "circline/ransac/detection/lines/line_pieces.h"

namespace circline {
namespace {

// Pieces are joined if the gap between them is not longer than the shorter of the two, nor than
// this many pixels; an overlap up to kMaxOverlapPx is what rounded corners and crossings cause.
constexpr double kMaxGapPx = 100.0;
constexpr double kMaxOverlapPx = 3.0;
// A joined piece must lie within half of kMaxLineDistancePx plus this many standard deviations of
// the extrapolated line, but never more than kMaxJoinPx off.
constexpr double kJoinSigmas = 2.0;
constexpr double kMaxJoinPx = 1.5;
// Standard deviation of one edge point in that extrapolation, pixels.
constexpr double kPointSigmaPx = 0.3;
// Where bright areas bleed into dark ones, edges with the bright side on one side and on the other,
// like the sides of a row of chessboard squares, lie on either side of their line by about this.
// Pieces of both kinds are joined up to this far off.
constexpr double kBleedSigmaPx = 0.4;
constexpr double kMaxAlternatingPx = 2.0;
// Edge points are averaged over this length, pixels. Neighbours are correlated by the smoothing
// anyway; averaging keeps what they know and drops the repetition.
constexpr double kPointSpacingPx = 5.0;
constexpr std::size_t kMaxLines = 400;
// Averaged points are not trusted beyond this: lenses and edges are not straight to better.
constexpr double kMinLineSigmaPx = 0.1;

using Eigen::Vector2d;
using Eigen::Vector3d;

// A line being joined from pieces.
struct Joined {
  std::vector<int> pieces;
  Vector2d gradient;        // Of the first piece.
  bool alternates = false;  // The bright side is not the same on all pieces.
  LineMoments moments;
  Vector3d line;
};

class LineJoiner {
 public:
  LineJoiner(const LineEdges& edges, double min_length_px)
      : edges_(edges), min_length_px_(min_length_px) {}

  std::vector<DetectedLine> Straight() {
    CutIntoPieces(edges_, &pieces_, &bent_);
    std::stable_sort(pieces_.begin(), pieces_.end(), [](const LinePiece& a, const LinePiece& b) {
      return a.length_px > b.length_px;
    });
    JoinPieces();
    return Longest();
  }

  // After Straight().
  std::vector<DetectedLine> Bent() {
    pieces_ = std::move(bent_);
    for (std::size_t k = 0; k < pieces_.size(); ++k) Finish(Start(static_cast<int>(k)));
    return Longest();
  }

 private:
  std::vector<DetectedLine> Longest() {
    std::vector<DetectedLine> lines = std::move(lines_);
    lines_.clear();
    std::stable_sort(lines.begin(), lines.end(), [](const DetectedLine& a, const DetectedLine& b) {
      return a.length_px > b.length_px;
    });
    if (lines.size() > kMaxLines) lines.resize(kMaxLines);
    return lines;
  }

  void JoinPieces() {
    PieceBeginnings free(edges_, pieces_, kMaxAlternatingPx);
    for (Eigen::Index k = 0; k < free.size(); ++k) {
      if (!free.Has(k)) continue;
      free.Remove(k);
      Joined joined = Start(static_cast<int>(k));
      // Joining one piece makes the line longer and may bring the next one within reach.
      bool again = true;
      while (again) {
        again = false;
        for (Eigen::Index j = k + 1; (j = free.NextNear(joined.line, j)) < free.size(); ++j) {
          if (!Continues(joined, pieces_[static_cast<std::size_t>(j)])) continue;
          free.Remove(j);
          again = true;
          Append(static_cast<int>(j), &joined);
        }
      }
      Finish(joined);
    }
  }

  Joined Start(int piece) const {
    const LinePiece& p = pieces_[static_cast<std::size_t>(piece)];
    Joined joined;
    joined.pieces = {piece};
    joined.gradient = p.gradient;
    joined.moments = LineMoments(edges_.X(p.begin).x);
    AddPoints(p, &joined.moments);
    joined.line = joined.moments.Line();
    return joined;
  }

  void AddPoints(const LinePiece& p, LineMoments* moments) const {
    for (int i = p.begin; i < p.end; ++i) {
      if (edges_.Distance(i, p.line) <= kMaxLineDistancePx) moments->Add(edges_.X(i).x);
    }
  }

  void Append(int piece, Joined* joined) const {
    const LinePiece& p = pieces_[static_cast<std::size_t>(piece)];
    joined->pieces.push_back(piece);
    joined->alternates = joined->alternates || joined->gradient.dot(p.gradient) < 0.0;
    AddPoints(p, &joined->moments);
    joined->line = joined->moments.Line();
  }

  bool Continues(const Joined& joined, const LinePiece& p) const {
    const auto [from, to] = edges_.Range(joined.line, p);
    double gap = std::numeric_limits<double>::infinity(), length = 0.0;
    for (const int k : joined.pieces) {
      const auto [begin, end] = edges_.Range(joined.line, pieces_[static_cast<std::size_t>(k)]);
      gap = std::min(gap, std::max(from - end, begin - to));
      length = std::max(length, end - begin);
    }
    // Calibrated lengths to pixels by the piece's own scale.
    const double px = p.length_px / std::max(to - from, 1e-12);
    length *= px;
    gap *= px;
    if (gap < -kMaxOverlapPx) return false;
    if (gap > std::min({p.length_px, length, kMaxGapPx})) return false;
    return NearExtrapolation(joined, p, length, gap + p.length_px);
  }

  // Both ends within the uncertainty of the line extrapolated from `length` over `beyond` pixels.
  bool NearExtrapolation(const Joined& joined, const LinePiece& p, double length,
                         double beyond) const {
    const double n = std::max(2, joined.moments.count());
    const double u = (0.5 * length + beyond) / std::max(length, 1.0);
    const double lever = 1.0 + 12.0 * u * u;
    const double sigma = kPointSigmaPx * std::sqrt(lever / n);
    double limit = std::min(kMaxJoinPx, 0.5 * kMaxLineDistancePx + kJoinSigmas * sigma);
    if (joined.alternates || joined.gradient.dot(p.gradient) < 0.0) {
      const double pieces = static_cast<double>(joined.pieces.size());
      const double bleed = kBleedSigmaPx * std::sqrt(1.0 + (pieces > 1.0 ? lever / pieces : 1.0));
      limit = std::min(kMaxAlternatingPx, kJoinSigmas * std::hypot(sigma, bleed));
    }
    return std::abs(LineDistancePx(edges_.X(p.begin), joined.line)) <= limit &&
           std::abs(LineDistancePx(edges_.X(p.end - 1), joined.line)) <= limit;
  }

  // Means of points over kPointSpacingPx.
  struct Average {
    double position;  // Along the line.
    Vector2d pixel;
    CalibratedPoint point;
  };

  void Finish(const Joined& joined) {
    DetectedLine line;
    std::vector<Average> averages;
    for (const int k : joined.pieces) {
      const LinePiece& p = pieces_[static_cast<std::size_t>(k)];
      line.length_px += p.length_px;
      AppendAverages(p, joined, &averages);
    }
    if (line.length_px < min_length_px_ || averages.size() < 2) return;
    std::stable_sort(averages.begin(), averages.end(),
                     [](const Average& a, const Average& b) { return a.position < b.position; });
    std::vector<CalibratedPoint> points;
    for (const Average& average : averages) {
      line.points.push_back(average.pixel);
      points.push_back(average.point);
    }
    if (!FitAverages(points, &line)) return;
    SetEnds(joined, &line);
    if (RunsAlongBorder(line.ends)) return;
    lines_.push_back(std::move(line));
  }

  // Photos end in dark rims, and scans and prints in frames: lines of the photo, not of the scene.
  bool RunsAlongBorder(const Segment& ends) const {
    constexpr double kRim = 0.0025;  // Of the photo's longer side.
    const Vector2d far(edges_.map().width - 1, edges_.map().height - 1);
    const double rim = kRim * far.maxCoeff();
    const auto all_within = [&](const auto& distance) {
      return std::all_of(ends.begin(), ends.end(),
                         [&](const Vector2d& end) { return distance(end) <= rim; });
    };
    for (const int k : {0, 1}) {
      if (all_within([&](const Vector2d& end) { return end[k]; }) ||
          all_within([&](const Vector2d& end) { return far[k] - end[k]; }))
        return true;
    }
    return false;
  }

  void AppendAverages(const LinePiece& p, const Joined& joined, std::vector<Average>* averages) {
    const int n = p.end - p.begin;  // More than two.
    const int bins = static_cast<int>(std::clamp(p.length_px / kPointSpacingPx, 2.0, 1.0 * n));
    for (int k = 0; k < bins; ++k) {
      Vector2d pixel = Vector2d::Zero(), x = Vector2d::Zero();
      int count = 0;
      const int begin = p.begin + k * n / bins, end = p.begin + (k + 1) * n / bins;
      for (int i = begin; i < end; ++i) {
        if (edges_.Distance(i, joined.line) > kMaxJoinPx) continue;
        pixel += edges_.Pixel(i);
        x += edges_.X(i).x;
        ++count;
      }
      if (count == 0) continue;
      CalibratedPoint point = edges_.X((begin + end) / 2);
      point.x = x / count;
      averages->push_back({Along(joined.line).dot(point.x), pixel / count, point});
    }
  }

  void SetEnds(const Joined& joined, DetectedLine* line) const {
    double from = std::numeric_limits<double>::infinity(), to = -from;
    for (const int k : joined.pieces) {
      const LinePiece& p = pieces_[static_cast<std::size_t>(k)];
      for (const int i : {p.begin, p.end - 1}) {
        const double s = Along(joined.line).dot(edges_.X(i).x);
        if (s < from) {
          from = s;
          line->ends[0] = edges_.Pixel(i);
        }
        if (s > to) {
          to = s;
          line->ends[1] = edges_.Pixel(i);
        }
      }
    }
  }

  const LineEdges& edges_;
  const double min_length_px_;
  std::vector<LinePiece> pieces_, bent_;
  std::vector<DetectedLine> lines_;
};

}  // namespace

bool FitAverages(const std::vector<CalibratedPoint>& points, DetectedLine* line) {
  LineFit fit;
  if (!FitLine(points, 1.0, &fit).ok()) return false;
  const double n = static_cast<double>(points.size());
  const double spread = n > 2.0 ? fit.rms_px * std::sqrt(n / (n - 2.0)) : 0.0;
  line->sigma_px = std::max(kMinLineSigmaPx, spread);
  fit.covariance *= line->sigma_px * line->sigma_px;
  line->fit = fit;
  return true;
}

std::vector<DetectedLine> DetectLines(const EdgeMap& edges, const Camera& camera,
                                      double min_length_px, const std::vector<std::uint8_t>* skip,
                                      std::vector<DetectedLine>* bent) {
  const LineEdges usable(edges, camera, skip);
  LineJoiner joiner(usable, min_length_px);
  std::vector<DetectedLine> lines = joiner.Straight();
  if (bent != nullptr) *bent = joiner.Bent();
  return lines;
}

}  // namespace circline
