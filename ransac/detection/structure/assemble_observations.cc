#include "circline/ransac/detection/structure/assemble_observations.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "circline/ransac/detection/lines/segment_meetings.h"
#include "circline/ransac/detection/structure/box_rivals.h"
#include "circline/ransac/detection/structure/choose_plane.h"
#include "circline/ransac/detection/structure/circle_grid.h"
#include "circline/ransac/detection/structure/find_box.h"
#include "circline/ransac/detection/structure/find_rectangle.h"
#include "circline/ransac/detection/structure/judge_axes.h"
#include "circline/ransac/detection/structure/orthogonal_evidence.h"
#include "circline/ransac/detection/structure/pencil_fitter.h"
#include "circline/ransac/detection/structure/solid_rims.h"
#include "circline/ransac/detection/structure/third_direction.h"

namespace circline {
namespace {

using Eigen::Vector3d;

// A further pencil of the plane meets its lines over this share of its length.
constexpr double kMinMeetingShare = 0.4;
// Or lies in the convex hull of its circles, widened by this factor: a plate reaches beyond them.
constexpr double kCirclesGrowth = 2.0;

class Assembler {
 public:
  Assembler(const AssemblyOptions& options, const std::vector<DetectedLine>& lines,
            const std::vector<DetectedLine>& bent, std::vector<CircleEvidence>* circles,
            std::vector<DetectedPencil>* pencils)
      : options_(options), lines_(lines), bent_(bent), circles_(*circles) {
    for (DetectedPencil& pencil : *pencils) pencils_.emplace_back(std::move(pencil));
  }

  void Assemble(Observations* observations) {
    const Plane of_circles = PlaneOfCircles(options_, circles_);
    AddGrid(observations->camera, of_circles);
    Plane plane = ChoosePlane(options_, lines_, circles_, of_circles, &pencils_);
    // A box that stands on the plane where circles are all that this has, or one that has better
    // evidence than two pencils: its edges become the axes.
    const bool has_box = AddBoxOnCircles(&plane) || AddFreeBox(&plane);
    const bool has_rectangle = !has_box && AddRectangle(&plane);
    SetPlane(plane);
    if (has_rectangle) {
      Judge(At(plane.pencils[0]), &At(plane.pencils[1]), nullptr, nullptr);
    } else if (!has_box) {
      SetRoles(plane);
    }
    Emit(plane, observations);
  }

 private:
  // Rows and columns of the circles' centres are pencils too.
  void AddGrid(const Camera& camera, const Plane& of_circles) {
    if (of_circles.circles.empty()) return;
    // All circles: on small ones the normal is too uncertain to tell who belongs to the plane.
    std::vector<Eigen::Matrix3d> conics;
    for (const CircleEvidence& circle : circles_) conics.push_back(circle.observation.fit->conic);
    for (DetectedPencil& row : FindGridPencils(camera, conics, of_circles.normal.direction))
      pencils_.emplace_back(std::move(row)).of_grid = true;
  }

  std::vector<DetectedLine> AllLines() const {
    std::vector<DetectedLine> lines = lines_;
    lines.insert(lines.end(), bent_.begin(), bent_.end());
    return lines;
  }

  bool AddBoxOnCircles(Plane* plane) {
    if (plane->pencils[0] >= 0 || plane->circles.empty()) return false;
    std::vector<UncertainDirection> normals = {plane->normal};
    if (plane->circles.size() == 1) {
      const CircleEvidence& circle = circles_[static_cast<std::size_t>(plane->circles[0])];
      normals.assign(circle.normals.begin(), circle.normals.begin() + circle.num_normals);
    }
    std::vector<Vector3d> axes;
    for (const UncertainDirection& normal : normals) axes.push_back(normal.direction);
    std::optional<FoundBox> box = FindBox(AllLines(), axes, options_.diagonal_px);
    if (!box || YieldsToPencils(*box, options_, lines_, circles_, plane, &pencils_)) return false;
    plane->normal = normals[box->given];
    int& rim = plane->circles[0];
    if (normals.size() > 1) rim = SolidRims(circles_).RimOf(rim, plane->normal.direction);
    PlaceBox(&*box);
    return true;
  }

  // Where two circles or more, or a circle and two pencils, have a plane, that is no box's.
  bool AddFreeBox(Plane* plane) {
    const bool is_of_pencils = plane->pencils[0] >= 0;
    if (plane->circles.size() > (is_of_pencils ? 0 : 1)) return false;
    if (is_of_pencils && OutweighAnyBox(lines_, At(plane->pencils[0]), At(plane->pencils[1])))
      return false;
    std::vector<Vector3d> axes;
    for (const PlacedPencil& pencil : pencils_) {
      if (!pencil.of_grid) axes.push_back(pencil.along.direction);
    }
    std::optional<FoundBox> box = FindFreeBox(AllLines(), axes, options_.diagonal_px);
    if (!box && !is_of_pencils) box = FindAnyBox(AllLines(), options_.diagonal_px);
    if (!box || YieldsToPencils(*box, options_, lines_, circles_, plane, &pencils_)) return false;
    *plane = Plane();
    plane->normal.direction = box->axes.col(2);
    plane->support_px = box->pencils[0].support_px + box->pencils[1].support_px;
    const int first = static_cast<int>(pencils_.size());
    plane->pencils = {first, first + 1};
    PlaceBox(&*box);
    return true;
  }

  // Where there is no plane, or that of one circle, which leaves two, and can lie in the third: the
  // sides of a rectangle.
  bool AddRectangle(Plane* plane) {
    if (plane->pencils[0] >= 0 || plane->circles.size() > 1) return false;
    auto found = FindRectangle(options_, AllLines());
    if (!found) return false;
    PlacedPencil x(std::move((*found)[0])), y(std::move((*found)[1]));
    UncertainDirection normal;
    if (!SpannedNormal(x.along, y.along, &normal)) return false;
    for (const int i : plane->circles) {
      if (!CanLieIn(*circles_[static_cast<std::size_t>(i)].observation.fit, normal)) return false;
    }
    plane->normal = normal;
    plane->support_px = x.support_px + y.support_px;
    const int first = static_cast<int>(pencils_.size());
    plane->pencils = {first, first + 1};
    x.observation.direction = PencilDirection::kX;
    y.observation.direction = PencilDirection::kY;
    pencils_.push_back(std::move(x));
    pencils_.push_back(std::move(y));
    return true;
  }

  void PlaceBox(FoundBox* box) {
    for (int k = 0; k < 3; ++k) {
      PlacedPencil pencil(std::move(box->pencils[static_cast<std::size_t>(k)]), box->axes.col(k));
      pencil.observation.direction = static_cast<PencilDirection>(k);
      if (k < 2) pencil.observation.plane = "p0";
      pencils_.push_back(std::move(pencil));
    }
  }

  PlacedPencil& At(int i) { return pencils_[static_cast<std::size_t>(i)]; }

  void SetPlane(const Plane& plane) {
    for (const int i : plane.circles)
      circles_[static_cast<std::size_t>(i)].observation.plane = "p0";
    if (plane.support_px <= 0.0) return;
    for (PlacedPencil& pencil : pencils_) {
      if (!InPlane(pencil.along, plane.normal, options_.max_shared_plane_deg)) continue;
      if (BelongsTo(plane, pencil)) pencil.observation.plane = "p0";
    }
    for (const int i : plane.pencils) {
      if (i < 0) continue;
      At(i).observation.plane = "p0";
      At(i).spans = true;
    }
  }

  // Any direction lies in a plane to within a few degrees once in ten times, by accident. So its
  // lines must also meet those that span the plane; or, where circles are all there is, be among
  // them, and two of them at least must have settled the normal (one leaves two, which doubles the
  // accidents).
  bool BelongsTo(const Plane& plane, const PlacedPencil& pencil) {
    if (plane.pencils[0] < 0) return plane.circles.size() >= 2 && IsAmongCircles(plane, pencil);
    double meeting = 0.0;
    for (const int i : plane.pencils)
      meeting += MeetingLength(pencil.ends, At(i).ends, options_.diagonal_px);
    return meeting >= kMinMeetingShare * pencil.support_px;
  }

  bool IsAmongCircles(const Plane& plane, const PlacedPencil& pencil) const {
    std::vector<Eigen::Vector2d> points;
    for (const int i : plane.circles) {
      const auto& contour = circles_[static_cast<std::size_t>(i)].observation.points;
      points.insert(points.end(), contour.begin(), contour.end());
    }
    const ConvexRegion region(points, kCirclesGrowth);
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
        PlacedPencil &x = At(order[a]), &y = At(order[b]);
        const bool grid = x.of_grid && y.of_grid && Rectangular(x.along, y.along);
        if (!grid && !(RightAngle(x.along, y.along, options_.camera).LogOdds() > 0.0)) continue;
        x.observation.direction = PencilDirection::kX;
        y.observation.direction = PencilDirection::kY;
        if (plane.circles.empty() && !x.of_grid && !y.of_grid) ReadAgain(&x, &y);
        const std::size_t other = a > 0 ? 0 : b > 1 ? 1 : 2;  // The first beside them.
        Judge(x, &y, SetNormalRole(x.along, y.along),
              other < order.size() ? &At(order[other]) : nullptr);
        return;
      }
    }
  }

  // How else the less well known of two pencils may run: what lines are its own is not certain.
  void ReadAgain(PlacedPencil* x, PlacedPencil* y) const {
    if (x->along.covariance.trace() > y->along.covariance.trace()) std::swap(x, y);
    const LineSet set(lines_, options_.diagonal_px);
    std::vector<LineFit> others;
    int num_own = 0;  // Of these: a line may be in both.
    for (int i = 0; i < static_cast<int>(lines_.size()); ++i) {
      if (set.IsTwin(i) || x->Has(i)) continue;
      others.push_back(set.fits[static_cast<std::size_t>(i)]);
      num_own += y->Has(i) ? 1 : 0;
    }
    y->observation.readings =
        ReadDirection(others, x->along.direction, y->along.direction, num_own);
  }

  // Pencils of the plane: those that span it, then the others by support, but for repetitions.
  std::vector<int> InPlaneOrder(const Plane& plane) {
    std::vector<int> order;
    for (const int i : plane.pencils) {
      if (i >= 0) order.push_back(i);
    }
    for (std::size_t i = 0; i < pencils_.size(); ++i) {
      const bool is_new = std::none_of(order.begin(), order.end(), [&](int other) {
        return AreAlike(pencils_[i].along.direction, At(other).along.direction);
      });
      if (pencils_[i].observation.plane == "p0" && is_new) order.push_back(static_cast<int>(i));
    }
    return order;
  }

  // The axes of a camera that is a guess. Where there is no z, of lines along the normal that are
  // too few to have been found by themselves, too. All pencils may move.
  void Judge(const PlacedPencil& x, PlacedPencil* y, PlacedPencil* z, const PlacedPencil* skew) {
    if (!(options_.camera.log_focal > 0.0)) return;
    std::optional<ThirdPencil> found;
    if (z == nullptr)
      found = FindThirdPencil(LineSet(lines_, options_.diagonal_px), x, *y, options_.camera);
    if (!found) {
      JudgeAxes(options_, x, y, z, skew);
      return;
    }
    PlacedPencil normal(std::move(found->pencil));
    normal.observation.direction = PencilDirection::kZ;
    JudgeAxes(options_, x, y, &normal, skew, found->ratio);
    pencils_.push_back(std::move(normal));
  }

  // Null where no pencil can be along the normal.
  PlacedPencil* SetNormalRole(const UncertainDirection& x, const UncertainDirection& y) {
    for (PlacedPencil& pencil : pencils_) {
      if (!pencil.observation.plane.empty()) continue;
      if (!(RightAngle(pencil.along, x, options_.camera).LogOdds() > 0.0) ||
          !(RightAngle(pencil.along, y, options_.camera).LogOdds() > 0.0))
        continue;
      pencil.observation.direction = PencilDirection::kZ;
      return &pencil;
    }
    return nullptr;
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
      // Old houses have verticals a degree apart: what is nearly parallel to a better supported
      // pencil says nothing new, and no plane is spanned by both.
      const auto is_like = [&](const Vector3d& v) { return AreAlike(v, pencil.along.direction); };
      if (std::any_of(directions.begin(), directions.end(), is_like)) continue;
      directions.push_back(pencil.along.direction);
      const std::string number = std::to_string(observations->pencils.size());
      pencil.observation.id = "L" + number;
      // Directions of different things: without a plane each they would be taken to span one.
      if (!(plane.support_px > 0.0)) pencil.observation.plane = "p" + number;
      observations->pencils.push_back(std::move(pencil.observation));
    }
    if (plane.support_px > 0.0) observations->frame.plane = "p0";
  }

  const AssemblyOptions& options_;
  const std::vector<DetectedLine>&lines_, &bent_;
  std::vector<CircleEvidence>& circles_;
  std::vector<PlacedPencil> pencils_;
};

}  // namespace

void AssembleObservations(const AssemblyOptions& options, const std::vector<DetectedLine>& lines,
                          const std::vector<DetectedLine>& bent,
                          std::vector<CircleEvidence>* circles,
                          std::vector<DetectedPencil>* pencils, Observations* observations) {
  Assembler(options, lines, bent, circles, pencils).Assemble(observations);
}

}  // namespace circline
