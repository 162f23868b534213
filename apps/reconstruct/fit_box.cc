#include "apps/reconstruct/fit_box.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/reconstruct/box_geometry.h"
#include "apps/reconstruct/box_problem.h"
#include "apps/reconstruct/box_start.h"
#include "circline/estimators/observations.h"

namespace circline::apps {
namespace {

// What all points of an edge of a real box share, beside the noise model's: cartons are worn and
// bulge. A share of the longest edge on the photo, to begin with; the box itself tells, and that
// counts as much as kWornFreedom of its residuals. Between a crisp box and one whose faces bulge by
// one part in sixty (box-camprodon); the tea box had no part in it.
constexpr double kWornShare = 0.004;
constexpr double kWornFreedom = 4.0;
constexpr double kUnknowns = 7.0;  // Rotation, direction, ratios of lengths.
// Mean distance, standard deviations, at which an edge as a whole contradicts the others.
constexpr double kContradiction = 4.0;
constexpr double kEstimatedFocal = 0.01;  // As EstimatePose has it.
constexpr int kMinEdges = 5;              // Unknowns: rotation, direction, ratios of lengths: 7.

// Of a carton before its own edges tell; none where lines are exact, that is simulated.
double UsualWearPx(const BoxObservation& box, const NoiseModel& noise) {
  if (!(noise.line_px > 0.0)) return 0.0;
  double longest = 0.0;
  for (const BoxEdge& edge : box.edges) longest = std::max(longest, EdgeLengthPx(edge));
  return kWornShare * longest;
}

// What the edges' root mean squares make of it: an error in place and one in direction each.
double WearPx(const std::vector<double>& residuals_px, double usual_px) {
  double sum = kWornFreedom * usual_px * usual_px;
  for (const double residual : residuals_px) sum += residual * residual;
  const double freedom = 2.0 * static_cast<double>(residuals_px.size()) - kUnknowns;
  return std::sqrt(sum / (kWornFreedom + std::max(freedom, 0.0)));
}

// The edges of which the camera can undistort two points: those that it can have seen.
std::vector<std::size_t> UsableEdges(const Camera& camera, const BoxObservation& box,
                                     std::vector<std::string>* notes) {
  std::vector<std::size_t> usable;
  for (std::size_t e = 0; e < box.edges.size(); ++e) {
    std::vector<CalibratedPoint> points;
    CalibrateInliers(camera, box.edges[e].points, {}, &points);
    if (points.size() >= 2) {
      usable.push_back(e);
    } else {
      notes->push_back(std::string("an edge along ") + "xyz"[box.edges[e].axis] +
                       " lies where the lens shows nothing and is left out");
    }
  }
  return usable;
}

// Along each axis there must be an edge at the near end and one at the far end.
Status CheckEdges(const BoxObservation& box, const std::vector<std::size_t>& edges) {
  const std::string name = "the box '" + box.id + "'";
  for (int k = 0; k < 3; ++k) {
    bool along = false, near = false, far = false;
    for (const std::size_t e : edges) {
      const BoxEdge& edge = box.edges[e];
      if (edge.axis == k) along = true;
      if (edge.axis != k) (edge.far[static_cast<std::size_t>(k)] ? far : near) = true;
    }
    if (!along) return Status::Refused(name + ": no edge along " + "xyz"[k] + " is seen");
    if (!near || !far) {
      return Status::Refused(name + ": edges at one end only of its length along " + "xyz"[k] +
                             " are seen, which leaves that open");
    }
  }
  if (edges.size() < kMinEdges) {
    return Status::Refused(name + ": " + std::to_string(edges.size()) +
                           " edges do not fix it; five are the least");
  }
  return Status::Ok();
}

// Turns axes along which the box lies backwards, so that lengths are positive. False where that
// leaves them left-handed, or a corner behind the camera.
bool StartState(const Camera& camera, const BoxObservation& box,
                const std::vector<std::size_t>& edges, const Eigen::Matrix3d& axes,
                BoxState* state) {
  std::vector<BoxEdge> chosen;
  for (const std::size_t e : edges) chosen.push_back(box.edges[e]);
  Eigen::Vector3d length;
  if (!PlaceBox(camera, chosen, axes, &state->translation, &length)) return false;
  Eigen::Matrix3d turned = axes;
  for (int k = 0; k < 3; ++k) turned.col(k) *= length[k] < 0.0 ? -1.0 : 1.0;
  if (turned.determinant() < 0.0 || !(length.cwiseAbs().minCoeff() > 0.0)) return false;
  for (int corner = 0; corner < 8; ++corner) {
    if (!((state->translation + turned * BoxCorner(length.cwiseAbs(), corner)).z() > 0.0))
      return false;
  }
  state->rotation = Eigen::Quaterniond(turned);
  state->length = length.cwiseAbs();
  for (int k = 0; k < 3; ++k) {
    const double known = box.length[static_cast<std::size_t>(k)];
    if (!(known > 0.0)) continue;
    const double scale = known / state->length[k];
    state->translation *= scale;
    state->length *= scale;
    break;
  }
  return true;
}

BoxObservation WithZTurned(BoxObservation box) {
  for (BoxEdge& edge : box.edges) edge.far[2] = !edge.far[2];
  return box;
}

// The best of the starts, where it is better than `fit`.
void FitEdges(const Camera& camera, const BoxObservation& box, const BoxOptions& options,
              const std::vector<std::size_t>& edges, const std::vector<Eigen::Matrix3d>& starts,
              double wear_px, BoxFit* fit, std::vector<double>* residuals_px) {
  const bool is_estimated = options.camera.log_focal >= kEstimatedFocal;
  for (const Eigen::Matrix3d& axes : starts) {
    BoxState state;
    if (!StartState(camera, box, edges, axes, &state)) continue;
    BoxProblem problem(camera, box, options, edges, wear_px, &state);
    if (!problem.Solve() || !(state.length.minCoeff() > 0.0)) continue;
    if (!fit->edges.empty() && problem.cost() >= fit->cost) continue;
    BoxFit now;
    if (!problem.Covariance(&now.covariance, &now.focal_sigma)) continue;
    if (!is_estimated) now.focal_sigma = 0.0;
    now.cam_from_box = {state.rotation.normalized().toRotationMatrix(), state.translation};
    now.length = state.length;
    now.metric = problem.metric();
    now.camera = is_estimated ? ShiftedCamera(camera, state.camera.data()) : camera;
    now.cost = problem.cost();
    now.edges = edges;
    *fit = std::move(now);
    *residuals_px = problem.ResidualsPx();
  }
}

}  // namespace

Status FitBox(const Camera& camera, const BoxObservation& observed, const BoxOptions& options,
              const std::optional<Eigen::Matrix3d>& start, BoxFit* fit) {
  BoxObservation box = observed;
  for (BoxEdge& edge : box.edges) {
    if (!(edge.sigma_px > 0.0)) edge.sigma_px = options.point_sigma_px;
  }
  std::vector<std::string> notes;
  std::vector<std::size_t> edges = UsableEdges(camera, box, &notes);
  Status status = CheckEdges(box, edges);
  if (!status.ok()) return status;
  // Where perspective is weak a box turned inside out looks nearly alike: all starts are tried.
  std::vector<Eigen::Matrix3d> starts = BoxAxes(camera, box.edges);
  if (start) starts.push_back(*start);
  const double usual_px = UsualWearPx(box, options.noise);
  while (true) {
    std::vector<double> residuals_px;
    double wear_px = usual_px;
    for (int pass = 0; pass < 2; ++pass) {
      *fit = BoxFit();
      FitEdges(camera, box, options, edges, starts, wear_px, fit, &residuals_px);
      // Axes drawn left-handed have no rotation: there z begins at its other end.
      FitEdges(camera, WithZTurned(box), options, edges, starts, wear_px, fit, &residuals_px);
      if (fit->edges.empty()) {
        return Status::Refused("the box '" + box.id +
                               "': no box before the camera has these edges at right angles");
      }
      if (!(usual_px > 0.0)) break;
      if (pass == 0) wear_px = WearPx(residuals_px, usual_px);
    }
    const auto worst = static_cast<std::size_t>(
        std::max_element(residuals_px.begin(), residuals_px.end()) - residuals_px.begin());
    const BoxEdge& edge = box.edges[edges[worst]];
    const double sigma = std::hypot(edge.sigma_px, std::hypot(options.noise.line_px, usual_px));
    std::vector<std::size_t> others = edges;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(worst));
    if (residuals_px[worst] <= kContradiction * sigma || !CheckEdges(box, others).ok()) {
      double sum = 0.0;
      for (const double residual : residuals_px) sum += residual * residual;
      fit->rms_px = std::sqrt(sum / static_cast<double>(residuals_px.size()));
      break;
    }
    notes.push_back(std::string("an edge along ") + "xyz"[edge.axis] +
                    " contradicts the others and is left out");
    edges = std::move(others);
  }
  fit->notes = std::move(notes);
  return Status::Ok();
}

}  // namespace circline::apps
