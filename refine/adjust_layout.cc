#include "circline/refine/adjust_layout.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace circline {

Layout LayoutOf(const PoseHypothesis& h) {
  Layout layout;
  for (const CircleEstimate& circle : h.circles) {
    const Eigen::Vector3d X =
        h.cam_from_world.rotation.transpose() * (circle.center - h.cam_from_world.translation);
    if (circle.radius > 0.0) layout[circle.id] = {X.head<2>(), circle.radius};
  }
  return layout;
}

namespace {

using Names = std::map<std::string, std::string>;

// x_to = scale * Rotation2D(angle) * x_from + shift.
struct Similarity {
  double scale = 1.0, angle = 0.0;
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();

  Eigen::Vector2d operator()(const Eigen::Vector2d& x) const {
    return scale * (Eigen::Rotation2Dd(angle) * x) + shift;
  }
};

struct Alignment {
  Similarity to_shared;
  Names names;          // Of the circles that both have: own id to the shared one.
  double misfit = 0.0;  // Median distance of these after it, in place and size; radii.
};

// Least squares of the centres (Umeyama 1991). False for fewer than two.
bool Fit(const Layout& from, const Layout& to, const Names& names, Similarity* out) {
  constexpr std::size_t kFewest = 2;
  if (names.size() < kFewest) return false;
  Eigen::Vector2d a = Eigen::Vector2d::Zero(), b = a;
  const double n = static_cast<double>(names.size());
  for (const auto& [own, shared] : names) {
    a += from.at(own).center / n;
    b += to.at(shared).center / n;
  }
  double dot = 0.0, cross = 0.0, square = 0.0;
  for (const auto& [own, shared] : names) {
    const Eigen::Vector2d u = from.at(own).center - a, v = to.at(shared).center - b;
    dot += u.dot(v);
    cross += u.x() * v.y() - u.y() * v.x();
    square += u.squaredNorm();
  }
  const double both = std::hypot(dot, cross);
  if (!(square > 0.0) || !(both > 0.0)) return false;
  *out = {both / square, std::atan2(cross, dot), Eigen::Vector2d::Zero()};
  out->shift = b - (*out)(a);
  return true;
}

// In place and in size, radii.
double Miss(const LayoutCircle& from, const LayoutCircle& to, const Similarity& similarity) {
  const double size = std::log(similarity.scale * from.radius / to.radius);
  return std::hypot((similarity(from.center) - to.center).norm() / to.radius, size);
}

bool FitAndJudge(const Layout& from, const Layout& to, Alignment* alignment) {
  if (!Fit(from, to, alignment->names, &alignment->to_shared)) return false;
  std::vector<double> misses;
  for (const auto& [own, shared] : alignment->names)
    misses.push_back(Miss(from.at(own), to.at(shared), alignment->to_shared));
  const auto middle = misses.begin() + static_cast<std::ptrdiff_t>(misses.size() / 2);
  std::nth_element(misses.begin(), middle, misses.end());
  alignment->misfit = *middle;
  return true;
}

bool AlignById(const Layout& from, const Layout& to, Alignment* alignment) {
  for (const auto& [id, circle] : from) {
    if (to.count(id) > 0) alignment->names[id] = id;
  }
  return FitAndJudge(from, to, alignment);
}

// Each circle and the one nearest to it.
std::vector<std::array<std::string, 2>> NeighbourPairs(const Layout& layout) {
  std::vector<std::array<std::string, 2>> pairs;
  for (const auto& [id, circle] : layout) {
    std::string nearest;
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [other, at] : layout) {
      const double distance = (at.center - circle.center).norm();
      if (other == id || !(distance < least)) continue;
      least = distance;
      nearest = other;
    }
    if (!nearest.empty()) pairs.push_back({id, nearest});
  }
  return pairs;
}

// The circles of `from` that lie on one of `to`, each on another.
Names Matches(const Layout& from, const Layout& to, const Similarity& similarity) {
  constexpr double kNear = 0.3;  // Radii.
  Names names;
  std::map<std::string, bool> taken;
  for (const auto& [own, circle] : from) {
    for (const auto& [shared, at] : to) {
      if (taken[shared] || !(Miss(circle, at, similarity) < kNear)) continue;
      names[own] = shared;
      taken[shared] = true;
      break;
    }
  }
  return names;
}

// The similarity under which most circles coincide, of those that a few pairs of neighbours ask
// for.
bool AlignByPattern(const Layout& from, const Layout& to, Alignment* alignment) {
  constexpr std::size_t kBases = 6;
  constexpr double kSize = 0.2;  // Two circles alike in size and distance, relative.
  const auto own_pairs = NeighbourPairs(from);
  auto shared_pairs = NeighbourPairs(to);
  const std::size_t count = shared_pairs.size();
  for (std::size_t k = 0; k < count; ++k)
    shared_pairs.push_back({shared_pairs[k][1], shared_pairs[k][0]});
  const std::size_t step = std::max<std::size_t>(1, own_pairs.size() / kBases);
  for (std::size_t base = 0; base < own_pairs.size(); base += step) {
    const auto& [a, b] = own_pairs[base];
    for (const auto& [c, d] : shared_pairs) {
      Similarity similarity;
      if (!Fit(from, to, {{a, c}, {b, d}}, &similarity) ||
          std::abs(std::log(similarity.scale * from.at(a).radius / to.at(c).radius)) > kSize) {
        continue;
      }
      Names names = Matches(from, to, similarity);
      if (names.size() > alignment->names.size()) alignment->names = std::move(names);
    }
  }
  constexpr double kMost = 0.6;  // Of the circles of the photo that has fewer.
  constexpr std::size_t kFewest = 4;
  const double fewer = static_cast<double>(std::min(from.size(), to.size()));
  if (alignment->names.size() < kFewest ||
      static_cast<double>(alignment->names.size()) < kMost * fewer ||
      !FitAndJudge(from, to, alignment)) {
    return false;
  }
  alignment->names = Matches(from, to, alignment->to_shared);  // From all pairs, not from two.
  return FitAndJudge(from, to, alignment);
}

// A pose of a photo's own world in the world that `to_shared` maps its plane to.
CameraPose Moved(const CameraPose& own, const Similarity& to_shared) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(to_shared.angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  CameraPose pose;
  pose.rotation = own.rotation * turn.transpose();
  pose.translation = to_shared.scale * own.translation -
                     pose.rotation * Eigen::Vector3d(to_shared.shift.x(), to_shared.shift.y(), 0.0);
  return pose;
}

// Circles that nobody else has seen join the layout, under a name of their own.
void Join(const Layout& own, std::size_t photo, bool by_id, const Alignment& alignment,
          SharedLayout* out) {
  out->names[photo] = alignment.names;
  for (const auto& [id, circle] : own) {
    if (alignment.names.count(id) > 0) continue;
    const std::string name = by_id ? id : std::to_string(photo) + ":" + id;
    out->names[photo][id] = name;
    out->circles[name] = {alignment.to_shared(circle.center),
                          alignment.to_shared.scale * circle.radius};
  }
}

}  // namespace

SharedLayout AlignLayouts(const std::vector<PoseEstimate>& estimates, bool by_id) {
  constexpr double kFar = 0.5;  // Radii: another circle, or another pose of the photo.
  SharedLayout out;
  out.poses.resize(estimates.size());
  out.names.resize(estimates.size());
  out.placed.assign(estimates.size(), false);
  std::vector<double> misfits;
  for (;;) {  // The photo that shares most with what is placed comes next.
    Alignment best;
    std::size_t next = estimates.size(), most = 0;
    const PoseHypothesis* hypothesis = nullptr;
    for (std::size_t i = 0; i < estimates.size(); ++i) {
      if (out.placed[i]) continue;
      for (const PoseHypothesis& h : estimates[i].hypotheses) {
        const Layout own = LayoutOf(h);
        Alignment aligned;
        std::size_t shared = own.size();
        if (!out.circles.empty()) {
          const bool found = by_id ? AlignById(own, out.circles, &aligned)
                                   : AlignByPattern(own, out.circles, &aligned);
          if (!found || aligned.misfit > kFar) continue;
          shared = aligned.names.size();
        }
        if (shared < most || (shared == most && (next != i || aligned.misfit >= best.misfit)))
          continue;
        most = shared;
        best = aligned;
        next = i;
        hypothesis = &h;
      }
    }
    if (hypothesis == nullptr) break;
    if (!out.circles.empty()) misfits.push_back(best.misfit);
    out.placed[next] = true;
    out.poses[next] = Moved(hypothesis->cam_from_world, best.to_shared);
    Join(LayoutOf(*hypothesis), next, by_id, best, &out);
  }
  if (!misfits.empty()) {
    const auto middle = misfits.begin() + static_cast<std::ptrdiff_t>(misfits.size() / 2);
    std::nth_element(misfits.begin(), middle, misfits.end());
    out.misfit = *middle;
  }
  return out;
}

}  // namespace circline
