#include "circline/refine/given_poses.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <string>
#include <utility>

namespace circline {
namespace {

// What two sights of one circle may differ by: a photo's own pose of a small circle is no better.
constexpr double kApart = 0.5;    // Radii.
constexpr double kLarger = 1.3;   // Radius, times.
constexpr double kTurned = 0.94;  // Cosine of the angle between normals: 20 degrees.

// A circle as a pose of its photo has it, in the frame of the given poses but for the photo's unit.
struct Sight {
  std::size_t photo = 0;
  const PoseHypothesis* pose = nullptr;
  Eigen::Vector3d from = Eigen::Vector3d::Zero(), ray = from, normal = from;
  double radius = 0.0;
};

bool IsSamePlane(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::abs(a.dot(b)) > kTurned;
}

// A world to start from: that of one sight, in the unit that another sight of the circle gives it.
struct Seed {
  const Sight* sight = nullptr;
  double unit = 0.0, gap = 0.0;  // Of the given frame; between the rays, radii.
};

// Whether two sights may be of one circle, by where their rays meet, its size and its normal.
bool Meet(const Sight& a, const Sight& b, Seed* seed) {
  if (!IsSamePlane(a.normal, b.normal)) return false;
  const double aa = a.ray.squaredNorm(), bb = b.ray.squaredNorm(), ab = a.ray.dot(b.ray);
  constexpr double kParallax =
      4e-4;  // Sine squared: rays less than 1.1 degrees apart meet anywhere.
  const double det = aa * bb - ab * ab;
  if (!(det > kParallax * aa * bb)) return false;
  const Eigen::Vector3d between = b.from - a.from;
  const double u = (bb * a.ray.dot(between) - ab * b.ray.dot(between)) / det,
               v = (ab * a.ray.dot(between) - aa * b.ray.dot(between)) / det;
  if (!(u > 0.0 && v > 0.0)) return false;
  const double larger = u * a.radius / (v * b.radius);
  *seed = {&a, u, (u * a.ray - v * b.ray - between).norm() / (u * a.radius)};
  return larger < kLarger && larger > 1.0 / kLarger && seed->gap < kApart;
}

class Placer {
 public:
  Placer(const std::vector<PoseEstimate>& estimates,
         const std::vector<std::optional<CameraPose>>& given)
      : estimates_(estimates), given_(given) {
    for (std::size_t i = 0; i < given.size(); ++i) {
      if (!given[i]) continue;
      const Eigen::Matrix3d back = given[i]->rotation.transpose();
      for (const PoseHypothesis& h : estimates[i].hypotheses) {
        for (const CircleEstimate& circle : h.circles) {
          if (!(circle.radius > 0.0)) continue;
          sights_.push_back({i, &h, -back * given[i]->translation, back * circle.center,
                             back * h.cam_from_world.rotation.col(2), circle.radius});
        }
      }
    }
  }

  std::optional<GivenPlacement> Run() {
    const Seed* best = nullptr;
    std::size_t most = 0;
    const std::vector<Seed> seeds = Seeds();
    for (const Seed& seed : seeds) {
      const GivenFrame world = WorldOf(seed);
      const Layout layout = LayoutOf(*seed.sight->pose);
      std::size_t count = 0;
      for (std::size_t k = 0; k < given_.size(); ++k) {
        if (k != seed.sight->photo) count += Best(k, world, layout).names.size();
      }
      if (count <= most) continue;
      most = count;
      best = &seed;
    }
    if (best == nullptr) return std::nullopt;
    return Assemble(*best);
  }

 private:
  // A photo's circles in the world's plane, and which of them are there already.
  struct Match {
    Layout own;
    std::map<std::string, std::string> names;  // Own id to the world's.
    const PoseHypothesis* pose = nullptr;
  };

  std::vector<Seed> Seeds() const;
  GivenFrame WorldOf(const Seed& seed) const;
  Match Best(std::size_t photo, const GivenFrame& world, const Layout& layout) const;
  GivenPlacement Assemble(const Seed& seed) const;

  const std::vector<PoseEstimate>& estimates_;
  const std::vector<std::optional<CameraPose>>& given_;
  std::vector<Sight> sights_;  // By photo.
};

// Of photos that are near one another in the list, the closest meetings.
std::vector<Seed> Placer::Seeds() const {
  constexpr std::size_t kNeighbours = 8, kMostSeeds = 300;
  std::vector<Seed> seeds;
  Seed seed;
  for (const Sight& a : sights_) {
    for (const Sight& b : sights_) {
      if (b.photo > a.photo && b.photo <= a.photo + kNeighbours && Meet(a, b, &seed))
        seeds.push_back(seed);
    }
  }
  std::stable_sort(seeds.begin(), seeds.end(),
                   [](const Seed& a, const Seed& b) { return a.gap < b.gap; });
  if (seeds.size() > kMostSeeds) seeds.resize(kMostSeeds);
  return seeds;
}

GivenFrame Placer::WorldOf(const Seed& seed) const {
  const CameraPose& given = *given_[seed.sight->photo];
  const CameraPose& own = seed.sight->pose->cam_from_world;
  GivenFrame world;
  world.scale = seed.unit;
  world.rotation = given.rotation.transpose() * own.rotation;
  world.translation =
      given.rotation.transpose() * (seed.unit * own.translation - given.translation);
  return world;
}

// The photo's pose that finds most of the layout.
Placer::Match Placer::Best(std::size_t photo, const GivenFrame& world, const Layout& layout) const {
  Match best;
  if (!given_[photo]) return best;
  const CameraPose pose = PoseInWorld(world, *given_[photo]);
  const Eigen::Matrix3d back = pose.rotation.transpose();
  const Eigen::Vector3d eye = -back * pose.translation;
  for (const PoseHypothesis& h : estimates_[photo].hypotheses) {
    if (!IsSamePlane(h.cam_from_world.rotation.col(2), pose.rotation.col(2))) continue;
    Match match;
    match.pose = &h;
    for (const CircleEstimate& circle : h.circles) {
      const Eigen::Vector3d ray = back * circle.center;
      const double along = -eye.z() / ray.z();  // To Z = 0.
      if (!(circle.radius > 0.0) || !(along > 0.0) || !std::isfinite(along)) continue;
      const LayoutCircle own = {(eye + along * ray).head<2>(), along * circle.radius};
      match.own[circle.id] = own;
      for (const auto& [id, there] : layout) {
        const double larger = own.radius / there.radius;
        if ((own.center - there.center).norm() < kApart * there.radius && larger < kLarger &&
            larger > 1.0 / kLarger) {
          match.names[circle.id] = id;
          break;
        }
      }
    }
    if (best.pose == nullptr || match.names.size() > best.names.size()) best = std::move(match);
  }
  return best;
}

// Whether a photo's pencils are those that others have under their ids; takes in what is new.
bool HasSamePencils(const CameraPose& in_world, const PoseHypothesis& h,
                    std::map<std::string, Eigen::Vector3d>* pencils) {
  return std::all_of(h.pencils.begin(), h.pencils.end(), [&](const PencilEstimate& d) {
    const Eigen::Vector3d own = in_world.rotation.transpose() * d.direction;
    return IsSamePlane(own, pencils->insert({d.id, own}).first->second);
  });
}

GivenPlacement Placer::Assemble(const Seed& seed) const {
  GivenPlacement out;
  out.world = WorldOf(seed);
  out.by_id = true;
  SharedLayout& shared = out.shared;
  shared.circles = LayoutOf(*seed.sight->pose);
  shared.poses.resize(given_.size());
  shared.placed.assign(given_.size(), false);
  shared.names.resize(given_.size());
  std::map<std::string, Eigen::Vector3d> pencils;
  for (std::size_t k = 0; k < given_.size(); ++k) {
    const Match match = Best(k, out.world, shared.circles);
    if (match.names.empty()) continue;
    shared.placed[k] = true;
    shared.poses[k] = PoseInWorld(out.world, *given_[k]);
    shared.names[k] = match.names;
    for (const auto& [id, circle] : match.own) {
      if (match.names.count(id) > 0) {
        out.by_id = out.by_id && match.names.at(id) == id;
        continue;
      }
      const bool is_free = shared.circles.count(id) == 0;
      const std::string name = is_free ? id : std::to_string(k) + ":" + id;
      out.by_id = out.by_id && is_free;
      shared.names[k][id] = name;
      shared.circles[name] = circle;
    }
    out.by_id = out.by_id && HasSamePencils(shared.poses[k], *match.pose, &pencils);
  }
  return out;
}

}  // namespace

CameraPose PoseInWorld(const GivenFrame& world, const CameraPose& given) {
  return {given.rotation * world.rotation,
          (given.rotation * world.translation + given.translation) / world.scale};
}

std::optional<GivenPlacement> PlaceByGivenPoses(
    const std::vector<PoseEstimate>& estimates,
    const std::vector<std::optional<CameraPose>>& given) {
  return Placer(estimates, given).Run();
}

}  // namespace circline
