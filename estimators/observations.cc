#include "circline/estimators/observations.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace circline {
namespace {

// Index of the one with this id, or -1.
template <typename Feature>
int FindById(const std::vector<Feature>& features, const std::string& id) {
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (features[i].id == id) return static_cast<int>(i);
  }
  return -1;
}

std::string FirstNamedPlane(const Observations& observations) {
  if (!observations.frame.plane.empty()) return observations.frame.plane;
  for (const CircleObservation& circle : observations.circles) {
    if (!circle.plane.empty()) return circle.plane;
  }
  for (const PencilObservation& pencil : observations.pencils) {
    if (!pencil.plane.empty()) return pencil.plane;
  }
  return "";
}

// A radius known of one circle is that of its group, and as well known as by the best of those
// that say how well.
void ShareRadii(std::vector<CircleObservation>* circles) {
  struct KnownRadius {
    double radius = 0.0, sigma = 0.0;
  };
  std::map<std::string, KnownRadius> groups;
  for (const CircleObservation& circle : *circles) {
    if (circle.radius_group.empty() || !(circle.radius > 0.0)) continue;
    KnownRadius& known = groups[circle.radius_group];
    known.radius = circle.radius;
    const double sigma = circle.radius_sigma;
    if (sigma > 0.0 && !(known.sigma > 0.0 && known.sigma < sigma)) known.sigma = sigma;
  }
  for (CircleObservation& circle : *circles) {
    const auto group = groups.find(circle.radius_group);
    if (group == groups.end()) continue;
    circle.radius = group->second.radius;
    circle.radius_sigma = group->second.sigma;
  }
}

// Puts the first pair of pencils that span a plane onto `plane`.
void SpanPlane(const std::string& plane, std::vector<PencilObservation>* pencils) {
  for (std::size_t i = 0; i < pencils->size(); ++i) {
    for (std::size_t j = i + 1; j < pencils->size(); ++j) {
      const PencilObservation &a = (*pencils)[i], &b = (*pencils)[j];
      constexpr double kGate = 3.0;
      if (a.fit && b.fit && !(DirectionSeparation(*a.fit, *b.fit) > kGate)) continue;
      (*pencils)[i].plane = (*pencils)[j].plane = plane;
      return;
    }
  }
}

}  // namespace

const char* PencilDirectionName(PencilDirection direction) {
  constexpr const char* kNames[] = {"x", "y", "z", "free"};
  return kNames[static_cast<std::size_t>(direction)];
}

double StatedLogFocal(const Observations& observations) {
  const double stated = observations.stated_focal_px;
  return stated > 0.0 ? std::log(stated / observations.camera.fx) : 0.0;
}

double LineSigma(const PencilObservation& pencil, const LineObservation& line) {
  return line.sigma_px > 0.0 ? line.sigma_px : pencil.sigma_px;
}

bool RunsAlongAxis(const PencilObservation& pencil) {
  return pencil.direction != PencilDirection::kFree;
}

int FindCircle(const Observations& observations, const std::string& id) {
  return FindById(observations.circles, id);
}

int FindPencil(const Observations& observations, const std::string& id) {
  return FindById(observations.pencils, id);
}

bool IsInWorldPlane(const KnownLength& length, const Observations& resolved) {
  return length.plane.empty() || length.plane == resolved.frame.plane;
}

Observations ResolveWorld(const Observations& observations) {
  Observations out = observations;
  FrameObservation& frame = out.frame;
  const bool has_role = std::any_of(out.pencils.begin(), out.pencils.end(), RunsAlongAxis);
  ShareRadii(&out.circles);
  frame.plane = FirstNamedPlane(out);
  if (frame.plane.empty()) {
    frame.plane = "world";
    const int named = FindCircle(out, frame.origin_is_center);
    if (!out.circles.empty()) {
      const CircleObservation reference = out.circles[static_cast<std::size_t>(std::max(0, named))];
      for (CircleObservation& circle : out.circles) {
        const bool concentric =
            !circle.concentric.empty() && circle.concentric == reference.concentric;
        if (circle.id == reference.id || concentric) circle.plane = frame.plane;
      }
    } else if (!has_role) {
      SpanPlane(frame.plane, &out.pencils);
    }
  }
  // A pencil on one of whose lines an axis is drawn runs along that axis.
  const auto follow = [&out](const std::optional<Segment>& axis, PencilDirection role) {
    int pencil, line;
    if (!axis || !FindAxisLine(out, *axis, &pencil, &line)) return;
    PencilDirection& direction = out.pencils[static_cast<std::size_t>(pencil)].direction;
    if (direction == PencilDirection::kFree) direction = role;
  };
  follow(frame.x_axis, PencilDirection::kX);
  follow(frame.y_axis, PencilDirection::kY);
  const bool x_is_fixed =
      frame.x_axis || frame.y_axis ||
      std::any_of(out.pencils.begin(), out.pencils.end(), [](const PencilObservation& p) {
        return p.direction == PencilDirection::kX || p.direction == PencilDirection::kY;
      });
  if (!x_is_fixed) {
    const auto first = std::find_if(
        out.pencils.begin(), out.pencils.end(),
        [&](const PencilObservation& p) { return !RunsAlongAxis(p) && p.plane == frame.plane; });
    if (first != out.pencils.end()) first->direction = PencilDirection::kX;
  }
  return out;
}

bool FindAxisLine(const Observations& observations, const Segment& axis, int* pencil, int* line) {
  const auto contains = [](const LineObservation& l, const Eigen::Vector2d& p) {
    return std::find(l.points.begin(), l.points.end(), p) != l.points.end();
  };
  for (std::size_t i = 0; i < observations.pencils.size(); ++i) {
    const std::vector<LineObservation>& lines = observations.pencils[i].lines;
    for (std::size_t j = 0; j < lines.size(); ++j) {
      if (!contains(lines[j], axis[0]) || !contains(lines[j], axis[1])) continue;
      *pencil = static_cast<int>(i);
      *line = static_cast<int>(j);
      return true;
    }
  }
  return false;
}

}  // namespace circline
