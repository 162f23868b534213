#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/estimators/noise_model.h"
#include "circline/refine/many/adjust_layout.h"

namespace circline {
namespace {

// What two sightings of one circle may differ by: a photo's own pose of a small circle is no
// better.
constexpr double kApart = 0.5;    // Radii.
constexpr double kLarger = 1.3;   // Radius, times.
constexpr double kTurned = 0.94;  // Cosine of the angle between normals: 20 degrees.
// What two sightings of one line group differ by beside their own deviations, degrees: old houses
// have verticals so far apart.
constexpr double kDirectionsDeg = 1.0;

// A circle as a pose of its photo has it, in the frame of the given poses but for the photo's unit.
struct Sighting {
  std::size_t photo = 0;
  const PoseHypothesis* pose = nullptr;
  Eigen::Vector3d from = Eigen::Vector3d::Zero(), ray = from, normal = from;
  double radius = 0.0;
};

bool IsSamePlane(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::abs(a.dot(b)) > kTurned;
}

// A world to start from: that of one sighting, in the unit that another sighting of the circle
// gives it.
struct WorldSeed {
  const Sighting* sighting = nullptr;
  double unit = 0.0, gap = 0.0;  // Of the given frame; between the rays, radii.
};

// Whether two sightings may be of one circle, by where their rays meet, its size and its normal.
bool Meet(const Sighting& a, const Sighting& b, WorldSeed* seed) {
  if (!IsSamePlane(a.normal, b.normal)) return false;
  Eigen::Matrix<double, 3, 2> rays;
  rays << a.ray, -b.ray;
  const Eigen::Matrix2d normal = rays.transpose() * rays;
  // Sine squared: rays less than 1.1 degrees apart meet anywhere.
  constexpr double kParallax = 4e-4;
  if (!(normal.determinant() > kParallax * normal(0, 0) * normal(1, 1))) return false;
  const Eigen::Vector3d between = b.from - a.from;
  const Eigen::Vector2d along = normal.inverse() * (rays.transpose() * between);
  if (!(along.minCoeff() > 0.0)) return false;
  const double radius = along[0] * a.radius, larger = radius / (along[1] * b.radius);
  *seed = {&a, along[0], (rays * along - between).norm() / radius};
  return larger < kLarger && larger > 1.0 / kLarger && seed->gap < kApart;
}

// The pose in the world of a photo that has the given one.
CameraPose PoseInWorld(const GivenFrame& world, const CameraPose& given) {
  return {given.rotation * world.rotation,
          (given.rotation * world.translation + given.translation) / world.scale};
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
          sightings_.push_back({i, &h, -back * given[i]->translation, back * circle.center,
                                back * h.cam_from_world.rotation.col(2), circle.radius});
        }
      }
    }
  }

  std::optional<GivenFrame> Run(SharedLayout* shared) {
    const WorldSeed* best = nullptr;
    std::size_t most = 0;
    const std::vector<WorldSeed> seeds = Seeds();
    for (const WorldSeed& seed : seeds) {
      const GivenFrame world = WorldOf(seed);
      const Layout layout = LayoutOf(*seed.sighting->pose);
      const Places there = PlacesOf(layout);
      std::size_t count = 0;
      for (std::size_t k = 0; k < given_.size(); ++k) {
        if (k != seed.sighting->photo) count += Best(k, world, there).names.size();
      }
      if (count <= most) continue;
      most = count;
      best = &seed;
    }
    if (best == nullptr) return std::nullopt;
    const GivenFrame world = WorldOf(*best);
    Assemble(world, LayoutOf(*best->sighting->pose), shared);
    return world;
  }

 private:
  // A photo's circles in the world's plane, and which of them are there already.
  struct Match {
    Layout own;
    std::map<std::string, std::string> names;  // Own id to the world's.
    const PoseHypothesis* pose = nullptr;
  };

  // A line group in the world, as the first photo that shows it has it.
  struct Known {
    std::string name;
    Eigen::Vector3d direction;
    double sigma_deg = 0.0;
  };

  std::vector<WorldSeed> Seeds() const;
  GivenFrame WorldOf(const WorldSeed& seed) const;
  Match Best(std::size_t photo, const GivenFrame& world, const Places& there) const;
  static void NamePencils(std::size_t photo, const PoseHypothesis& h, std::vector<Known>* known,
                          SharedLayout* shared);
  void Assemble(const GivenFrame& world, const Layout& start, SharedLayout* shared) const;

  const std::vector<PoseEstimate>& estimates_;
  const std::vector<std::optional<CameraPose>>& given_;
  std::vector<Sighting> sightings_;  // By photo.
};

// The closest meetings, of photos farther and farther apart in the list (those of a video see the
// same) until there are enough.
std::vector<WorldSeed> Placer::Seeds() const {
  constexpr std::size_t kMostSeeds = 300, kMostPairs = 5000000;  // The latter of sightings.
  std::vector<std::size_t> begins;  // Of each photo with sightings, in sightings_.
  for (std::size_t k = 0; k < sightings_.size(); ++k) {
    if (k == 0 || sightings_[k].photo != sightings_[k - 1].photo) begins.push_back(k);
  }
  const std::size_t count = begins.size();
  begins.push_back(sightings_.size());
  std::vector<WorldSeed> seeds;
  WorldSeed seed;
  std::size_t pairs = 0;
  for (std::size_t apart = 1; apart < count && seeds.size() < kMostSeeds && pairs <= kMostPairs;
       ++apart) {
    for (std::size_t p = 0; p + apart < count; ++p) {
      const std::size_t q = p + apart;
      for (std::size_t a = begins[p]; a < begins[p + 1]; ++a) {
        for (std::size_t b = begins[q]; b < begins[q + 1]; ++b) {
          if (Meet(sightings_[a], sightings_[b], &seed)) seeds.push_back(seed);
        }
      }
      pairs += (begins[p + 1] - begins[p]) * (begins[q + 1] - begins[q]);
    }
  }
  std::stable_sort(seeds.begin(), seeds.end(),
                   [](const WorldSeed& a, const WorldSeed& b) { return a.gap < b.gap; });
  if (seeds.size() > kMostSeeds) seeds.resize(kMostSeeds);
  return seeds;
}

GivenFrame Placer::WorldOf(const WorldSeed& seed) const {
  const CameraPose& given = *given_[seed.sighting->photo];
  const CameraPose& own = seed.sighting->pose->cam_from_world;
  return {seed.unit, given.rotation.transpose() * own.rotation,
          given.rotation.transpose() * (seed.unit * own.translation - given.translation)};
}

// The photo's pose that finds most of the layout.
Placer::Match Placer::Best(std::size_t photo, const GivenFrame& world, const Places& there) const {
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
      match.own[circle.id] = {(eye + along * ray).head<2>(), along * circle.radius};
    }
    const Places own = PlacesOf(match.own);
    for (const auto& [mine, shared] : Matches(own, there, Similarity()))
      match.names[*own[mine].id] = *there[shared].id;
    if (best.pose == nullptr || match.names.size() > best.names.size()) best = std::move(match);
  }
  return best;
}

// Names a photo's pencils by their directions; adds what is new.
void Placer::NamePencils(std::size_t photo, const PoseHypothesis& h, std::vector<Known>* known,
                         SharedLayout* shared) {
  const Eigen::Matrix3d back = shared->poses[photo].rotation.transpose();
  std::vector<std::uint8_t> is_matched(known->size(), 0);
  for (const PencilEstimate& pencil : h.pencils) {
    const Eigen::Vector3d own = back * pencil.direction;
    std::size_t nearest = known->size();
    double least_deg = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < is_matched.size(); ++k) {
      const Known& other = (*known)[k];
      const double sine = own.cross(other.direction).norm(),
                   angle_deg = std::asin(std::min(1.0, sine)) / kDegree,
                   gate = kInlierSigmas *
                          std::hypot(pencil.sigma_deg, other.sigma_deg, kDirectionsDeg);
      if (is_matched[k] != 0 || !IsSamePlane(own, other.direction) ||
          !(angle_deg < std::min(gate, least_deg)))
        continue;
      least_deg = angle_deg;
      nearest = k;
    }
    if (nearest == known->size()) {
      const bool is_free = std::none_of(known->begin(), known->end(),
                                        [&](const Known& k) { return k.name == pencil.id; });
      known->push_back(
          {is_free ? pencil.id : std::to_string(photo) + ":" + pencil.id, own, pencil.sigma_deg});
    } else {
      is_matched[nearest] = 1;
    }
    shared->pencil_names[photo][pencil.id] = (*known)[nearest].name;
  }
}

void Placer::Assemble(const GivenFrame& world, const Layout& start, SharedLayout* shared) const {
  *shared = SharedLayout(given_.size());
  shared->circles = start;
  std::vector<Known> pencils;
  // What shared nothing is looked at again: the layout may have grown towards it.
  for (bool has_grown = true; has_grown;) {
    has_grown = false;
    for (std::size_t k = 0; k < given_.size(); ++k) {
      if (shared->placed[k]) continue;
      const Match match = Best(k, world, PlacesOf(shared->circles));
      if (match.names.empty()) continue;
      has_grown = true;
      shared->Add(k, PoseInWorld(world, *given_[k]), match.own, match.names);
      NamePencils(k, *match.pose, &pencils, shared);
    }
  }
}

}  // namespace

std::optional<GivenFrame> PlaceByGivenPoses(const std::vector<PoseEstimate>& estimates,
                                            const std::vector<std::optional<CameraPose>>& given,
                                            SharedLayout* shared) {
  return Placer(estimates, given).Run(shared);
}

}  // namespace circline
