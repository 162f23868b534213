// The terms of a frame, and where hypotheses start. track_update.cc: what comes of them.
#include "circline/refine/track_frame.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "circline/estimators/circle_pose.h"
#include "circline/refine/evidence_points.h"

namespace circline {
namespace {

// The shortest turn of one unit vector into another.
Eigen::Matrix3d RotationBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d across = from.cross(to);
  const double sine = across.norm();
  const Eigen::Vector3d axis = sine > 0.0 ? Eigen::Vector3d(across / sine) : from.unitOrthogonal();
  return ExpRotation(std::atan2(sine, from.dot(to)) * axis);
}

ImagePoints::Options PointOptions(const EstimationOptions& options, bool is_circle) {
  ImagePoints::Options points;
  points.loss = (is_circle ? options.conic_loss : options.line_loss).type;
  points.distance = options.conic_distance;
  const CameraSigma& sigma = options.camera_sigma.value_or(options.noise_model.camera);
  points.num_distortion = sigma.k1 > 0.0 ? 1 : 0;
  return points;
}

double OneOf(double stated, double option, double measured) {
  return stated > 0.0 ? stated : option > 0.0 ? option : measured;
}

}  // namespace

TrackFrame::TrackFrame(const Observations& fitted, const PointNoise& noise,
                       const EstimationOptions& options, const TrackMap& map)
    : observations_(fitted), options_(options), map_(map) {
  for (const TrackMap::Circle& circle : map.circles) {
    const int index = FindCircle(fitted, circle.id);
    if (index >= 0) AddCircle(static_cast<std::size_t>(index), circle, noise);
  }
  const double deviation = options.noise_model.line_direction_rad;
  for (const TrackMap::Direction& direction : map.directions) {
    const std::optional<Segment>* axis = direction.id == kXAxisId   ? &fitted.frame.x_axis
                                         : direction.id == kYAxisId ? &fitted.frame.y_axis
                                                                    : nullptr;
    if (axis != nullptr) {
      AddAxis(*axis, direction);
      continue;
    }
    const int index = FindPencil(fitted, direction.id);
    if (index < 0) continue;
    const PencilObservation& pencil = fitted.pencils[static_cast<std::size_t>(index)];
    for (std::size_t j = 0; j < pencil.lines.size(); ++j) {
      const LineObservation& line = pencil.lines[j];
      const double sigma = OneOf(LineSigma(pencil, line), options.line_loss.scale_px,
                                 noise.lines[static_cast<std::size_t>(index)][j]);
      AddLine(line, sigma, direction.block, deviation, pencil.id + "[" + std::to_string(j) + "]");
    }
  }
}

void TrackFrame::AddCircle(std::size_t index, const TrackMap::Circle& circle,
                           const PointNoise& noise) {
  const CircleObservation& seen = observations_.circles[index];
  if (!seen.fit) return;
  const double sigma = OneOf(seen.sigma_px, options_.conic_loss.scale_px, noise.circles[index]);
  std::optional<ImagePoints> points =
      EvidencePoints(observations_.camera, seen.points, seen.inliers, sigma, true,
                     options_.noise_model, PointOptions(options_, true));
  if (!points) return;
  PlaneCircleContourCost::Blocks blocks;
  blocks.tilt_and_height = circle.tilt >= 0;
  // What the map knows of them is in its own Gaussian.
  constexpr double kNothing = 1e3;
  blocks.tilt_sigma = blocks.height_sigma = kNothing;
  blocks.offset = circle.offset >= 0;
  blocks.camera = map_.has_camera();
  Term term;
  term.blocks = {TrackMap::kRotation, TrackMap::kTranslation, circle.center, circle.radius};
  if (blocks.tilt_and_height) term.blocks.push_back(circle.tilt);
  if (blocks.offset) term.blocks.push_back(circle.offset);
  if (blocks.camera) term.blocks.push_back(TrackMap::kCamera);
  term.id = circle.id;
  term.name = "circle '" + circle.id + "'";
  term.dof = 5;
  term.free_twice_cost = FreeTwiceCost(*points, seen.fit->conic);
  const ImagePoints::Options& contour = points->options();
  const double mark_sigma = contour.sigma_px / std::sqrt(contour.weight);
  term.cost = std::make_unique<PlaneCircleContourCost>(std::move(*points), blocks);
  terms_.push_back(std::move(term));
  const int parent = static_cast<int>(terms_.size()) - 1;
  const auto is_better = [&](const CircleObservation& other) {
    return seen.fit->Covariance().trace() < other.fit->Covariance().trace();
  };
  if (best_observation_ < 0 ||
      is_better(observations_.circles[static_cast<std::size_t>(best_observation_)])) {
    best_observation_ = static_cast<int>(index);
    best_circle_ = static_cast<int>(&circle - map_.circles.data());
  }
  if (!seen.center) return;
  Term mark;
  mark.blocks = {TrackMap::kRotation, TrackMap::kTranslation, circle.center};
  if (map_.has_camera()) mark.blocks.push_back(TrackMap::kCamera);
  mark.id = circle.id + ".center";
  mark.name = "the centre of circle '" + circle.id + "'";
  mark.dof = 2;
  mark.parent = parent;
  mark.cost = std::make_unique<PlanePointCost>(observations_.camera, *seen.center, mark_sigma,
                                               options_.line_loss.type, map_.has_camera());
  terms_.push_back(std::move(mark));
}

// An axis drawn apart from the pencils' lines.
void TrackFrame::AddAxis(const std::optional<Segment>& axis, const TrackMap::Direction& direction) {
  int pencil, index;
  if (!axis || FindAxisLine(observations_, *axis, &pencil, &index)) return;
  constexpr double kDrawnSigmaPx = 0.5;  // Of points drawn by hand.
  const double scale = options_.line_loss.scale_px, sigma = scale > 0.0 ? scale : kDrawnSigmaPx;
  LineObservation line;
  line.points = {(*axis)[0], (*axis)[1]};
  std::vector<CalibratedPoint> points;
  LineFit fit;
  CalibrateInliers(observations_.camera, line.points, {}, &points);
  if (points.size() < 2 || !FitLine(points, sigma, &fit).ok()) return;
  line.fit = fit;
  AddLine(line, sigma, direction.block, 0.0, direction.id);
}

void TrackFrame::AddLine(const LineObservation& line, double sigma_px, int direction,
                         double deviation, const std::string& id) {
  if (!line.fit) return;
  std::optional<ImagePoints> points =
      EvidencePoints(observations_.camera, line.points, line.inliers, sigma_px, false,
                     options_.noise_model, PointOptions(options_, false));
  if (!points) return;
  Term term;
  term.blocks = {TrackMap::kRotation, direction, kOwn};
  if (map_.has_camera()) term.blocks.push_back(TrackMap::kCamera);
  term.id = id;
  term.name = "line '" + id + "'";
  term.dof = 1;
  term.own = deviation > 0.0 ? 2 : 1;
  term.free_twice_cost = FreeTwiceCost(*points, line.fit->line);
  DirectionLineCost::Options options;
  options.direction_sigma = deviation;
  options.camera = map_.has_camera();
  term.cost = std::make_unique<DirectionLineCost>(std::move(*points), line.fit->line, options);
  terms_.push_back(std::move(term));
}

void TrackFrame::Parameters(const Term& term, const double* x, const double* own,
                            const double** out) const {
  const auto index = static_cast<std::size_t>(&term - terms_.data());
  for (std::size_t k = 0; k < term.blocks.size(); ++k) {
    out[k] = term.blocks[k] == kOwn ? own + 2 * index : x + map_.block(term.blocks[k]).offset;
  }
}

// Both poses of the best known circle, turned about its normal as the prediction is.
std::vector<CameraPose> TrackFrame::CircleStarts(const TrackState& prior) const {
  std::vector<CameraPose> starts;
  if (best_circle_ < 0) return starts;
  const TrackMap::Circle& circle = map_.circles[static_cast<std::size_t>(best_circle_)];
  const CameraPose predicted = prior.Pose(map_);
  const double* center = prior.x.data() + map_.block(circle.center).offset;
  const double radius = prior.x[map_.block(circle.radius).offset];
  const Eigen::Vector3d in_plane(center[0], center[1], 0.0), normal = predicted.rotation.col(2);
  const bool faces = normal.dot(predicted.rotation * in_plane + predicted.translation) < 0.0;
  std::array<CirclePose, 2> poses;
  const int count = CirclePoses(
      observations_.circles[static_cast<std::size_t>(best_observation_)].fit->conic, &poses);
  for (int i = 0; i < count; ++i) {
    const CirclePose& p = poses[static_cast<std::size_t>(i)];
    CameraPose start;
    start.rotation =
        RotationBetween(normal, faces ? p.normal : Eigen::Vector3d(-p.normal)) * predicted.rotation;
    start.translation = radius * p.center - start.rotation * in_plane;
    if (start.rotation.allFinite() && start.translation.allFinite()) starts.push_back(start);
  }
  return starts;
}

// A term's own unknowns at the present pose. False where it cannot lie there.
bool TrackFrame::Place(std::size_t index, TrackFit* fit) const {
  const Term& term = terms_[index];
  if (term.own == 0) return true;
  const double* parameters[8];
  Parameters(term, fit->state.x.data(), fit->own.data(), parameters);
  return static_cast<const DirectionLineCost&>(*term.cost)
      .Start(parameters, fit->own.data() + 2 * index);
}

// All unknowns at a pose; lines that cannot lie there are left out.
bool TrackFrame::Begin(const TrackState& prior, const CameraPose& start, TrackFit* fit) const {
  fit->state = prior;
  CameraPose pose = start;
  if (!map_.has_position()) pose.translation = prior.Pose(map_).translation;
  fit->state.SetPose(map_, pose);
  fit->own.assign(2 * terms_.size(), 0.0);
  fit->active.assign(terms_.size(), 1);
  bool any = false;
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    fit->active[i] = Place(i, fit) ? 1 : 0;
    any = any || fit->active[i] != 0;
  }
  return any;
}

double TrackFrame::TermsCost(const TrackFit& fit) const {
  constexpr int kMaxResiduals = CurveModel::kMaxSize + 6;
  double residuals[kMaxResiduals], cost = 0.0;
  const double* parameters[8];
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    if (fit.active[i] == 0) continue;
    Parameters(terms_[i], fit.state.x.data(), fit.own.data(), parameters);
    if (!terms_[i].cost->Evaluate(parameters, residuals, nullptr))
      return std::numeric_limits<double>::infinity();
    for (int k = 0; k < terms_[i].cost->num_residuals(); ++k)
      cost += 0.5 * residuals[k] * residuals[k];
  }
  return cost;
}

namespace {

// Half the squared distance of a pose from the prior's.
double PriorCost(const TrackMap& map, const TrackState& prior, const CameraPose& pose) {
  const int size = map.tangent(TrackMap::kTurnRate);
  const CameraPose mean = prior.Pose(map);
  Eigen::VectorXd e(size);
  e.head<3>() = LogRotation(mean.rotation.transpose() * pose.rotation);
  if (size == 6) e.tail<3>() = pose.translation - mean.translation;
  const Eigen::LLT<Eigen::MatrixXd> llt(prior.covariance.topLeftCorner(size, size));
  return llt.info() == Eigen::Success ? 0.5 * e.dot(llt.solve(e)) : 0.0;
}

}  // namespace

bool TrackFrame::RefineHere(const TrackState& prior, double log_focal,
                            const TrackerOptions& options, TrackFit* fit) const {
  // From this camera, through which lines are placed, too.
  TrackState start = prior;
  if (!map_.camera_is_considered) start.x[map_.block(TrackMap::kCamera).offset] = log_focal;
  return Begin(start, prior.Pose(map_), fit) && RefineFrom(prior, options, fit);
}

void TrackFrame::KeepCheapest(std::size_t most, std::vector<TrackState>* states) const {
  if (states->size() <= most) return;
  std::vector<double> costs;
  TrackFit begun;
  for (const TrackState& state : *states) {
    costs.push_back(Begin(state, state.Pose(map_), &begun) ? TermsCost(begun)
                                                           : std::numeric_limits<double>::max());
  }
  std::vector<double> sorted = costs;
  std::sort(sorted.begin(), sorted.end());
  std::vector<TrackState> cheapest;
  for (std::size_t i = 0; i < costs.size() && cheapest.size() < most; ++i) {
    if (costs[i] <= sorted[most - 1]) cheapest.push_back(std::move((*states)[i]));
  }
  *states = std::move(cheapest);
}

void TrackFrame::Refine(const TrackState& prior, const TrackerOptions& options,
                        std::vector<TrackFit>* fits) const {
  struct Start {
    CameraPose pose;
    double prior_cost, cost;
  };
  std::vector<Start> starts;
  TrackFit begun;
  std::vector<CameraPose> poses = CircleStarts(prior);
  const std::size_t num_circle_poses = poses.size();
  poses.push_back(prior.Pose(map_));
  for (const CameraPose& pose : poses) {
    const double prior_cost = PriorCost(map_, prior, pose);
    const double cost =
        Begin(prior, pose, &begun) ? TermsCost(begun) : std::numeric_limits<double>::infinity();
    starts.push_back({pose, prior_cost, prior_cost + cost});
  }
  const auto best = static_cast<std::size_t>(
      std::min_element(starts.begin(), starts.end(),
                       [](const Start& a, const Start& b) { return a.cost < b.cost; }) -
      starts.begin());
  // The circle's other pose, where the prior does not exclude it.
  constexpr double kExcluded = 20.0;  // Of cost.
  std::vector<std::size_t> chosen = {best};
  if (num_circle_poses == 2) {
    const std::size_t other = best < 2                                      ? 1 - best
                              : starts[0].prior_cost > starts[1].prior_cost ? 0
                                                                            : 1;
    if (starts[other].prior_cost < kExcluded) chosen.push_back(other);
  }
  for (const std::size_t i : chosen) {
    TrackFit fit;
    if (Begin(prior, starts[i].pose, &fit) && RefineFrom(prior, options, &fit))
      fits->push_back(std::move(fit));
  }
}

}  // namespace circline
