#include "apps/reconstruct/measurements.h"

#include <Eigen/Dense>
#include <cmath>
#include <iomanip>
#include <sstream>
#include <utility>

#include "apps/compare/pixel_ellipse.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/metrology.h"

namespace circline::apps {
namespace {

using Rays = std::vector<Eigen::Vector3d>;

bool Length(const CameraPose& pose, const Rays& rays, double* value) {
  return LengthOnPlane(pose, rays[0], rays[1], value);
}
bool Height(const CameraPose& pose, const Rays& rays, double* value) {
  return HeightOverPlane(pose, rays[0], rays[1], value);
}
bool Distance(const CameraPose& pose, const Rays& /*rays*/, double* value) {
  *value = std::abs(pose.rotation.col(2).dot(pose.translation));
  return true;
}

// Of the plane's circle, whose contour's own noise counts as that of all its points together.
bool MeasureRadius(const PoseHypothesis& hypothesis, const CircleObservation& circle,
                   double sigma_px, const Camera& camera, Measurement* radius) {
  if (!circle.fit || circle.points.empty()) return false;
  const Eigen::Matrix3d& conic = circle.fit->conic;
  const PlaneFunction function = [&conic](const CameraPose& pose, const Rays&, double* value) {
    Ellipse ellipse;
    if (!ConicOnPlane(pose, conic, &ellipse)) return false;
    *value = std::sqrt(ellipse.a * ellipse.b);
    return true;
  };
  Ellipse seen;
  if (!MeasureOnPlane(function, hypothesis, camera, {}, 0.0, radius) ||
      !ConicToEllipse(conic, &seen)) {
    return false;
  }
  const double noise_px = CenterSigmaPx(sigma_px, circle.points.size());
  const double mean_px = std::sqrt(seen.a * seen.b * camera.fx * camera.fy);
  radius->sigma = std::hypot(radius->sigma, radius->value * noise_px / mean_px);
  return true;
}

// Between the directions of two pencils, each from its own lines alone.
bool MeasureAngle(const PencilObservation& a, const PencilObservation& b, MeasuredValue* measured) {
  if (!a.fit || !b.fit) return false;
  const Eigen::Vector3d u = a.fit->direction, v = b.fit->direction;
  const double sine = u.cross(v).norm();
  if (!(sine > 1e-6)) return false;
  measured->id = a.id + " " + b.id;
  measured->value = std::atan2(sine, std::abs(u.dot(v))) / kDegree;
  const double variance = v.dot(a.fit->covariance * v) + u.dot(b.fit->covariance * u);
  measured->sigma = std::sqrt(variance) / sine / kDegree;
  return std::isfinite(measured->sigma);
}

bool IsInPlane(const PencilObservation& pencil, const std::string& plane) {
  return pencil.plane == plane && pencil.direction != PencilDirection::kZ;
}

// Between the normal of the circle alone and the nearest axis of the box alone. The standard
// deviation is that of both together about the axis that turns one into the other.
bool Agreement(const CircleObservation& circle, const BoxFit& fit, const Observations& observations,
               const EstimationOptions& options, MeasuredValue* agreement) {
  Observations alone;
  alone.camera = observations.camera;
  alone.stated_focal_px = observations.stated_focal_px;
  alone.found_k1 = observations.found_k1;
  alone.circles = {circle};
  const PoseEstimate estimate = EstimatePose(alone, options);
  double nearest = -1.0;
  for (const PoseHypothesis& hypothesis : estimate.hypotheses) {
    const Eigen::Vector3d normal = hypothesis.cam_from_world.rotation.col(2);
    for (int k = 0; k < 3; ++k) {
      Eigen::Vector3d axis = fit.cam_from_box.rotation.col(k);
      if (axis.dot(normal) < 0.0) axis = -axis;
      const Eigen::Vector3d turn = normal.cross(axis);
      if (axis.dot(normal) <= nearest || !(turn.norm() > 0.0)) continue;
      nearest = axis.dot(normal);
      const Eigen::Vector3d about = turn.normalized();
      const double variance = about.dot(
          (hypothesis.Covariance().topLeftCorner<3, 3>() + fit.covariance.topLeftCorner<3, 3>()) *
          about);
      *agreement = {"agreement",
                    circle.id + " " + "xyz"[k],
                    std::atan2(turn.norm(), nearest) / kDegree,
                    std::sqrt(variance) / kDegree,
                    "deg",
                    0.0};
    }
  }
  return nearest >= 0.0;
}

}  // namespace

std::vector<MeasuredValue> Measure(const Observations& observations,
                                   const PoseHypothesis& hypothesis, const Model& model,
                                   double point_sigma_px) {
  const Observations resolved = ResolveWorld(observations);
  const Camera& camera = observations.camera;
  const std::string unit = hypothesis.metric ? "world" : "distance";
  std::vector<MeasuredValue> all;
  const auto add = [&](const char* what, const std::string& id, const PlaneFunction& function,
                       const std::vector<Eigen::Vector2d>& pixels, double sigma_px) {
    Measurement m;
    if (MeasureOnPlane(function, hypothesis, camera, pixels, sigma_px, &m))
      all.push_back({what, id, m.value, m.sigma, unit, 0.0});
  };
  add("distance", "camera", Distance, {}, 0.0);
  for (std::size_t i = 0; i < resolved.known_lengths.size(); ++i) {
    const KnownLength& known = resolved.known_lengths[i];
    if (!IsInWorldPlane(known, resolved)) continue;
    add("length", "known_" + std::to_string(i), Length, {known.points[0], known.points[1]},
        point_sigma_px);
  }
  for (const PencilObservation& pencil : resolved.pencils) {
    if (!IsInPlane(pencil, resolved.frame.plane)) continue;
    for (std::size_t i = 0; i < pencil.lines.size(); ++i) {
      const Segment ends = EndPoints(pencil.lines[i]);
      const double sigma_px = LineSigma(pencil, pencil.lines[i]);
      add("length", pencil.id + "_" + std::to_string(i), Length, {ends[0], ends[1]},
          sigma_px > 0.0 ? sigma_px : point_sigma_px);
    }
  }
  for (const UprightEdge& edge : model.edges) {
    add("height", edge.name, Height, {edge.foot_px, edge.top_px}, point_sigma_px);
  }
  for (const SolidHeight& solid : model.heights) {
    all.push_back({"height", solid.id, solid.height, solid.sigma, unit,
                   hypothesis.metric ? solid.truth : 0.0});
  }
  for (const CircleObservation& circle : resolved.circles) {
    if (circle.plane != resolved.frame.plane) continue;
    Measurement radius;
    const double sigma_px = circle.sigma_px > 0.0 ? circle.sigma_px : point_sigma_px;
    if (MeasureRadius(hypothesis, circle, sigma_px, camera, &radius))
      all.push_back({"radius", circle.id, radius.value, radius.sigma, unit, 0.0});
  }
  for (std::size_t i = 0; i < resolved.pencils.size(); ++i) {
    for (std::size_t j = i + 1; j < resolved.pencils.size(); ++j) {
      MeasuredValue angle{"angle", "", 0.0, 0.0, "deg", 0.0};
      if (MeasureAngle(resolved.pencils[i], resolved.pencils[j], &angle)) all.push_back(angle);
    }
  }
  return all;
}

std::vector<MeasuredValue> MeasureBox(const BoxFit& fit, const BoxObservation& box,
                                      const Observations& observations,
                                      const EstimationOptions& options) {
  const std::string unit = fit.metric ? "world" : "distance";
  std::vector<MeasuredValue> all;
  const Eigen::Vector3d& t = fit.cam_from_box.translation;
  if (fit.metric) {
    const Eigen::Vector3d ray = t.normalized();
    all.push_back({"distance", "camera", t.norm(),
                   std::sqrt(ray.dot(fit.covariance.block<3, 3>(3, 3) * ray)), unit, 0.0});
  }
  for (int k = 0; k < 3; ++k) {
    all.push_back({"length", box.id + " " + "xyz"[k], fit.length[k],
                   std::sqrt(fit.covariance(6 + k, 6 + k)), unit,
                   fit.metric ? box.truth[static_cast<std::size_t>(k)] : 0.0});
  }
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3;
    const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
    const double ratio = fit.length[a] / fit.length[b];
    Eigen::Matrix<double, 9, 1> by = Eigen::Matrix<double, 9, 1>::Zero();
    by[6 + a] = 1.0 / fit.length[b];
    by[6 + b] = -ratio / fit.length[b];
    const bool known = box.truth[i] > 0.0 && box.truth[j] > 0.0;
    all.push_back({"ratio", box.id + " " + "xyz"[a] + "/" + "xyz"[b], ratio,
                   std::sqrt(by.dot(fit.covariance * by)), "",
                   known ? box.truth[i] / box.truth[j] : 0.0});
  }
  for (const CircleObservation& circle : observations.circles) {
    MeasuredValue agreement;
    if (Agreement(circle, fit, observations, options, &agreement)) all.push_back(agreement);
  }
  return all;
}

std::string MeasurementsCsv(const std::vector<MeasuredValue>& measurements) {
  std::ostringstream csv;
  csv << std::setprecision(9) << "what,id,value,sigma,unit,truth,relative_error\n";
  for (const MeasuredValue& m : measurements) {
    std::string id = m.id;
    // Spreadsheets would take it for a formula.
    if (id.find_first_of("=+-@\t\r") == 0) id.insert(0, 1, '\'');
    for (std::size_t at = 0; (at = id.find('"', at)) != std::string::npos; at += 2) {
      id.insert(at, 1, '"');
    }
    csv << m.what << ",\"" << id << "\"," << m.value << "," << m.sigma << "," << m.unit << ",";
    if (m.truth != 0.0) {
      csv << m.truth << "," << m.value / m.truth - 1.0;
    } else {
      csv << ",";
    }
    csv << "\n";
  }
  return csv.str();
}

}  // namespace circline::apps
