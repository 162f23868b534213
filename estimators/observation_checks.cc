// What observations may not say.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "circline/estimators/basics.h"
#include "circline/estimators/observations.h"

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
  if (circle.second && circle.second->inliers.size() != circle.points.size())
    return wrong("the mask of its second ellipse has another length than the contour");
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
  if (!NonNegative(pencil.axis_probability) || pencil.axis_probability > 1.0)
    return wrong("axis_probability must be from 0 to 1");
  for (const DirectionReading& reading : pencil.readings) {
    if (!reading.direction.allFinite()) return wrong("the direction of a reading is not finite");
    constexpr double kRounding = 1e-9;
    if (!NonNegative(reading.probability) || reading.probability > 1.0 + kRounding)
      return wrong("the probability of a reading must be from 0 to 1");
  }
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
    // More than a turn is no angle in radians but one in degrees.
    if (!(std::abs(angle.value) <= 2.0 * kPi) || !NonNegative(angle.sigma)) {
      return Status::Invalid("known angle between '" + angle.pencils[0] + "' and '" +
                             angle.pencils[1] +
                             "': value must be within 2 pi and sigma 0 or more, both in radians");
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

Status Observations::Validate() const {
  Status status = camera.Validate();
  if (status.ok() && !NonNegative(stated_focal_px))
    status = Status::Invalid("stated_focal_px must be 0 or more");
  if (status.ok() && !std::isfinite(found_k1)) status = Status::Invalid("found_k1 must be finite");
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

}  // namespace circline
