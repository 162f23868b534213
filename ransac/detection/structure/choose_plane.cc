#include "circline/ransac/detection/structure/choose_plane.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "circline/ransac/detection/lines/segment_meetings.h"
#include "circline/ransac/detection/structure/line_odds.h"
#include "circline/ransac/detection/structure/pencil_fitter.h"
#include "circline/ransac/detection/structure/solid_rims.h"

namespace circline {
namespace {

// Planes of circles alone start from this many of the best supported ones.
constexpr std::size_t kMaxSeeds = 16;
// Two pencils of one plane cross or form corners, while the edges of a box and the stripes of a
// cushion behind it do not: this share of either's length meets the other. At right angles, as
// those of houses are, a lower one of one of them is enough (few of a front's many uprights may
// meet the few cornices that are seen); through a camera that is a guess, where right angles look
// some degrees off, of both.
constexpr double kMinSpanningShare = 0.3;
constexpr double kMinRectangularShare = 0.1;
// The rim of a circle that agrees with two pencils counts as much as this many times its length in
// lines: it is rarer than a line, and fixes both directions.
constexpr double kCircleWeight = 3.0;
// The region in which lines meet is widened by this factor: the outermost lines meet none.
constexpr double kRegionGrowth = 1.1;
// So many focal lengths of a guess can be told apart, and at one of them circles agree by accident:
// then they are to be so much likelier of one plane than any way.
constexpr double kFocalTrials = 20.0;
// So much of the length of both pencils beyond the horizon of their plane is more than errors of
// the horizon leave there; and so near to it, a sine, most lines of either are seen along the
// plane, far away. On 140 photographs of Debian's packages, at two sizes: of planes that ripples,
// rock, wood and blades passed for half the length was within 0.01 to 0.1 of the horizon; of
// streets and corridors (scene-lund and scene-lund-more, camera known or guessed, among them)
// within 0.2 to 0.5.
constexpr double kMostBeyond = 0.1;
constexpr double kGrazing = 0.15;
// Lines that miss a direction by up to this are alike, radians.
constexpr double kAlikeRad = 0.05;
// It is one thing if its lines are this share of either pencil's length: of boards they are 0.78
// and more, of a street's one side and of a box before a wall up to 0.6.
constexpr double kMinLocalShare = 0.7;

// Old houses have verticals a degree apart: the longest pencil stands for all that are nearly
// parallel to it.
bool HasLongerNeighbour(const std::vector<PlacedPencil>& pencils, std::size_t i) {
  return !pencils[i].of_grid &&
         std::any_of(pencils.begin(), pencils.end(), [&](const PlacedPencil& other) {
           return other.support_px > pencils[i].support_px &&
                  AreAlike(pencils[i].along.direction, other.along.direction);
         });
}

// Length of the lines of two pencils that meet; 0 where these are too few to tell a plane. No
// better than by the weaker of the two: one long pencil makes no plane. What is one thing meets
// all over; of a room's long pencils the half that meets may do so by accident.
double JointSupport(const PlacedPencil& a, const PlacedPencil& b, double diagonal_px) {
  const double of_a = MeetingLength(a.ends, b.ends, diagonal_px),
               of_b = MeetingLength(b.ends, a.ends, diagonal_px);
  const double share = std::min(of_a / a.support_px, of_b / b.support_px);
  const double larger_share = std::max(of_a / a.support_px, of_b / b.support_px);
  const bool is_rectangle =
      (share >= kMinRectangularShare && Rectangular(a.along, b.along)) ||
      (larger_share >= kMinRectangularShare && RightAngle(a.along, b.along).LogOdds() > 0.0);
  const bool is_plane = share >= kMinSpanningShare || is_rectangle;
  return is_plane ? 2.0 * std::min(of_a, of_b) * std::sqrt(share) : 0.0;
}

// Where the lines of a pencil are against the horizon of a plane, shares of their length: on the
// side that has less, and near to it.
struct Sides {
  double beyond = 0.0, grazing = 0.0;

  Sides(const std::vector<DetectedLine>& lines, const PlacedPencil& pencil,
        const Eigen::Vector3d& normal) {
    double all = 0.0, in_front = 0.0;
    for (const int i : pencil.members) {
      const DetectedLine& line = lines[static_cast<std::size_t>(i)];
      const double sine = LineOdds(line.fit).middle().dot(normal);
      all += line.length_px;
      in_front += sine > 0.0 ? line.length_px : 0.0;
      grazing += std::abs(sine) < kGrazing ? line.length_px : 0.0;
    }
    if (!(all > 0.0)) return;
    beyond = std::min(in_front, all - in_front) / all;
    grazing /= all;
  }
};

// The lines of the region in which lines of about the directions of two pencils form corners.
std::vector<int> LinesWhereTheyMeet(const std::vector<DetectedLine>& lines,
                                    const std::array<DetectedPencil, 2>& pair, double diagonal_px) {
  std::array<std::vector<Segment>, 2> alike;
  for (std::size_t k = 0; k < 2; ++k) {
    const Eigen::Vector3d& direction = pair[k].observation.fit->direction;
    for (const DetectedLine& line : lines) {
      if (std::abs(line.fit.line.dot(direction)) < kAlikeRad) alike[k].push_back(line.ends);
    }
  }
  const std::array<std::vector<int>, 2> core = ConnectedCore(alike[0], alike[1], diagonal_px);
  std::vector<Eigen::Vector2d> points;
  for (std::size_t k = 0; k < 2; ++k) {
    for (const int i : core[k]) {
      const Segment& s = alike[k][static_cast<std::size_t>(i)];
      points.insert(points.end(), s.begin(), s.end());
    }
  }
  const ConvexRegion region(points, kRegionGrowth);
  std::vector<int> inside;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (region.Contains(lines[i].ends)) inside.push_back(static_cast<int>(i));
  }
  return inside;
}

class PlaneChooser {
 public:
  // All must outlive it.
  PlaneChooser(const AssemblyOptions& options, const std::vector<DetectedLine>& lines,
               const std::vector<CircleEvidence>& circles)
      : options_(options), lines_(lines), circles_(circles), rims_(circles) {}

  Plane OfCircles() const {
    Plane best;
    for (std::size_t i = 0; i < std::min(circles_.size(), kMaxSeeds); ++i) {
      const CircleEvidence& circle = circles_[i];
      for (int k = 0; k < circle.num_normals; ++k) {
        Plane plane = GrowFrom(circle.normals[static_cast<std::size_t>(k)]);
        if (plane.support_px > best.support_px) best = std::move(plane);
      }
    }
    const double least = options_.camera.log_focal > 0.0 ? std::log(kFocalTrials) : 0.0;
    if (best.circles.size() < 2 || LogOdds(best.normal) > least) return best;
    Plane lone;
    lone.normal = circles_[0].normals[0];
    lone.circles = {0};
    lone.support_px = kCircleWeight * circles_[0].support_px;
    return lone;
  }

  Plane Choose(const Plane& of_circles, std::vector<PlacedPencil>* pencils) const {
    Plane plane = Best(of_circles, *pencils);
    while (!Refit(&plane, pencils)) plane = Best(of_circles, *pencils);
    return plane;
  }

 private:
  // The best supported rim of a solid speaks for all.
  void AddCircles(Plane* plane) const {
    for (std::size_t i = 0; i < circles_.size(); ++i) {
      const int circle = static_cast<int>(i);
      if (rims_.IsSilent(circle, plane->circles, plane->normal.direction) ||
          !CanLieIn(*circles_[i].observation.fit, plane->normal))
        continue;
      plane->circles.push_back(circle);
      plane->support_px += kCircleWeight * circles_[i].support_px;
    }
  }

  // The plane of circles alone that starts from one circle's normal: that of all that agree, until
  // no more join. What agrees with the start alone says little, as the normal of a small circle is
  // vague.
  Plane GrowFrom(const UncertainDirection& seed) const {
    Plane plane;
    plane.normal = seed;
    AddCircles(&plane);
    constexpr int kPasses = 3;
    for (int pass = 0; pass < kPasses && plane.circles.size() > 1; ++pass) {
      Plane next;
      next.normal = MeanNormal(plane);
      AddCircles(&next);
      if (pass > 0 && next.support_px < plane.support_px) break;
      plane = next;
    }
    return plane;
  }

  UncertainDirection MeanNormal(const Plane& plane) const {
    std::vector<const ConicFit*> circles;
    for (const int i : plane.circles)
      circles.push_back(&*circles_[static_cast<std::size_t>(i)].observation.fit);
    return NormalOfCircles(plane.normal, options_.max_shared_plane_deg, circles);
  }

  // Logarithm of the odds that circles share a plane with this normal to that all lie any way: a
  // mixture over all circles, each with two normals of which either may be its own, integrated over
  // the plane's normal (Laplace), which is uniform before.
  double LogOdds(const UncertainDirection& normal) const {
    std::vector<double> ratios;
    for (const CircleEvidence& circle : circles_) {
      double ratio = 0.0;
      for (int k = 0; k < circle.num_normals; ++k)
        ratio += LikelihoodRatio(circle.normals[static_cast<std::size_t>(k)], normal.direction);
      ratios.push_back(ratio / circle.num_normals);
    }
    return LogOddsOfMixture(ratios) + std::log(ShareOfHemisphere(normal));
  }

  // The plane with most support: of two pencils and the circles that agree, or of circles alone.
  Plane Best(const Plane& of_circles, const std::vector<PlacedPencil>& pencils) const {
    Plane best;
    const auto consider = [&best](const Plane& plane) {
      if (plane.support_px > best.support_px) best = plane;
    };
    for (std::size_t i = 0; i < pencils.size(); ++i) {
      if (HasLongerNeighbour(pencils, i)) continue;
      for (std::size_t j = i + 1; j < pencils.size(); ++j) {
        if (HasLongerNeighbour(pencils, j)) continue;
        Plane plane;
        if (!SpannedNormal(pencils[i].along, pencils[j].along, &plane.normal)) continue;
        plane.pencils = {static_cast<int>(i), static_cast<int>(j)};
        plane.support_px = JointSupport(pencils[i], pencils[j], options_.diagonal_px);
        if (!(plane.support_px > 0.0) || IsAccident(plane, pencils[i], pencils[j])) continue;
        plane.support_px *= PrecisionShare(plane.normal);
        AddCircles(&plane);
        consider(plane);
      }
    }
    consider(of_circles);
    return best;
  }

  // A plane is seen from one side, and its lines on one side of its horizon. Those on both are of
  // two planes that face each other, as the houses of a street and the walls of a corridor, and not
  // all far away; or they pass for parallel by accident, as ripples, rock and grass do.
  bool IsAccident(const Plane& plane, const PlacedPencil& a, const PlacedPencil& b) const {
    const Sides of_a(lines_, a, plane.normal.direction), of_b(lines_, b, plane.normal.direction);
    return std::min(of_a.beyond, of_b.beyond) > kMostBeyond &&
           std::max(of_a.grazing, of_b.grazing) > 0.5;
  }

  // The two pencils that span the plane may be of one thing, whose lines tell more than those of
  // the whole photo. False where these lines tell that the two are one pencil: there is no such
  // plane, and the one with less support is no more.
  bool Refit(Plane* plane, std::vector<PlacedPencil>* pencils) const {
    if (plane->pencils[0] < 0) return true;
    PlacedPencil& first = (*pencils)[static_cast<std::size_t>(plane->pencils[0])];
    PlacedPencil& second = (*pencils)[static_cast<std::size_t>(plane->pencils[1])];
    if (first.of_grid || second.of_grid) return true;
    std::array<DetectedPencil, 2> pair = {first, second};
    if (!RefitWhereTheyMeet(lines_, &pair, options_.diagonal_px)) return true;
    const PlacedPencil a(std::move(pair[0])), b(std::move(pair[1]));
    if (!SpannedNormal(a.along, b.along, &plane->normal)) {
      pencils->erase(pencils->begin() + plane->pencils[1]);
      return false;
    }
    first = a;
    second = b;
    plane->circles.clear();
    AddCircles(plane);
    return true;
  }

  const AssemblyOptions& options_;
  const std::vector<DetectedLine>& lines_;
  const std::vector<CircleEvidence>& circles_;
  const SolidRims rims_;  // Of circles_.
};

}  // namespace

bool RefitWhereTheyMeet(const std::vector<DetectedLine>& lines, std::array<DetectedPencil, 2>* pair,
                        double diagonal_px) {
  const LineSet set(lines, diagonal_px);
  std::array<DetectedPencil, 2> local = *pair;
  std::vector<int> before;
  constexpr int kPasses = 4;  // Each time with the directions that the last one gave.
  for (int pass = 0; pass < kPasses; ++pass) {
    std::vector<int> inside = LinesWhereTheyMeet(lines, local, diagonal_px);
    if (pass > 0 && inside == before) break;
    for (DetectedPencil& pencil : local) {
      if (!RefitPencil(set, inside, &pencil)) return false;
    }
    before = std::move(inside);
  }
  for (std::size_t k = 0; k < 2; ++k) {
    if (local[k].support_px < kMinLocalShare * (*pair)[k].support_px) return false;
  }
  *pair = std::move(local);
  return true;
}

Plane PlaneOfCircles(const AssemblyOptions& options, const std::vector<CircleEvidence>& circles) {
  return PlaneChooser(options, {}, circles).OfCircles();
}

Plane ChoosePlane(const AssemblyOptions& options, const std::vector<DetectedLine>& lines,
                  const std::vector<CircleEvidence>& circles, const Plane& of_circles,
                  std::vector<PlacedPencil>* pencils) {
  return PlaneChooser(options, lines, circles).Choose(of_circles, pencils);
}

}  // namespace circline
