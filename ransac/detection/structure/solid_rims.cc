#include "circline/ransac/detection/structure/solid_rims.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/estimators/conic.h"

namespace circline {
namespace {

// About one middle: centres apart by this share of the larger one's semi-minor axis. What lies on a
// disc by chance is within it once in ten times. Or within the other, and of more than this share
// of its size: the hub of a wheel and the tyre's outline, seen from the side.
constexpr double kSameMiddle = 0.3, kLargeWithin = 0.5;
// Touching: of the gaps between two rims, shares of the outer one's radius there, the least is such
// a share of the largest, and that is neither an error of the fits nor a thing of its own (a cup on
// a saucer). On rendered tables, streets and wheels; of photographs none had a part.
constexpr double kMostLeast = 0.25, kLeastGap = 0.03, kMostGap = 0.5;

struct Gaps {
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
};

Gaps GapsBetween(const Ellipse& outer, const Ellipse& inner) {
  constexpr int kSamples = 32;
  const Eigen::Rotation2Dd to_axes(-outer.angle);
  Gaps gaps;
  for (int k = 0; k < kSamples; ++k) {
    const Eigen::Vector2d p =
        to_axes * (EllipsePoint(inner, 2.0 * kPi * k / kSamples) - outer.center);
    const double gap = 1.0 - std::hypot(p.x() / outer.a, p.y() / outer.b);
    gaps.least = std::min(gaps.least, gap);
    gaps.most = std::max(gaps.most, gap);
  }
  return gaps;
}

double Size(const Ellipse& e) { return std::sqrt(e.a * e.b); }

bool AreOfOneSolid(const Ellipse& outer, const Ellipse& inner, const Gaps& gaps) {
  return (outer.center - inner.center).norm() < kSameMiddle * std::max(outer.b, inner.b) ||
         (gaps.least > 0.0 && Size(inner) > kLargeWithin * Size(outer));
}

bool AreTouching(const Gaps& gaps) {
  return std::abs(gaps.least) < kMostLeast * gaps.most && gaps.most > kLeastGap &&
         gaps.most < kMostGap;
}

// Where the far side of a plane lies in the photo from a point of it, calibrated.
Eigen::Vector2d FarSide(const Eigen::Vector2d& point, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d ray = point.homogeneous().normalized();
  const Eigen::Vector3d away = ray - ray.dot(normal) * normal;
  return away.head<2>() - away.z() * point;
}

}  // namespace

SolidRims::SolidRims(const std::vector<CircleEvidence>& circles) : rims_(circles.size()) {
  std::vector<Ellipse> ellipses(circles.size());
  for (std::size_t i = 0; i < circles.size(); ++i) {
    const CircleObservation& a = circles[i].observation;
    ConicToEllipse(a.fit->conic, &ellipses[i]);  // Fits of contours are ellipses.
    for (std::size_t j = 0; j < i; ++j) {
      const CircleObservation& b = circles[j].observation;
      if (!a.concentric.empty() && a.concentric == b.concentric) continue;
      const bool is_outer = Size(ellipses[i]) > Size(ellipses[j]);
      const std::size_t outer = is_outer ? i : j, inner = is_outer ? j : i;
      if ((ellipses[i].center - ellipses[j].center).norm() > ellipses[outer].a) continue;
      const Gaps gaps = GapsBetween(ellipses[outer], ellipses[inner]);
      if (!AreOfOneSolid(ellipses[outer], ellipses[inner], gaps)) continue;
      rims_[i].others.push_back(static_cast<int>(j));
      rims_[j].others.push_back(static_cast<int>(i));
      if (!AreTouching(gaps)) continue;
      const Eigen::Vector2d& center = ellipses[outer].center;
      const Eigen::Vector2d towards = ellipses[inner].center - center;
      rims_[outer].touches.push_back({static_cast<int>(inner), true, center, towards});
      rims_[inner].touches.push_back({static_cast<int>(outer), false, center, towards});
    }
  }
  AddConcentric(circles);
}

// Of what has rims that are not concentric those that are may be so by accident, at two heights.
void SolidRims::AddConcentric(const std::vector<CircleEvidence>& circles) {
  std::vector<std::pair<std::size_t, int>> found;
  for (std::size_t i = 0; i < circles.size(); ++i) {
    const std::string& group = circles[i].observation.concentric;
    for (std::size_t j = 0; j < circles.size(); ++j) {
      const bool is_solid = !rims_[i].others.empty() || !rims_[j].others.empty();
      if (i != j && is_solid && !group.empty() && circles[j].observation.concentric == group)
        found.emplace_back(i, static_cast<int>(j));
    }
  }
  for (const auto& [i, other] : found) rims_[i].others.push_back(other);
}

bool SolidRims::IsSilent(int i, const std::vector<int>& members,
                         const Eigen::Vector3d& normal) const {
  const Rim& rim = rims_[static_cast<std::size_t>(i)];
  return std::find_first_of(members.begin(), members.end(), rim.others.begin(), rim.others.end()) !=
             members.end() ||
         std::any_of(rim.touches.begin(), rim.touches.end(),
                     [&](const Touch& touch) { return touch.IsOutline(normal); });
}

bool SolidRims::Touch::IsOutline(const Eigen::Vector3d& normal) const {
  return is_outer == (towards.dot(FarSide(center, normal)) > 0.0);
}

int SolidRims::RimOf(int i, const Eigen::Vector3d& normal) const {
  for (const Touch& touch : rims_[static_cast<std::size_t>(i)].touches) {
    if (touch.IsOutline(normal)) return touch.other;
  }
  return i;
}

}  // namespace circline
