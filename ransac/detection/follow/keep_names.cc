#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "circline/estimators/conic.h"
#include "circline/ransac/detection/follow/follow_observations.h"

namespace circline {
namespace {

constexpr double kMaxTurnSine = 0.17;  // 10 degrees.
// A sheet of dots seen from elsewhere has some where others were: fewer than this share of the
// features is no continuation.
constexpr double kMinKept = 0.5;

bool FittedEllipse(const CircleObservation& circle, Ellipse* ellipse) {
  return circle.fit && ConicToEllipse(circle.fit->conic, ellipse);
}

// For each detected circle the predicted one that it continues, or -1.
std::vector<int> AssignCircles(const Observations& predicted, const Observations& detected,
                               double search_px) {
  const double focal = 0.5 * (detected.camera.fx + detected.camera.fy);
  std::vector<FeaturePair> pairs;
  for (std::size_t i = 0; i < predicted.circles.size(); ++i) {
    Ellipse before;
    if (!FittedEllipse(predicted.circles[i], &before)) continue;
    for (std::size_t k = 0; k < detected.circles.size(); ++k) {
      Ellipse now;
      if (!FittedEllipse(detected.circles[k], &now)) continue;
      const double offset = (now.center - before.center).norm();
      const double growth = now.a / before.a;
      if (offset > std::max(search_px / focal, 0.5 * before.b)) continue;
      if (!(growth < kMaxGrowth && growth > 1.0 / kMaxGrowth)) continue;
      pairs.push_back({offset + std::abs(now.a - before.a) + std::abs(now.b - before.b), k, i});
    }
  }
  return CheapestPairs(std::move(pairs), detected.circles.size(), predicted.circles.size());
}

// The same of pencils, by the lines that they share: at least half of those of the smaller one.
std::vector<int> AssignPencils(const Observations& predicted, const Observations& detected,
                               double search_px) {
  std::vector<DetectedLine> lines;
  std::vector<std::size_t> owner;
  for (std::size_t k = 0; k < detected.pencils.size(); ++k) {
    for (const LineObservation& line : detected.pencils[k].lines) {
      lines.emplace_back().ends = {line.points.front(), line.points.back()};
      owner.push_back(k);
    }
  }
  const std::vector<std::vector<int>> matches = MatchLines(predicted.pencils, lines, search_px);
  std::vector<FeaturePair> pairs;
  for (std::size_t i = 0; i < predicted.pencils.size(); ++i) {
    for (std::size_t k = 0; k < detected.pencils.size(); ++k) {
      const auto &before = predicted.pencils[i].fit, &now = detected.pencils[k].fit;
      if (before && now && before->direction.cross(now->direction).norm() > kMaxTurnSine) continue;
      const auto fewer =
          std::min(predicted.pencils[i].lines.size(), detected.pencils[k].lines.size());
      const auto shared = static_cast<std::size_t>(std::count_if(
          matches[i].begin(), matches[i].end(),
          [&](int line) { return line >= 0 && owner[static_cast<std::size_t>(line)] == k; }));
      if (shared > 0 && 2 * shared >= fewer) pairs.push_back({-static_cast<double>(shared), k, i});
    }
  }
  return CheapestPairs(std::move(pairs), detected.pencils.size(), predicted.pencils.size());
}

// What the planes of the detection are called in the prediction: as the first feature says that is
// in both.
class PlaneNames {
 public:
  explicit PlaneNames(NextNames* next) : next_(*next) {}

  void Continue(const std::string& detected, const std::string& predicted) {
    if (!detected.empty() && !predicted.empty()) names_.emplace(detected, predicted);
  }
  std::string Name(const std::string& detected) {
    if (detected.empty()) return detected;
    const auto [place, is_new] = names_.try_emplace(detected);
    if (is_new) place->second = "p" + std::to_string(next_.plane++);
    return place->second;
  }

 private:
  NextNames& next_;
  std::map<std::string, std::string> names_;
};

template <typename Feature>
void NameFeatures(const std::vector<Feature>& predicted, const std::vector<int>& continued,
                  const char* letter, int* number, PlaneNames* planes,
                  std::vector<Feature>* features) {
  for (std::size_t k = 0; k < features->size(); ++k) {
    if (continued[k] < 0) continue;
    planes->Continue((*features)[k].plane, predicted[static_cast<std::size_t>(continued[k])].plane);
  }
  for (std::size_t k = 0; k < features->size(); ++k) {
    Feature& feature = (*features)[k];
    feature.plane = planes->Name(feature.plane);
    if (continued[k] >= 0) {
      Continue(predicted[static_cast<std::size_t>(continued[k])], &feature);
    } else {
      do {
        feature.id = letter + std::to_string((*number)++);
      } while (std::any_of(predicted.begin(), predicted.end(),
                           [&](const Feature& other) { return other.id == feature.id; }));
    }
  }
}

bool IsAxis(const PencilObservation& pencil) {
  return pencil.direction == PencilDirection::kX || pencil.direction == PencilDirection::kY;
}

// The axes of the world are those of the first pencils that had such a role: what is new has one
// only beside one of these, and not that of a pencil that goes on.
void SettleRoles(const Observations& predicted, NextNames* next, Observations* detected) {
  const auto goes_on = [&](const PencilObservation& p) { return FindPencil(predicted, p.id) >= 0; };
  const auto is_old_axis = [&](const PencilObservation& p) { return goes_on(p) && IsAxis(p); };
  const bool has_old_axis =
      std::any_of(detected->pencils.begin(), detected->pencils.end(), is_old_axis);
  for (PencilObservation& pencil : detected->pencils) {
    if (goes_on(pencil)) continue;
    const bool has_rival = std::any_of(
        detected->pencils.begin(), detected->pencils.end(), [&](const PencilObservation& other) {
          return goes_on(other) && other.direction == pencil.direction;
        });
    if (has_rival || (IsAxis(pencil) && next->has_axes && !has_old_axis))
      pencil.direction = PencilDirection::kFree;
  }
  next->has_axes =
      next->has_axes || std::any_of(detected->pencils.begin(), detected->pencils.end(), IsAxis);
}

bool HasCircles(const Observations& observations) {
  return std::any_of(
      observations.circles.begin(), observations.circles.end(),
      [&](const CircleObservation& c) { return c.plane == observations.frame.plane; });
}

// A world of directions alone gives way to the first plane with circles, which tells positions,
// too: what goes on keeps its name, and takes its place in the new world.
Observations WithoutWorld(const Observations& predicted) {
  Observations features = predicted;
  features.frame.plane.clear();
  for (PencilObservation& pencil : features.pencils) {
    pencil.plane.clear();
    pencil.direction = PencilDirection::kFree;
  }
  return features;
}

// Whether the detected world is a plane of the predicted world's pencils.
bool IsSamePlane(const Observations& predicted, const std::vector<int>& pencils,
                 const Observations& detected) {
  for (std::size_t k = 0; k < pencils.size(); ++k) {
    if (pencils[k] < 0 || detected.pencils[k].plane != detected.frame.plane) continue;
    const PencilObservation& before = predicted.pencils[static_cast<std::size_t>(pencils[k])];
    if (before.plane == predicted.frame.plane) return true;
  }
  return false;
}

template <typename Feature, typename Find>
void OldOnesFirst(const Find& find, std::vector<Feature>* features) {
  std::stable_sort(features->begin(), features->end(), [&](const Feature& a, const Feature& b) {
    const auto i = static_cast<unsigned>(find(a.id)), k = static_cast<unsigned>(find(b.id));
    return i < k;  // -1, not there before, is the largest.
  });
}

}  // namespace

int KeepNames(const Observations& held, double search_px, NextNames* next, Observations* detected) {
  std::vector<int> circles = AssignCircles(held, *detected, search_px);
  std::vector<int> pencils = AssignPencils(held, *detected, search_px);
  const auto goes_on = [](int i) { return i >= 0; };
  auto kept = std::count_if(circles.begin(), circles.end(), goes_on) +
              std::count_if(pencils.begin(), pencils.end(), goes_on);
  const std::size_t fewer =
      std::min(held.circles.size() + held.pencils.size(), circles.size() + pencils.size());
  if (static_cast<double>(kept) < kMinKept * static_cast<double>(fewer)) {
    std::fill(circles.begin(), circles.end(), -1);
    std::fill(pencils.begin(), pencils.end(), -1);
    kept = 0;
  }
  const bool has_circles = HasCircles(*detected);
  const bool is_new_world =
      kept == 0 || (has_circles && !next->has_circles && !IsSamePlane(held, pencils, *detected));
  if (is_new_world) next->has_axes = next->has_circles = false;
  next->has_circles = next->has_circles || has_circles;
  const Observations predicted = is_new_world ? WithoutWorld(held) : held;
  PlaneNames planes(next);
  NameFeatures(predicted.circles, circles, "c", &next->circle, &planes, &detected->circles);
  NameFeatures(predicted.pencils, pencils, "L", &next->pencil, &planes, &detected->pencils);
  SettleRoles(predicted, next, detected);
  OldOnesFirst([&](const std::string& id) { return FindCircle(predicted, id); },
               &detected->circles);
  OldOnesFirst([&](const std::string& id) { return FindPencil(predicted, id); },
               &detected->pencils);
  const std::string& plane = predicted.frame.plane;
  const bool has_plane = !plane.empty() && HasPlane(*detected, plane);
  detected->frame.plane = has_plane ? plane : planes.Name(detected->frame.plane);
  return static_cast<int>(kept);
}

}  // namespace circline
