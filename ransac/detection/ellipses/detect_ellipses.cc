#include "circline/ransac/detection/ellipses/detect_ellipses.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/conic_fit.h"
#include "circline/ransac/detection/ellipses/arcs.h"
#include "circline/ransac/detection/ellipses/ellipse_fitter.h"

namespace circline {
namespace {

// An arc alone determines an ellipse from this turn on.
constexpr double kMinSingleTurn = 50.0 * kDegree;
// A contour that goes so far round is a thing's. Of 180 to 300 degrees, on renderings (seeds 201 to
// 225) and all photographs: with less, cluttered ones gain ellipses that are none.
constexpr double kMostOfAContour = 240.0 * kDegree;
// Arcs that take part in pairs: the most bent and longest ones. Bounds the quadratic step.
constexpr std::size_t kMaxPairedArcs = 256;
// Pairs tried, the most promising ones: what comes after them has not added an ellipse.
constexpr std::size_t kMaxPairCandidates = 500;
// Parts of an arc that are tried where the whole is no ellipse, in sixths.
constexpr std::array<std::array<int, 2>, 4> kArcParts = {{{0, 5}, {1, 6}, {0, 3}, {3, 6}}};
constexpr int kMinPartPoints = 12;
// Rims about the centre of one that is known are looked for up to this many times larger and
// smaller, in steps of this share, in both planes that it can have.
constexpr double kMaxRimRatio = 2.7;
constexpr double kRimStep = 0.05;
// What hides up to half of a rim runs beside it within this ratio of its size, but for a tenth of
// its edges, and where the rim has edges on no more than a quarter of the way. Of renderings.
constexpr double kMostHidden = 0.5, kBesideRatio = 1.25, kStraysBeside = 0.1, kMostShared = 0.25;
// A rim whose own edges go less than so far round may have others in common with an outline, so
// much at least, degrees. The two are apart by no more than this share of the outline's size, and
// no more different in size. Drawn from a coin seen aslant, not fitted.
constexpr double kMostOwn = 180.0, kLeastShared = 60.0, kMostApart = 0.5;
constexpr std::size_t kSectors = 72;  // Of the way round a rim.
// Contours nearer than this everywhere, with the same side bright, are one contour, pixels.
constexpr double kDuplicatePx = 2.5;

using Eigen::Matrix3d;
using Eigen::Vector2d;

// A pose of an ellipse, in radii of its circle, and where it puts the circle's centre on the photo.
struct SeenPose {
  CirclePose pose;
  Vector2d center;
};

std::vector<SeenPose> SeenPoses(const Matrix3d& conic, const Camera& camera) {
  std::array<CirclePose, 2> poses;
  const int n = CirclePoses(conic, &poses);
  std::vector<SeenPose> seen;
  for (int i = 0; i < n; ++i) {
    const CirclePose& pose = poses[static_cast<std::size_t>(i)];
    Vector2d center;
    if (CameraToPixel(camera, pose.center, &center)) seen.push_back({pose, center});
  }
  return seen;
}

class EllipseDetector {
 public:
  EllipseDetector(const EdgeMap& map, const Camera& camera, const EllipseOptions& options)
      : map_(map), camera_(camera), fitter_(map, camera, options) {}

  std::vector<DetectedEllipse> Detect() {
    arcs_ = FindArcs(map_);
    // (By index: arcs are split, and the parts appended, as they are looked at.)
    for (std::size_t k = 0; k < arcs_.size(); ++k) {
      const Arc arc = arcs_[k];
      if (arc.turn < kMinSingleTurn || AddCandidate({&arc})) continue;
      AddPart(arc);
      Split(k);
    }
    AddPairs();
    AcceptBest();
    // (By index: what is found is looked around as well.)
    for (std::size_t k = 0; k < accepted_.size(); ++k) {
      AddRims(accepted_[k].fit.conic);
      AcceptBest();
    }
    ShareFarSides();
    DropWhatHides();
    Rank();
    return std::move(accepted_);
  }

 private:
  // Fits an ellipse to the arcs and keeps it for later if edges elsewhere support it too. False if
  // the arcs themselves are not on one ellipse, or are most of a contour that is none: something
  // may hide a part of it.
  bool AddCandidate(std::initializer_list<const Arc*> arcs) {
    EllipseCandidate candidate;
    if (!fitter_.FitArcs(arcs, &candidate)) return false;
    if (!fitter_.Improve(&candidate))
      return arcs.size() > 1 || (*arcs.begin())->turn < kMostOfAContour;
    candidates_.push_back(candidate);
    return true;
  }

  // An arc may be an ellipse's but for a stretch where something else touches the contour: the
  // first of its parts that is one's makes a candidate.
  void AddPart(const Arc& arc) {
    const int n = arc.size();
    for (const auto& [from, to] : kArcParts) {
      Arc part = arc;
      part.begin = arc.begin + n * from / 6;
      part.end = arc.begin + n * to / 6;
      part.turn = arc.turn * (to - from) / 6.0;
      if (part.turn < kMinSingleTurn || part.size() < kMinPartPoints) continue;
      if (AddCandidate({&part})) return;
    }
  }

  // Replaces an arc that is no ellipse's by its parts on either side of its sharpest point.
  void Split(std::size_t k) {
    const std::vector<Arc> parts = SplitArc(map_, arcs_[k]);
    arcs_[k].turn = 0.0;  // Takes no further part.
    arcs_.insert(arcs_.end(), parts.begin(), parts.end());
  }

  void AddPairs() {
    std::vector<const Arc*> arcs;
    for (const Arc& arc : arcs_) {
      if (arc.turn > 0.0) arcs.push_back(&arc);
    }
    const auto weight = [](const Arc* a) { return a->turn * a->size(); };
    std::stable_sort(arcs.begin(), arcs.end(),
                     [&](const Arc* a, const Arc* b) { return weight(a) > weight(b); });
    if (arcs.size() > kMaxPairedArcs) arcs.resize(kMaxPairedArcs);
    std::size_t tried = 0;
    // In order of the weaker of the two, so that the limit cuts the least promising pairs.
    for (std::size_t j = 1; j < arcs.size(); ++j) {
      for (std::size_t i = 0; i < j && tried < kMaxPairCandidates; ++i) {
        if (!CanShareEllipse(*arcs[i], *arcs[j])) continue;
        ++tried;
        AddCandidate({arcs[i], arcs[j]});
      }
    }
  }

  // Where one rim is known, circles about its centre in its plane need no arc that determines them:
  // those that edges lie along.
  void AddRims(const Matrix3d& rim) {
    for (const SeenPose& seen : SeenPoses(rim, camera_)) AddRimsOf(seen.pose);
  }

  void AddRimsOf(const CirclePose& pose) {
    for (double ratio = 1.0 / kMaxRimRatio; ratio < kMaxRimRatio; ratio *= 1.0 + kRimStep) {
      CirclePose other = pose;
      other.center /= ratio;  // In its own radii.
      EllipseCandidate candidate;
      if (fitter_.FindAlong(ProjectCircle(other), &candidate)) candidates_.push_back(candidate);
    }
  }

  // Accepts candidates, best first, as far as points that others took meanwhile do not count.
  void AcceptBest() {
    std::stable_sort(
        candidates_.begin(), candidates_.end(),
        [](const EllipseCandidate& a, const EllipseCandidate& b) { return a.score > b.score; });
    for (const EllipseCandidate& candidate : candidates_) {
      if (fitter_.IsSupported(candidate)) Accept(candidate);
    }
    candidates_.clear();
  }

  void Accept(const EllipseCandidate& candidate) {
    DetectedEllipse e;
    if (!fitter_.Fit(candidate, &e) || IsDuplicate(e)) return;
    fitter_.Take(e);
    accepted_.push_back(std::move(e));
  }

  // The same contour found again from other points.
  bool IsDuplicate(const DetectedEllipse& e) {
    for (const DetectedEllipse& other : accepted_) {
      const bool same_side = other.bright == e.bright || other.bright == BrightSide::kEither ||
                             e.bright == BrightSide::kEither;
      if (same_side && fitter_.LiesOn(e, other.fit.conic, kDuplicatePx)) return true;
    }
    return false;
  }

  // The far side of the top of a thing is that of its outline, too, which took its edges.
  void ShareFarSides() {
    for (DetectedEllipse& rim : accepted_) {
      if (rim.coverage_deg > kMostOwn) continue;
      for (const DetectedEllipse& outline : accepted_) {
        if (outline.coverage_deg < rim.coverage_deg + kLeastShared) continue;
        fitter_.Release(outline);
        fitter_.Release(rim);
        DetectedEllipse whole;
        EllipseCandidate start;
        start.bright = BrightSide::kEither;
        const bool is_whole = FitTogether(rim, outline, &start.conic) &&
                              fitter_.Fit(start, &whole) &&
                              whole.coverage_deg > rim.coverage_deg + kLeastShared &&
                              fitter_.LiesOn(rim, whole.fit.conic, kDuplicatePx) &&
                              !fitter_.LiesOn(whole, outline.fit.conic, kDuplicatePx);
        if (is_whole) rim = std::move(whole);
        fitter_.Take(rim);
        fitter_.Take(outline);
        if (is_whole) break;
      }
    }
  }

  // To the edges of a rim, and to those of an outline where the rim has none. False where the two
  // are not of one thing.
  bool FitTogether(const DetectedEllipse& rim, const DetectedEllipse& outline, Matrix3d* conic) {
    Ellipse about, own;
    if (!ConicToEllipse(outline.fit.conic, &about) || !ConicToEllipse(rim.fit.conic, &own) ||
        (own.center - about.center).norm() > kMostApart * about.b || own.a < kMostApart * about.a)
      return false;
    double strays = 0.0;
    const std::bitset<kSectors> of_rim = SectorsOf(rim, about, &strays);
    std::vector<CalibratedPoint> points;
    CalibratedPoint p;
    for (const int i : rim.points) {
      if (fitter_.Calibrate(i, &p)) points.push_back(p);
    }
    for (const int i : outline.points) {
      if (fitter_.Calibrate(i, &p) && !of_rim.test(SectorOf(InAxes(p, about)))) points.push_back(p);
    }
    return FitConicDirect(points, conic).ok();
  }

  void DropWhatHides() {
    std::vector<DetectedEllipse> kept;
    for (const DetectedEllipse& arc : accepted_) {
      const bool hides = std::any_of(accepted_.begin(), accepted_.end(), [&](const auto& rim) {
        return rim.coverage_deg > arc.coverage_deg && Hides(arc, rim);
      });
      if (!hides) kept.push_back(arc);
    }
    accepted_ = std::move(kept);
  }

  // Whether an arc is the edge of what hides a part of a rim: it runs beside that, where it has no
  // edges of its own.
  bool Hides(const DetectedEllipse& arc, const DetectedEllipse& rim) {
    Ellipse about;
    if (arc.coverage_deg > 360.0 * kMostHidden || !ConicToEllipse(rim.fit.conic, &about))
      return false;
    double strays = 0.0;
    const std::bitset<kSectors> of_arc = SectorsOf(arc, about, &strays);
    if (strays > kStraysBeside * static_cast<double>(arc.points.size())) return false;
    const std::bitset<kSectors> shared = of_arc & SectorsOf(rim, about, &strays);
    return static_cast<double>(shared.count()) <= kMostShared * static_cast<double>(of_arc.count());
  }

  // Where a point lies in an ellipse's own axes.
  static Vector2d InAxes(const CalibratedPoint& p, const Ellipse& about) {
    return (Eigen::Rotation2Dd(-about.angle) * (p.x - about.center))
        .cwiseQuotient(Vector2d(about.a, about.b));
  }

  static std::size_t SectorOf(const Vector2d& in_axes) {
    const double turn = std::atan2(in_axes.y(), in_axes.x()) / (2.0 * kPi) + 0.5;
    return static_cast<std::size_t>(turn * kSectors) % kSectors;
  }

  // Those of the way round an ellipse where edges of one are; adds to `strays` how many of these
  // are not beside it.
  std::bitset<kSectors> SectorsOf(const DetectedEllipse& e, const Ellipse& about, double* strays) {
    std::bitset<kSectors> sectors;
    for (const int i : e.points) {
      CalibratedPoint p;
      if (!fitter_.Calibrate(i, &p)) continue;
      const Vector2d in_axes = InAxes(p, about);
      const double ratio = in_axes.norm();
      *strays += std::max(ratio, 1.0 / ratio) > kBesideRatio ? 1.0 : 0.0;
      sectors.set(SectorOf(in_axes));
    }
    return sectors;
  }

  void Rank() {
    std::stable_sort(accepted_.begin(), accepted_.end(),
                     [](const DetectedEllipse& a, const DetectedEllipse& b) {
                       return a.length_px * a.coverage_deg > b.length_px * b.coverage_deg;
                     });
  }

  const EdgeMap& map_;
  const Camera& camera_;
  EllipseFitter fitter_;
  std::vector<Arc> arcs_;
  std::vector<EllipseCandidate> candidates_;
  std::vector<DetectedEllipse> accepted_;
};

bool CanBeConcentric(const std::vector<SeenPose>& a, const std::vector<SeenPose>& b) {
  // Both centres within this many pixels. The centre of a well-seen rim is good to a tenth of one.
  constexpr double kMaxCentrePx = 1.5;
  constexpr double kMinNormalCosineConcentric = 0.966;  // 15 degrees: normals are less certain.
  // Two rims so near in size are mostly the edges of one thick or rounded rim (a tyre, a saucer, a
  // collar): circles about one axis, but at different heights, which put their centres where those
  // of the other pose of the rim would be.
  constexpr double kSameRimRatio = 0.85;
  const auto agree = [](const SeenPose& p, const SeenPose& q) {
    const double distance_p = p.pose.center.norm(), distance_q = q.pose.center.norm();
    return (p.center - q.center).squaredNorm() < kMaxCentrePx * kMaxCentrePx &&
           p.pose.normal.dot(q.pose.normal) >= kMinNormalCosineConcentric &&
           std::min(distance_p, distance_q) < kSameRimRatio * std::max(distance_p, distance_q);
  };
  return std::any_of(a.begin(), a.end(), [&](const SeenPose& p) {
    return std::any_of(b.begin(), b.end(), [&](const SeenPose& q) { return agree(p, q); });
  });
}

// Numbers the groups in the order of their best members.
void GroupConcentric(const Camera& camera, std::vector<DetectedEllipse>* ellipses) {
  std::vector<std::vector<SeenPose>> poses;
  for (const DetectedEllipse& e : *ellipses) poses.push_back(SeenPoses(e.fit.conic, camera));
  int groups = 0;
  for (std::size_t i = 0; i < ellipses->size(); ++i) {
    DetectedEllipse& a = (*ellipses)[i];
    for (std::size_t j = i + 1; j < ellipses->size(); ++j) {
      DetectedEllipse& b = (*ellipses)[j];
      if (b.concentric >= 0 || !CanBeConcentric(poses[i], poses[j])) continue;
      if (a.concentric < 0) a.concentric = groups++;
      b.concentric = a.concentric;
    }
  }
}

}  // namespace

std::vector<DetectedEllipse> DetectEllipses(const EdgeMap& edges, const Camera& camera,
                                            const EllipseOptions& options) {
  std::vector<DetectedEllipse> ellipses = EllipseDetector(edges, camera, options).Detect();
  GroupConcentric(camera, &ellipses);
  return ellipses;
}

}  // namespace circline
