#include "circline/estimators/observations.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace circline {
namespace {

bool Finite(const std::vector<Eigen::Vector2d>& pixels) {
  return std::all_of(pixels.begin(), pixels.end(),
                     [](const Eigen::Vector2d& p) { return p.allFinite(); });
}

bool Finite(const Segment& s) { return s[0].allFinite() && s[1].allFinite(); }

bool NonNegative(double value) { return value >= 0.0 && std::isfinite(value); }

Status ValidateCircle(const CircleObservation& circle) {
  const auto wrong = [&](const char* what) {
    return Status::Invalid("circle '" + circle.id + "': " + what);
  };
  if (!Finite(circle.points)) return wrong("a contour point is not finite");
  if (!circle.inliers.empty() && circle.inliers.size() != circle.points.size()) {
    return wrong("the inlier mask has another length than the contour");
  }
  if (!circle.normals.empty() && circle.normals.size() != circle.points.size()) {
    return wrong("normals must be one for each point, or none");
  }
  if (!Finite(circle.normals)) return wrong("a normal is not finite");
  if (!NonNegative(circle.sigma_px)) return wrong("sigma_px must be 0 or more");
  if (!NonNegative(circle.radius)) return wrong("radius must be 0 or more");
  if (!NonNegative(circle.radius_sigma)) return wrong("radius_sigma must be 0 or more");
  if (circle.center && !circle.center->allFinite()) return wrong("center is not finite");
  for (const Segment& s : circle.diameters) {
    if (!Finite(s)) return wrong("a diameter is not finite");
  }
  return Status::Ok();
}

Status ValidateRadiusGroups(const Observations& observations) {
  std::map<std::string, double> known;
  for (const CircleObservation& circle : observations.circles) {
    if (circle.radius_group.empty() || !(circle.radius > 0.0)) continue;
    const double radius = known.emplace(circle.radius_group, circle.radius).first->second;
    if (radius != circle.radius) {
      return Status::Invalid("radius group '" + circle.radius_group +
                             "': its circles have different radii");
    }
  }
  return Status::Ok();
}

Status ValidatePencil(const PencilObservation& pencil) {
  const auto wrong = [&](const char* what) {
    return Status::Invalid("pencil '" + pencil.id + "': " + what);
  };
  if (!NonNegative(pencil.sigma_px)) return wrong("sigma_px must be 0 or more");
  for (const LineObservation& line : pencil.lines) {
    if (!Finite(line.points)) return wrong("a segment is not finite");
    if (!NonNegative(line.sigma_px)) {
      return wrong("sigma_px of a line must be 0 or more");
    }
    if (!line.inliers.empty() && line.inliers.size() != line.points.size()) {
      return wrong("an inlier mask has another length than its line");
    }
  }
  return Status::Ok();
}

Status ValidateFrame(const Observations& observations) {
  const FrameObservation& frame = observations.frame;
  if (frame.origin && !frame.origin->allFinite())
    return Status::Invalid("frame: origin is not finite");
  for (const auto* axis : {&frame.x_axis, &frame.y_axis}) {
    if (*axis && !Finite(**axis)) return Status::Invalid("frame: an axis is not finite");
    if (*axis && (**axis)[0] == (**axis)[1]) return Status::Invalid("frame: an axis has no length");
  }
  if (!frame.origin_is_center.empty() && FindCircle(observations, frame.origin_is_center) < 0) {
    return Status::Invalid("frame: origin_is_center names no circle: '" + frame.origin_is_center +
                           "'");
  }
  return Status::Ok();
}

bool NamesPlane(const Observations& observations, const std::string& plane) {
  const auto is_on = [&plane](const auto& feature) { return feature.plane == plane; };
  return observations.frame.plane == plane ||
         std::any_of(observations.circles.begin(), observations.circles.end(), is_on) ||
         std::any_of(observations.pencils.begin(), observations.pencils.end(), is_on);
}

// The ids so far. Few are compared one by one, which allocates nothing.
class Ids {
 public:
  // False where it has been there.
  template <typename Features>
  bool Insert(const Features& features, std::size_t i) {
    constexpr std::size_t kFew = 64;
    if (features.size() > kFew) return ids_.insert(features[i].id).second;
    return std::none_of(features.begin(), features.begin() + static_cast<std::ptrdiff_t>(i),
                        [&](const auto& other) { return other.id == features[i].id; });
  }

 private:
  std::set<std::string> ids_;
};

Status ValidateKnown(const Observations& observations) {
  std::set<std::string> pencils;
  if (!observations.known_angles.empty()) {
    for (const PencilObservation& pencil : observations.pencils) pencils.insert(pencil.id);
  }
  for (const KnownAngle& angle : observations.known_angles) {
    for (const std::string& id : angle.pencils) {
      if (pencils.count(id) == 0) {
        return Status::Invalid("known angle: there is no pencil '" + id + "'");
      }
    }
    if (angle.pencils[0] == angle.pencils[1]) {
      return Status::Invalid("known angle: pencil '" + angle.pencils[0] + "' is named twice");
    }
    if (!std::isfinite(angle.value) || !NonNegative(angle.sigma)) {
      return Status::Invalid("known angle between '" + angle.pencils[0] + "' and '" +
                             angle.pencils[1] + "': value must be finite and sigma 0 or more");
    }
  }
  for (const KnownLength& length : observations.known_lengths) {
    if (length.points[0] == length.points[1]) {
      return Status::Invalid("known length: its two points are the same");
    }
    if (!Finite(length.points) || !(length.value > 0.0) || !std::isfinite(length.value)) {
      return Status::Invalid("known length: points must be finite and value positive");
    }
    if (!NonNegative(length.sigma)) return Status::Invalid("known length: sigma must be 0 or more");
    if (!length.plane.empty() && !NamesPlane(observations, length.plane)) {
      return Status::Invalid("known length: there is no plane '" + length.plane + "'");
    }
  }
  return Status::Ok();
}

}  // namespace

const char* PencilDirectionName(PencilDirection direction) {
  switch (direction) {
    case PencilDirection::kX:
      return "x";
    case PencilDirection::kY:
      return "y";
    case PencilDirection::kZ:
      return "z";
    case PencilDirection::kFree:
      return "free";
  }
  return "free";
}

Status Observations::Validate() const {
  Status status = camera.Validate();
  if (status.ok() && !NonNegative(stated_focal_px))
    status = Status::Invalid("stated_focal_px must be 0 or more");
  Ids circle_ids, pencil_ids;
  for (std::size_t i = 0; i < circles.size() && status.ok(); ++i) {
    status = ValidateCircle(circles[i]);
    if (status.ok() && !circle_ids.Insert(circles, i))
      status = Status::Invalid("two circles have the id '" + circles[i].id + "'");
  }
  for (std::size_t i = 0; i < pencils.size() && status.ok(); ++i) {
    status = ValidatePencil(pencils[i]);
    if (status.ok() && !pencil_ids.Insert(pencils, i))
      status = Status::Invalid("two pencils have the id '" + pencils[i].id + "'");
  }
  if (status.ok()) status = ValidateRadiusGroups(*this);
  if (status.ok()) status = ValidateFrame(*this);
  if (status.ok()) status = ValidateKnown(*this);
  return status;
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
  for (std::size_t i = 0; i < observations.circles.size(); ++i) {
    if (observations.circles[i].id == id) return static_cast<int>(i);
  }
  return -1;
}

int FindPencil(const Observations& observations, const std::string& id) {
  for (std::size_t i = 0; i < observations.pencils.size(); ++i) {
    if (observations.pencils[i].id == id) return static_cast<int>(i);
  }
  return -1;
}

namespace {

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

// A radius known of one circle is that of its group.
void ShareRadii(std::vector<CircleObservation>* circles) {
  std::map<std::string, double> known;
  for (const CircleObservation& circle : *circles) {
    if (!circle.radius_group.empty() && circle.radius > 0.0)
      known[circle.radius_group] = circle.radius;
  }
  for (CircleObservation& circle : *circles) {
    const auto group = known.find(circle.radius_group);
    if (group != known.end()) circle.radius = group->second;
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

int CalibrateInliers(const Camera& camera, const std::vector<Eigen::Vector2d>& pixels,
                     const std::vector<std::uint8_t>& inliers,
                     std::vector<CalibratedPoint>* points) {
  if (inliers.empty()) return PixelsToCalibrated(camera, pixels, points);
  points->clear();
  points->reserve(pixels.size());
  int dropped = 0;
  CalibratedPoint point;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (inliers[i] == 0) continue;
    if (PixelToCalibrated(camera, pixels[i], &point)) {
      points->push_back(point);
    } else {
      ++dropped;
    }
  }
  return dropped;
}

void ResetFits(Observations* observations) {
  for (CircleObservation& circle : observations->circles) circle.fit.reset();
  for (PencilObservation& pencil : observations->pencils) {
    pencil.fit.reset();
    for (LineObservation& line : pencil.lines) line.fit.reset();
  }
}

void FitDirect(double default_sigma_px, Observations* observations,
               std::vector<std::string>* problems, const NoiseModel& noise, FitMemory* memory) {
  const auto report = [problems](const char* kind, const std::string& id, int line,
                                 const Status& status) {
    if (problems == nullptr || status.ok()) return;
    const std::string which = line >= 0 ? ", line " + std::to_string(line) : std::string();
    problems->push_back(kind + (" '" + id + "'") + which + ": " + status.message);
  };
  const auto sigma = [default_sigma_px](double own) { return own > 0.0 ? own : default_sigma_px; };
  FitMemory own_memory;
  if (memory == nullptr) memory = &own_memory;
  std::vector<CalibratedPoint>& points = memory->points;
  std::vector<LineFit>& fits = memory->fits;
  for (CircleObservation& circle : observations->circles) {
    if (circle.fit) continue;
    observations->num_dropped_points +=
        CalibrateInliers(observations->camera, circle.points, circle.inliers, &points);
    ConicFit fit;
    const double sigma_px = sigma(circle.sigma_px);
    const Status status = FitConic(points, sigma_px, &fit, nullptr, &memory->numbers);
    if (status.ok()) {
      fit.ScaleCovariance(1.0 / noise.ContourWeight(sigma_px, circle.points, circle.inliers));
      circle.fit = fit;
    }
    report("circle", circle.id, -1, status);
  }
  for (PencilObservation& pencil : observations->pencils) {
    fits.clear();
    for (std::size_t i = 0; i < pencil.lines.size(); ++i) {
      LineObservation& line = pencil.lines[i];
      if (!line.fit) {
        observations->num_dropped_points +=
            CalibrateInliers(observations->camera, line.points, line.inliers, &points);
        LineFit fit;
        const double sigma_px = sigma(LineSigma(pencil, line));
        const Status status = FitLine(points, sigma_px, &fit);
        if (status.ok()) {
          fit.covariance /= noise.LineWeight(sigma_px, line.points, line.inliers);
          line.fit = fit;
        }
        report("pencil", pencil.id, static_cast<int>(i), status);
      }
      if (line.fit && line.is_parallel)
        fits.push_back(WithDirectionError(*line.fit, noise.line_direction_rad));
    }
    if (pencil.fit) continue;
    VanishingPointFit fit;
    const Status status = FitVanishingPoint(fits, &fit);
    if (status.ok()) pencil.fit = fit;
    report("pencil", pencil.id, -1, status);
  }
}

}  // namespace circline
