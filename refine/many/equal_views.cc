// Photos that show nearly the same as another one.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "circline/estimators/basics.h"
#include "circline/refine/many/adjustment.h"

namespace circline {
namespace {

// Where a contour or a line lies.
struct Spot {
  bool is_line = false;
  Eigen::Vector2d first, last;  // Ends of a line; corners of the box around a contour.
};
using View = std::vector<Spot>;

View ViewOf(const Observations& photo) {
  View view;
  for (const CircleObservation& circle : photo.circles) {
    if (circle.points.empty()) continue;
    Spot& spot = view.emplace_back(Spot{false, circle.points.front(), circle.points.front()});
    for (const Eigen::Vector2d& pixel : circle.points) {
      spot.first = spot.first.cwiseMin(pixel);
      spot.last = spot.last.cwiseMax(pixel);
    }
  }
  for (const PencilObservation& pencil : photo.pencils) {
    for (const LineObservation& line : pencil.lines) {
      if (line.points.size() >= 2) view.push_back({true, line.points.front(), line.points.back()});
    }
  }
  return view;
}

// Along a line nothing is compared: where it ends changes from photo to photo.
bool IsNear(const Spot& a, const Spot& b, double distance) {
  if (a.is_line != b.is_line) return false;
  if (!a.is_line)
    return (b.first - a.first).norm() < distance && (b.last - a.last).norm() < distance;
  const Eigen::Vector2d along = (a.last - a.first).normalized();
  const auto off = [&](const Eigen::Vector2d& pixel) {
    return std::abs(Cross(along, pixel - a.first));
  };
  return off(b.first) < distance && off(b.last) < distance;
}

// Whether most of the spots of `a` are near one of `b`.
bool IsIn(const View& a, const View& b, double distance) {
  constexpr double kMost = 0.8;
  const auto may_miss = static_cast<std::size_t>((1.0 - kMost) * static_cast<double>(a.size()));
  std::size_t missed = 0;
  for (const Spot& spot : a) {
    if (std::any_of(b.begin(), b.end(),
                    [&](const Spot& other) { return IsNear(spot, other, distance); })) {
      continue;
    }
    if (++missed > may_miss) return false;
  }
  return !a.empty();
}

}  // namespace

void Adjustment::SetAsideEqualViews() {
  if (!(options_.nearly_equal > 0.0)) return;
  std::vector<View> views;
  for (const Observations& photo : given_) views.push_back(ViewOf(photo));
  int count = 0;
  for (std::size_t i = 0; i < given_.size(); ++i) {
    const Camera& camera = given_[i].camera;
    const double pixels = options_.nearly_equal * std::hypot(camera.width, camera.height);
    AdjustedPhoto& photo = out_.photos[i];
    for (std::size_t j = 0; j < i && photo.status.ok(); ++j) {
      if (!out_.photos[j].status.ok() || inputs_[j].camera != inputs_[i].camera ||
          !IsIn(views[i], views[j], pixels) || !IsIn(views[j], views[i], pixels)) {
        continue;
      }
      photo.same_as = static_cast<int>(j);
      photo.status =
          Status::Refused("it shows nearly the same as another photo, whose errors it shares");
      ++count;
    }
  }
  if (count > 0) {
    out_.notes.push_back(std::to_string(count) + " of " + std::to_string(given_.size()) +
                         " photos show nearly the same as another one, and are set aside");
  }
}

}  // namespace circline
