#include "circline/ransac/detection/assemble_observations.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "circline/ransac/detection/circle_grid.h"
#include "circline/ransac/detection/find_box.h"
#include "circline/ransac/detection/local_pencils.h"
#include "circline/ransac/detection/segment_meetings.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Planes of circles alone start from this many of the best supported ones.
constexpr std::size_t kMaxSeeds = 16;
// Directions nearer than this (a sine; 3 degrees) are one.
constexpr double kDistinctSine = 0.0523;
// Two pencils of one plane cross or form corners, while the edges of a box and the stripes of a
// cushion behind it do not: this share of either's length meets the other. If they are at right
// angles, as those of houses are, the share of one is enough (few of a front's many uprights may
// meet the few cornices that are seen), or the lower one of both.
constexpr double kMinSpanningShare = 0.3;
constexpr double kMinRectangularShare = 0.1;
// A further pencil of the plane meets its lines over this share of its length.
constexpr double kMinMeetingShare = 0.4;
// Or lies in the convex hull of its circles, widened by this factor: a plate reaches beyond them.
constexpr double kCirclesGrowth = 2.0;
// The rim of a circle that agrees with two pencils counts as much as this many times its length in
// lines: it is rarer than a line, and fixes both directions.
constexpr double kCircleWeight = 3.0;

// A pencil, and its direction as the tests take it.
struct PlacedPencil : DetectedPencil {
  explicit PlacedPencil(DetectedPencil pencil)
      : DetectedPencil(std::move(pencil)),
        direction{observation.fit->direction, observation.fit->covariance} {}
  PlacedPencil(DetectedPencil pencil, const Vector3d& along)
      : DetectedPencil(std::move(pencil)), direction{along, Matrix3d::Zero()} {}
  UncertainDirection direction;
  bool of_grid = false;  // A row or column of circles.
  bool spans = false;    // One of the two that the plane was chosen by.
};

// A plane that some of the evidence agrees on.
struct Plane {
  UncertainDirection normal;
  std::array<int, 2> pencils{-1, -1};  // That span it; -1: circles alone.
  std::vector<int> circles;
  double support_px = 0.0;
};

class Assembler {
 public:
  Assembler(const AssemblyOptions& options, const std::vector<DetectedLine>& lines,
            const std::vector<DetectedLine>& bent, std::vector<CircleEvidence>* circles,
            std::vector<DetectedPencil>* pencils)
      : options_(options), lines_(lines), bent_(bent), circles_(*circles) {
    Place(pencils);
  }

  void Assemble(Observations* observations) {
    AddGrid(observations->camera);
    Plane plane = ChoosePlane();
    while (!RefitOnPlane(&plane)) plane = ChoosePlane();
    const bool has_box = AddBox(&plane);
    SetPlane(plane);
    if (!has_box) SetRoles(plane);
    Emit(plane, observations);
  }

 private:
  void Place(std::vector<DetectedPencil>* pencils) {
    for (DetectedPencil& pencil : *pencils) pencils_.emplace_back(std::move(pencil));
  }

  // Rows and columns of the circles' centres are pencils too.
  void AddGrid(const Camera& camera) {
    circles_plane_ = FindCirclesPlane();
    if (circles_plane_.circles.empty()) return;
    // All circles: on small ones the normal is too uncertain to tell who belongs to the plane.
    std::vector<Matrix3d> conics;
    for (const CircleEvidence& circle : circles_) conics.push_back(circle.observation.fit->conic);
    std::vector<DetectedPencil> rows =
        FindGridPencils(camera, conics, circles_plane_.normal.vector);
    const std::size_t before = pencils_.size();
    Place(&rows);
    for (std::size_t i = before; i < pencils_.size(); ++i) pencils_[i].of_grid = true;
  }

  // The normal of a circle that agrees with the plane's, or null.
  const UncertainDirection* AgreeingNormal(const CircleEvidence& circle,
                                           const UncertainDirection& normal) const {
    const UncertainDirection* nearest = nullptr;
    double smallest = options_.max_shared_plane_deg;
    for (int k = 0; k < circle.num_normals; ++k) {
      const UncertainDirection& candidate = circle.normals[static_cast<std::size_t>(k)];
      if (!SamePlane(candidate, normal, options_.max_shared_plane_deg)) continue;
      const double angle = AngleBetweenDeg(candidate, normal);
      if (angle > smallest) continue;
      smallest = angle;
      nearest = &candidate;
    }
    return nearest;
  }

  void AddCircles(Plane* plane) const {
    for (std::size_t i = 0; i < circles_.size(); ++i) {
      if (AgreeingNormal(circles_[i], plane->normal) == nullptr) continue;
      plane->circles.push_back(static_cast<int>(i));
      plane->support_px += kCircleWeight * circles_[i].support_px;
    }
  }

  // The plane of circles alone that starts from one circle's normal: the mean of all that agree,
  // weighted by their accuracy, until no more join.
  Plane GrowFrom(const UncertainDirection& seed) const {
    Plane plane;
    plane.normal = seed;
    AddCircles(&plane);
    constexpr int kPasses = 3;
    for (int pass = 0; pass < kPasses && plane.circles.size() > 1; ++pass) {
      Plane next;
      next.normal = MeanNormal(plane);
      AddCircles(&next);
      if (next.support_px < plane.support_px) break;
      plane = next;
    }
    return plane;
  }

  UncertainDirection MeanNormal(const Plane& plane) const {
    std::vector<const UncertainDirection*> normals;
    for (const int i : plane.circles) {
      normals.push_back(AgreeingNormal(circles_[static_cast<std::size_t>(i)], plane.normal));
    }
    return MeanDirection(plane.normal, normals);
  }

  // Old houses have verticals a degree apart: the longest pencil stands for all that are nearly
  // parallel to it.
  bool HasLongerNeighbour(std::size_t i) const {
    return !pencils_[i].of_grid &&
           std::any_of(pencils_.begin(), pencils_.end(), [&](const PlacedPencil& other) {
             return other.support_px > pencils_[i].support_px &&
                    Near(pencils_[i], other.direction.vector);
           });
  }

  // Length of the lines of two pencils that meet; 0 where these are too few to tell a plane. No
  // better than by the weaker of the two: one long pencil makes no plane. What is one thing meets
  // all over; of a room's long pencils the half that meets may do so by accident.
  double JointSupport(std::size_t i, std::size_t j) const {
    const PlacedPencil& a = pencils_[i];
    const PlacedPencil& b = pencils_[j];
    const double of_a = MeetingLength(a.ends, b.ends, options_.diagonal_px),
                 of_b = MeetingLength(b.ends, a.ends, options_.diagonal_px);
    const double share = std::min(of_a / a.support_px, of_b / b.support_px);
    const double larger_share = std::max(of_a / a.support_px, of_b / b.support_px);
    const bool is_plane =
        share >= kMinSpanningShare ||
        (share >= kMinRectangularShare && Rectangular(a.direction, b.direction)) ||
        (larger_share >= kMinSpanningShare && LogOddsOfRightAngle(a.direction, b.direction) > 0.0);
    return is_plane ? 2.0 * std::min(of_a, of_b) * std::sqrt(share) : 0.0;
  }

  // The plane with most support: of two pencils and the circles that agree, or of circles alone.
  Plane ChoosePlane() const {
    Plane best;
    const auto consider = [&best](const Plane& plane) {
      if (plane.support_px > best.support_px) best = plane;
    };
    for (std::size_t i = 0; i < pencils_.size(); ++i) {
      if (HasLongerNeighbour(i)) continue;
      for (std::size_t j = i + 1; j < pencils_.size(); ++j) {
        if (HasLongerNeighbour(j)) continue;
        Plane plane;
        if (!SpannedNormal(pencils_[i].direction, pencils_[j].direction, &plane.normal)) continue;
        plane.pencils = {static_cast<int>(i), static_cast<int>(j)};
        plane.support_px = JointSupport(i, j);
        if (!(plane.support_px > 0.0)) continue;
        AddCircles(&plane);
        consider(plane);
      }
    }
    consider(circles_plane_);
    return best;
  }

  // The two pencils that span the plane may be of one thing, whose lines tell more than those of
  // the whole photo. False where these lines tell that the two are one pencil: there is no such
  // plane, and the one with less support is no more.
  bool RefitOnPlane(Plane* plane) {
    if (plane->pencils[0] < 0) return true;
    PlacedPencil& first = pencils_[static_cast<std::size_t>(plane->pencils[0])];
    PlacedPencil& second = pencils_[static_cast<std::size_t>(plane->pencils[1])];
    if (first.of_grid || second.of_grid) return true;
    std::array<DetectedPencil, 2> pair = {first, second};
    if (!RefitWhereTheyMeet(lines_, &pair, options_.diagonal_px)) return true;
    const PlacedPencil a(std::move(pair[0])), b(std::move(pair[1]));
    if (!SpannedNormal(a.direction, b.direction, &plane->normal)) {
      pencils_.erase(pencils_.begin() + plane->pencils[1]);
      return false;
    }
    first = a;
    second = b;
    plane->circles.clear();
    AddCircles(plane);
    return true;
  }

  // Where circles are all that the plane has: a box on it, whose edges become its axes.
  bool AddBox(Plane* plane) {
    if (plane->pencils[0] >= 0 || plane->circles.empty()) return false;
    std::vector<UncertainDirection> normals = {plane->normal};
    if (plane->circles.size() == 1) {
      const CircleEvidence& circle = circles_[static_cast<std::size_t>(plane->circles[0])];
      normals.assign(circle.normals.begin(), circle.normals.begin() + circle.num_normals);
    }
    std::vector<DetectedLine> lines = lines_;
    lines.insert(lines.end(), bent_.begin(), bent_.end());
    std::vector<Vector3d> vectors;
    for (const UncertainDirection& normal : normals) vectors.push_back(normal.vector);
    std::optional<FoundBox> box = FindBox(lines, vectors, options_.diagonal_px);
    if (!box) return false;
    plane->normal = normals[box->normal];
    for (int k = 0; k < 3; ++k) {
      PlacedPencil pencil(std::move(box->pencils[static_cast<std::size_t>(k)]), box->axes.col(k));
      pencil.observation.direction = static_cast<PencilDirection>(k);
      if (k < 2) pencil.observation.plane = "p0";
      pencils_.push_back(std::move(pencil));
    }
    return true;
  }

  // The plane with most support of circles alone; where it is likelier that they agree by accident,
  // that of the best supported circle.
  Plane FindCirclesPlane() const {
    Plane best;
    for (std::size_t i = 0; i < std::min(circles_.size(), kMaxSeeds); ++i) {
      const CircleEvidence& circle = circles_[i];
      for (int k = 0; k < circle.num_normals; ++k) {
        Plane plane = GrowFrom(circle.normals[static_cast<std::size_t>(k)]);
        if (plane.support_px > best.support_px) best = std::move(plane);
      }
    }
    if (best.circles.size() < 2 || LogOdds(best.normal) > 0.0) return best;
    Plane lone;
    lone.normal = circles_[0].normals[0];
    lone.circles = {0};
    lone.support_px = kCircleWeight * circles_[0].support_px;
    return lone;
  }

  // Logarithm of the odds that circles share a plane with this normal to that all lie any way: a
  // mixture over all circles, each with two normals of which either may be its own, integrated over
  // the plane's normal (Laplace), which is uniform before.
  double LogOdds(const UncertainDirection& normal) const {
    std::vector<double> ratios;
    for (const CircleEvidence& circle : circles_) {
      double ratio = 0.0;
      for (int k = 0; k < circle.num_normals; ++k)
        ratio += LikelihoodRatio(circle.normals[static_cast<std::size_t>(k)], normal.vector);
      ratios.push_back(ratio / circle.num_normals);
    }
    return LogOddsOfMixture(ratios) + std::log(ShareOfHemisphere(normal));
  }

  void SetPlane(const Plane& plane) {
    for (const int i : plane.circles)
      circles_[static_cast<std::size_t>(i)].observation.plane = "p0";
    if (plane.support_px <= 0.0) return;
    for (PlacedPencil& pencil : pencils_) {
      if (!InPlane(pencil.direction, plane.normal, options_.max_shared_plane_deg)) continue;
      if (BelongsTo(plane, pencil)) pencil.observation.plane = "p0";
    }
    for (const int i : plane.pencils) {
      if (i < 0) continue;
      pencils_[static_cast<std::size_t>(i)].observation.plane = "p0";
      pencils_[static_cast<std::size_t>(i)].spans = true;
    }
  }

  // Any direction lies in a plane to within a few degrees once in ten times, by accident. So its
  // lines must also meet those that span the plane; or, where circles are all there is, be among
  // them, and two of them at least must have settled the normal (one leaves two, which doubles the
  // accidents).
  bool BelongsTo(const Plane& plane, const PlacedPencil& pencil) const {
    if (plane.pencils[0] < 0) return plane.circles.size() >= 2 && IsAmongCircles(plane, pencil);
    double meeting = 0.0;
    for (const int i : plane.pencils) {
      meeting += MeetingLength(pencil.ends, pencils_[static_cast<std::size_t>(i)].ends,
                               options_.diagonal_px);
    }
    return meeting >= kMinMeetingShare * pencil.support_px;
  }

  bool IsAmongCircles(const Plane& plane, const PlacedPencil& pencil) const {
    std::vector<Eigen::Vector2d> points;
    for (const int i : plane.circles) {
      const auto& contour = circles_[static_cast<std::size_t>(i)].observation.points;
      points.insert(points.end(), contour.begin(), contour.end());
    }
    const ConvexRegion region(std::move(points), kCirclesGrowth);
    double inside = 0.0, total = 0.0;
    for (const Segment& s : pencil.ends) {
      const double length = (s[1] - s[0]).norm();
      total += length;
      inside += region.Contains(s) ? length : 0.0;
    }
    return inside >= kMinMeetingShare * total;
  }

  // The strongest pencil of the plane is the candidate for x, the strongest one orthogonal to it y.
  void SetRoles(const Plane& plane) {
    const std::vector<int> order = InPlaneOrder(plane);
    for (std::size_t a = 0; a < order.size(); ++a) {
      for (std::size_t b = a + 1; b < order.size(); ++b) {
        PlacedPencil& x = pencils_[static_cast<std::size_t>(order[a])];
        PlacedPencil& y = pencils_[static_cast<std::size_t>(order[b])];
        const bool grid = x.of_grid && y.of_grid && Rectangular(x.direction, y.direction);
        if (!grid && !(LogOddsOfRightAngle(x.direction, y.direction) > 0.0)) continue;
        x.observation.direction = PencilDirection::kX;
        y.observation.direction = PencilDirection::kY;
        SetNormalRole(x.direction, y.direction);
        return;
      }
    }
  }

  // Pencils of the plane: those that span it, then the others by support, but for repetitions.
  std::vector<int> InPlaneOrder(const Plane& plane) const {
    std::vector<int> order;
    for (const int i : plane.pencils) {
      if (i >= 0) order.push_back(i);
    }
    for (std::size_t i = 0; i < pencils_.size(); ++i) {
      const int k = static_cast<int>(i);
      const bool is_new = std::none_of(order.begin(), order.end(), [&](int other) {
        return Near(pencils_[i], pencils_[static_cast<std::size_t>(other)].direction.vector);
      });
      if (pencils_[i].observation.plane == "p0" && is_new) order.push_back(k);
    }
    return order;
  }

  void SetNormalRole(const UncertainDirection& x, const UncertainDirection& y) {
    for (PlacedPencil& pencil : pencils_) {
      if (!pencil.observation.plane.empty()) continue;
      if (!(LogOddsOfRightAngle(pencil.direction, x) > 0.0) ||
          !(LogOddsOfRightAngle(pencil.direction, y) > 0.0)) {
        continue;
      }
      pencil.observation.direction = PencilDirection::kZ;
      return;
    }
  }

  // Everything in its final order, with ids; repetitions and pencils beyond max_pencils are left
  // out.
  void Emit(const Plane& plane, Observations* observations) {
    const auto on_plane_first = [](const auto& a, const auto& b) {
      return !a.observation.plane.empty() && b.observation.plane.empty();
    };
    std::stable_sort(circles_.begin(), circles_.end(), on_plane_first);
    const auto rank = [](const PlacedPencil& p) {
      const bool has_role = p.observation.direction != PencilDirection::kFree;
      return std::make_pair(has_role || p.spans ? 0 : 1, p.observation.plane.empty() ? 1 : 0);
    };
    std::stable_sort(
        pencils_.begin(), pencils_.end(),
        [&](const PlacedPencil& a, const PlacedPencil& b) { return rank(a) < rank(b); });
    for (CircleEvidence& circle : circles_) {
      circle.observation.id = "c" + std::to_string(observations->circles.size());
      observations->circles.push_back(std::move(circle.observation));
    }
    std::vector<Vector3d> directions;
    for (PlacedPencil& pencil : pencils_) {
      if (static_cast<int>(observations->pencils.size()) >= options_.max_pencils) break;
      if (IsRepetition(pencil, directions)) continue;
      directions.push_back(pencil.direction.vector);
      const std::string number = std::to_string(observations->pencils.size());
      pencil.observation.id = "L" + number;
      // Directions of different things: without a plane each they would be taken to span one.
      if (!(plane.support_px > 0.0)) pencil.observation.plane = "p" + number;
      observations->pencils.push_back(std::move(pencil.observation));
    }
    if (plane.support_px > 0.0) observations->frame.plane = "p0";
  }

  static bool Near(const PlacedPencil& pencil, const Vector3d& direction) {
    return pencil.direction.vector.cross(direction).norm() < kDistinctSine;
  }

  // Old houses have verticals a degree apart: what is nearly parallel to a better supported pencil
  // says nothing new, and no plane is spanned by both.
  static bool IsRepetition(const PlacedPencil& pencil, const std::vector<Vector3d>& emitted) {
    return std::any_of(emitted.begin(), emitted.end(),
                       [&](const Vector3d& direction) { return Near(pencil, direction); });
  }

  const AssemblyOptions& options_;
  const std::vector<DetectedLine>&lines_, &bent_;
  std::vector<CircleEvidence>& circles_;
  std::vector<PlacedPencil> pencils_;
  Plane circles_plane_;  // Of circles alone.
};

}  // namespace

void AssembleObservations(const AssemblyOptions& options, const std::vector<DetectedLine>& lines,
                          const std::vector<DetectedLine>& bent,
                          std::vector<CircleEvidence>* circles,
                          std::vector<DetectedPencil>* pencils, Observations* observations) {
  Assembler(options, lines, bent, circles, pencils).Assemble(observations);
}

}  // namespace circline
