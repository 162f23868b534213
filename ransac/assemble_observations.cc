#include "circline/ransac/assemble_observations.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "circline/estimators/circle_pose.h"
#include "circline/estimators/conic.h"
#include "circline/ransac/circle_grid.h"
#include "circline/ransac/segment_meetings.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kRadians = 3.14159265358979323846 / 180.0;

// Errors of a direction or a normal that no covariance of edge points knows: calibration, surfaces
// that are not quite plane, prints that are not quite round. Standard deviation, degrees.
constexpr double kModelSigmaDeg = 0.5;
// Agreement is believed up to this many standard deviations.
constexpr double kMaxSigmas = 3.0;
// Two directions count as orthogonal within 2.5 standard deviations plus a quarter of a degree, and
// never beyond 1.25 degrees: real streets and walls are off by more, and a false right angle
// biases.
constexpr double kOrthogonalSigmas = 2.5;
constexpr double kOrthogonalDeg = 0.25;
constexpr double kMaxOrthogonalDeg = 1.25;
// Rows and columns of a sheet of circles are made at right angles; paper that bends shows them at
// others. A lattice this near to a rectangular one is rectangular.
constexpr double kRectangularDeg = 4.0;
// Planes of circles alone start from this many of the best supported ones.
constexpr std::size_t kMaxSeeds = 16;
// Directions nearer than this are one.
constexpr double kDistinctDeg = 3.0;
// Two pencils span a plane if they are this far from parallel.
constexpr double kMinSpanDeg = 15.0;
// Two pencils of one plane cross or form corners, while the edges of a box and the stripes of a
// cushion behind it do not: this share of either's length meets the other.
constexpr double kMinSpanningShare = 0.1;
// The region of a thing's lines is widened by this factor: its outermost lines meet none.
constexpr double kRegionGrowth = 1.1;
// Lines that miss a direction by up to this are alike, radians.
constexpr double kAlikeRad = 0.05;
// It is one thing if its lines are this share of either pencil's length.
constexpr double kMinLocalShare = 0.5;
// A further pencil of the plane meets its lines over this share of its length.
constexpr double kMinMeetingShare = 0.4;
// The rim of a circle that agrees with two pencils counts as much as this many times its length in
// lines: it is rarer than a line, and fixes both directions.
constexpr double kCircleWeight = 3.0;

// Angle between two axes (no sense of sign) and its standard deviation.
struct AngleTest {
  double angle_deg = 0.0, sigma_deg = 0.0;
};

AngleTest Compare(const UncertainDirection& a, const UncertainDirection& b) {
  const double sign = a.vector.dot(b.vector) < 0.0 ? -1.0 : 1.0;
  const Vector3d difference = a.vector - sign * b.vector;
  const double norm = difference.norm();
  AngleTest test;
  test.angle_deg = 2.0 * std::asin(std::min(1.0, 0.5 * norm)) / kRadians;
  const Matrix3d covariance = a.covariance + b.covariance;
  const double variance = norm > 1e-12 ? difference.dot(covariance * difference) / (norm * norm)
                                       : 0.5 * covariance.trace();
  test.sigma_deg = std::hypot(std::sqrt(std::max(0.0, variance)) / kRadians, kModelSigmaDeg);
  return test;
}

// How far from 90 degrees.
AngleTest CompareToRightAngle(const UncertainDirection& a, const UncertainDirection& b) {
  AngleTest test;
  test.angle_deg = std::asin(std::min(1.0, std::abs(a.vector.dot(b.vector)))) / kRadians;
  const double variance =
      a.vector.dot(b.covariance * a.vector) + b.vector.dot(a.covariance * b.vector);
  test.sigma_deg = std::sqrt(std::max(0.0, variance)) / kRadians;
  return test;
}

bool SamePlane(const UncertainDirection& a, const UncertainDirection& b, double max_deg) {
  const AngleTest test = Compare(a, b);
  return test.angle_deg <= std::min(max_deg, kMaxSigmas * test.sigma_deg);
}

bool InPlane(const UncertainDirection& direction, const UncertainDirection& normal,
             double max_deg) {
  const AngleTest test = CompareToRightAngle(direction, normal);
  return test.angle_deg <=
         std::min(max_deg, kMaxSigmas * std::hypot(test.sigma_deg, kModelSigmaDeg));
}

bool Orthogonal(const UncertainDirection& a, const UncertainDirection& b) {
  const AngleTest test = CompareToRightAngle(a, b);
  return test.angle_deg <=
         std::min(kMaxOrthogonalDeg, kOrthogonalSigmas * test.sigma_deg + kOrthogonalDeg);
}

bool Rectangular(const UncertainDirection& a, const UncertainDirection& b) {
  return CompareToRightAngle(a, b).angle_deg <= kRectangularDeg;
}

// Normal of the plane that two directions span: first-order propagation through the normalised
// cross product. False where they are too nearly parallel.
bool SpannedNormal(const UncertainDirection& a, const UncertainDirection& b,
                   UncertainDirection* normal) {
  const Vector3d cross = a.vector.cross(b.vector);
  const double sine = cross.norm();
  if (sine < std::sin(kMinSpanDeg * kRadians)) return false;
  normal->vector = cross / sine;
  const Matrix3d tangent =
      (Matrix3d::Identity() - normal->vector * normal->vector.transpose()) / sine;
  Matrix3d cross_a, cross_b;
  for (int k = 0; k < 3; ++k) {
    cross_a.col(k) = a.vector.cross(Vector3d::Unit(k));
    cross_b.col(k) = Vector3d::Unit(k).cross(b.vector);
  }
  const Matrix3d ja = tangent * cross_b, jb = tangent * cross_a;
  normal->covariance = ja * a.covariance * ja.transpose() + jb * b.covariance * jb.transpose();
  return true;
}

// A pencil, and its direction as the tests take it.
struct PlacedPencil : DetectedPencil {
  PlacedPencil(DetectedPencil pencil, UncertainDirection d)
      : DetectedPencil(std::move(pencil)), direction(std::move(d)) {}
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
            std::vector<CircleEvidence>* circles, std::vector<DetectedPencil>* pencils)
      : options_(options), lines_(lines), circles_(*circles) {
    Place(pencils);
  }

  void Assemble(Observations* observations) {
    AddGrid(observations->camera);
    Plane plane = ChoosePlane();
    RefitOnPlane(&plane);
    SetPlane(plane);
    SetRoles(plane);
    Emit(plane, observations);
  }

 private:
  void Place(std::vector<DetectedPencil>* pencils) {
    for (DetectedPencil& pencil : *pencils) {
      const VanishingPointFit fit = *pencil.observation.fit;
      const UncertainDirection direction{fit.direction, fit.covariance};
      pencils_.emplace_back(std::move(pencil), direction);
    }
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
      const double angle = Compare(candidate, normal).angle_deg;
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
    const double model = kModelSigmaDeg * kRadians;
    Vector3d sum = Vector3d::Zero();
    Matrix3d information = Matrix3d::Zero();
    const Matrix3d tangent =
        Matrix3d::Identity() - plane.normal.vector * plane.normal.vector.transpose();
    for (const int i : plane.circles) {
      const UncertainDirection* n =
          AgreeingNormal(circles_[static_cast<std::size_t>(i)], plane.normal);
      // Regular across the tangent plane by the model's variance, along the normal by a nominal
      // one.
      const Matrix3d weight = (n->covariance + model * model * Matrix3d::Identity()).inverse();
      const Matrix3d w = tangent * weight * tangent;
      information += w;
      sum += w * (n->vector - plane.normal.vector);
    }
    // Invertible: what is added acts along the normal only.
    const Matrix3d normal_part = plane.normal.vector * plane.normal.vector.transpose();
    const Matrix3d inverse = (information + information.trace() * normal_part).inverse();
    UncertainDirection mean;
    mean.vector = (plane.normal.vector + tangent * (inverse * sum)).normalized();
    mean.covariance = tangent * inverse * tangent;
    return mean;
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
  // better than by the weaker of the two: one long pencil makes no plane.
  double JointSupport(std::size_t i, std::size_t j) const {
    const PlacedPencil& a = pencils_[i];
    const PlacedPencil& b = pencils_[j];
    const double of_a = MeetingLength(a.ends, b.ends), of_b = MeetingLength(b.ends, a.ends);
    if (of_a < kMinSpanningShare * a.support_px || of_b < kMinSpanningShare * b.support_px) {
      return 0.0;
    }
    return 2.0 * std::min(of_a, of_b);
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

  // The lines of the pencils that span the plane came from the whole photo, and only those that are
  // exactly parallel. The region in which the two meet may be one thing: then all its lines count,
  // bent or not, and no others.
  void RefitOnPlane(Plane* plane) {
    if (plane->pencils[0] < 0) return;
    const std::array<int, 2> index = plane->pencils;
    std::array<DetectedPencil, 2> local;
    for (std::size_t k = 0; k < 2; ++k) {
      const PlacedPencil& pencil = pencils_[static_cast<std::size_t>(index[k])];
      if (pencil.of_grid) return;
      local[k] = pencil;
    }
    constexpr int kPasses = 4;  // The region grows with what it finds.
    for (int pass = 0; pass < kPasses; ++pass) {
      if (!RefitWhereTheyMeet(&local)) return;
    }
    for (std::size_t k = 0; k < 2; ++k) {
      const PlacedPencil& pencil = pencils_[static_cast<std::size_t>(index[k])];
      if (local[k].support_px < kMinLocalShare * pencil.support_px) return;
    }
    for (std::size_t k = 0; k < 2; ++k) {
      const VanishingPointFit fit = *local[k].observation.fit;
      pencils_[static_cast<std::size_t>(index[k])] =
          PlacedPencil(std::move(local[k]), {fit.direction, fit.covariance});
    }
    SpannedNormal(pencils_[static_cast<std::size_t>(index[0])].direction,
                  pencils_[static_cast<std::size_t>(index[1])].direction, &plane->normal);
  }

  // Fits two pencils to the lines of the region in which lines of about their directions meet;
  // false where they do not.
  bool RefitWhereTheyMeet(std::array<DetectedPencil, 2>* pair) const {
    std::array<std::vector<Segment>, 2> alike;
    for (std::size_t k = 0; k < 2; ++k) {
      const Vector3d& direction = (*pair)[k].observation.fit->direction;
      for (const DetectedLine& line : lines_) {
        if (std::abs(line.fit.line.dot(direction)) < kAlikeRad) alike[k].push_back(line.ends);
      }
    }
    const std::array<std::vector<int>, 2> core = ConnectedCore(alike[0], alike[1]);
    std::vector<Vector2d> points;
    for (std::size_t k = 0; k < 2; ++k) {
      for (const int i : core[k]) {
        const Segment& s = alike[k][static_cast<std::size_t>(i)];
        points.insert(points.end(), s.begin(), s.end());
      }
    }
    const ConvexRegion region(std::move(points), kRegionGrowth);
    std::vector<int> inside;
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      if (region.Contains(lines_[i].ends)) inside.push_back(static_cast<int>(i));
    }
    return RefitPencil(lines_, inside, &(*pair)[0]) && RefitPencil(lines_, inside, &(*pair)[1]);
  }

  // The plane with most support of circles alone.
  Plane FindCirclesPlane() const {
    Plane best;
    for (std::size_t i = 0; i < std::min(circles_.size(), kMaxSeeds); ++i) {
      const CircleEvidence& circle = circles_[i];
      for (int k = 0; k < circle.num_normals; ++k) {
        Plane plane = GrowFrom(circle.normals[static_cast<std::size_t>(k)]);
        if (plane.support_px > best.support_px) best = std::move(plane);
      }
    }
    return best;
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
  // lines must also meet those that span the plane; or, where circles are all there is, two of them
  // at least must have settled the normal (one leaves two, which doubles the accidents).
  bool BelongsTo(const Plane& plane, const PlacedPencil& pencil) const {
    if (plane.pencils[0] < 0) return plane.circles.size() >= 2;
    double meeting = 0.0;
    for (const int i : plane.pencils) {
      meeting += MeetingLength(pencil.ends, pencils_[static_cast<std::size_t>(i)].ends);
    }
    return meeting >= kMinMeetingShare * pencil.support_px;
  }

  // The strongest pencil of the plane is the candidate for x, the strongest one orthogonal to it y.
  void SetRoles(const Plane& plane) {
    const std::vector<int> order = InPlaneOrder(plane);
    for (std::size_t a = 0; a < order.size(); ++a) {
      for (std::size_t b = a + 1; b < order.size(); ++b) {
        PlacedPencil& x = pencils_[static_cast<std::size_t>(order[a])];
        PlacedPencil& y = pencils_[static_cast<std::size_t>(order[b])];
        const bool grid = x.of_grid && y.of_grid && Rectangular(x.direction, y.direction);
        if (!grid && !Orthogonal(x.direction, y.direction)) continue;
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
      if (!Orthogonal(pencil.direction, x) || !Orthogonal(pencil.direction, y)) continue;
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
    for (PlacedPencil& pencil : pencils_) {
      if (static_cast<int>(observations->pencils.size()) >= options_.max_pencils) break;
      if (IsRepetition(pencil, observations->pencils)) continue;
      const std::string number = std::to_string(observations->pencils.size());
      pencil.observation.id = "L" + number;
      // Directions of different things: without a plane each they would be taken to span one.
      if (!(plane.support_px > 0.0)) pencil.observation.plane = "p" + number;
      observations->pencils.push_back(std::move(pencil.observation));
    }
    if (plane.support_px > 0.0) observations->frame.plane = "p0";
  }

  static bool Near(const PlacedPencil& pencil, const Vector3d& direction) {
    return pencil.direction.vector.cross(direction).norm() < std::sin(kDistinctDeg * kRadians);
  }

  // Old houses have verticals a degree apart: what is nearly parallel to a better supported pencil
  // says nothing new, and no plane is spanned by both.
  static bool IsRepetition(const PlacedPencil& pencil,
                           const std::vector<PencilObservation>& emitted) {
    return std::any_of(emitted.begin(), emitted.end(), [&](const PencilObservation& other) {
      return Near(pencil, other.fit->direction);
    });
  }

  const AssemblyOptions& options_;
  const std::vector<DetectedLine>& lines_;
  std::vector<CircleEvidence>& circles_;
  std::vector<PlacedPencil> pencils_;
  Plane circles_plane_;  // Of circles alone.
};

}  // namespace

int CircleNormals(const ConicFit& fit, double inflation,
                  std::array<UncertainDirection, 2>* normals) {
  std::array<CirclePose, 2> poses;
  const int count = CirclePoses(fit.conic, &poses);
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(fit.Covariance());
  for (int i = 0; i < count; ++i) {
    UncertainDirection& normal = (*normals)[static_cast<std::size_t>(i)];
    normal.vector = poses[static_cast<std::size_t>(i)].normal;
    normal.covariance.setZero();
    for (int k = 0; k < 6; ++k) {
      // Steps of a tenth of a standard deviation: small enough to be linear.
      constexpr double kStep = 0.1;
      const double sigma = std::sqrt(std::max(0.0, eigen.eigenvalues()[k]));
      const Vector6d moved = ConicToVector(fit.conic) + kStep * sigma * eigen.eigenvectors().col(k);
      std::array<CirclePose, 2> moved_poses;
      const int moved_count = CirclePoses(VectorToConic(moved), &moved_poses);
      Vector3d change = Vector3d::Zero();
      double nearest = std::numeric_limits<double>::infinity();
      for (int j = 0; j < moved_count; ++j) {
        const Vector3d d = moved_poses[static_cast<std::size_t>(j)].normal - normal.vector;
        if (d.norm() < nearest) {
          nearest = d.norm();
          change = d / kStep;
        }
      }
      normal.covariance += inflation * change * change.transpose();
    }
  }
  return count;
}

void AssembleObservations(const AssemblyOptions& options, const std::vector<DetectedLine>& lines,
                          std::vector<CircleEvidence>* circles,
                          std::vector<DetectedPencil>* pencils, Observations* observations) {
  Assembler(options, lines, circles, pencils).Assemble(observations);
}

}  // namespace circline
