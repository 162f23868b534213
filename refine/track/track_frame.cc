// The terms of a frame, and where hypotheses start. track_update.cc: what comes of them.
#include "circline/refine/track/track_frame.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cstdio>
#include <limits>

#include "circline/estimators/circle_pose.h"
#include "circline/refine/block_chain.h"
#include "circline/refine/evidence_points.h"

namespace circline {
namespace {

int NumDistortion(const EstimationOptions& options) {
  return options.camera_sigma.value_or(options.noise_model.camera).k1 > 0.0 ? 1 : 0;
}

}  // namespace

std::string TrackFrame::Term::Name() const {
  switch (kind) {
    case Kind::kCircle:
      return "circle '" + id + "'";
    case Kind::kCenter:
      return "the centre of circle '" + id.substr(0, id.rfind('.')) + "'";
    case Kind::kLine:
      break;
  }
  return "line '" + id + "'";
}

void TrackFrame::Reset(const Observations& fitted, double news) {
  observations_ = &fitted;
  news_ = news;
  terms_.Shorten(0);
  best_circle_ = best_observation_ = -1;
  for (const TrackMap::Circle& circle : map_.circles) {
    const int index = FindCircle(fitted, circle.id);
    if (index >= 0) AddCircle(static_cast<std::size_t>(index), circle);
  }
  for (const TrackMap::Direction& direction : map_.directions) {
    const std::optional<Segment>* axis = direction.id == kXAxisId   ? &fitted.frame.x_axis
                                         : direction.id == kYAxisId ? &fitted.frame.y_axis
                                                                    : nullptr;
    if (axis != nullptr) {
      AddAxis(*axis, direction);
      continue;
    }
    const int index = FindPencil(fitted, direction.id);
    if (index >= 0) AddPencil(fitted.pencils[static_cast<std::size_t>(index)], direction);
  }
}

// One of an earlier frame, whose cost function takes new points, or one without.
TrackFrame::Term& TrackFrame::AddTerm(Term::Kind kind, int layout) {
  Term& term =
      terms_.Recycle([&](const Term& old) { return old.kind == kind && old.layout == layout; });
  term.kind = kind;
  term.layout = layout;
  term.blocks.clear();
  term.id.clear();
  term.free_twice_cost = 0.0;
  term.own = 0;
  term.parent = -1;
  return term;
}

void TrackFrame::AddCircle(std::size_t index, const TrackMap::Circle& circle) {
  const CircleObservation& seen = observations_->circles[index];
  if (!seen.fit) return;
  if (!FillEvidencePoints(observations_->camera, seen.points, seen.inliers, seen.sigma_px, true,
                          options_, NumDistortion(options_), &points_))
    return;
  points_.RemoveCurvatureBias(seen.fit->conic, seen.sigma_px);
  PlaneCircleContourCost::Blocks blocks;
  blocks.tilt_and_height = circle.tilt >= 0;
  blocks.offset = circle.offset >= 0;
  blocks.camera = map_.has_camera();
  Term& term = AddTerm(Term::Kind::kCircle, (blocks.tilt_and_height ? 1 : 0) +
                                                (blocks.offset ? 2 : 0) + (blocks.camera ? 4 : 0));
  term.blocks = {TrackMap::kRotation, TrackMap::kTranslation, circle.center, circle.radius};
  if (blocks.tilt_and_height) term.blocks.push_back(circle.tilt);
  if (blocks.offset) term.blocks.push_back(circle.offset);
  if (blocks.camera) term.blocks.push_back(TrackMap::kCamera);
  term.id = circle.id;
  term.dof = 5;
  term.free_twice_cost = FreeTwiceCost(points_, seen.fit->conic);
  const double mark_sigma = ContourSigma(points_);
  if (term.cost == nullptr)
    term.cost = std::make_unique<PlaneCircleContourCost>(ImagePoints(), blocks);
  static_cast<PlaneCircleContourCost&>(*term.cost).Exchange(&points_);
  const auto is_better = [&](const CircleObservation& other) {
    return seen.fit->Covariance().trace() < other.fit->Covariance().trace();
  };
  if (best_observation_ < 0 ||
      is_better(observations_->circles[static_cast<std::size_t>(best_observation_)])) {
    best_observation_ = static_cast<int>(index);
    best_circle_ = static_cast<int>(&circle - map_.circles.data());
  }
  if (seen.center) AddCenter(seen, circle, mark_sigma);
}

// Of the circle that came last.
void TrackFrame::AddCenter(const CircleObservation& seen, const TrackMap::Circle& circle,
                           double sigma_px) {
  const bool has_camera = map_.has_camera();
  const int parent = static_cast<int>(terms_.size()) - 1;
  Term& mark = AddTerm(Term::Kind::kCenter, has_camera ? 1 : 0);
  mark.blocks = {TrackMap::kRotation, TrackMap::kTranslation, circle.center};
  if (has_camera) mark.blocks.push_back(TrackMap::kCamera);
  mark.id = circle.id;
  mark.id += ".center";
  mark.dof = 2;
  mark.parent = parent;
  if (mark.cost == nullptr) {
    mark.cost = std::make_unique<PlanePointCost>(observations_->camera, *seen.center, sigma_px,
                                                 options_.line_loss.type, has_camera);
  }
  static_cast<PlanePointCost&>(*mark.cost).Reset(observations_->camera, *seen.center, sigma_px);
}

// An axis drawn apart from the pencils' lines.
void TrackFrame::AddAxis(const std::optional<Segment>& axis, const TrackMap::Direction& direction) {
  int pencil, index;
  if (!axis || FindAxisLine(*observations_, *axis, &pencil, &index)) return;
  constexpr double kDrawnSigmaPx = 0.5;  // Of points drawn by hand.
  const double scale = options_.line_loss.scale_px, sigma = scale > 0.0 ? scale : kDrawnSigmaPx;
  LineObservation line;
  line.points = {(*axis)[0], (*axis)[1]};
  std::vector<CalibratedPoint> points;
  LineFit fit;
  CalibrateInliers(observations_->camera, line.points, {}, &points);
  if (points.size() < 2 || !FitLine(points, sigma, &fit).ok()) return;
  line.fit = fit;
  AddLine(line, sigma, direction, 0.0, -1);
}

void TrackFrame::AddPencil(const PencilObservation& pencil, const TrackMap::Direction& direction) {
  for (std::size_t j = 0; j < pencil.lines.size(); ++j) {
    const LineObservation& line = pencil.lines[j];
    AddLine(line, LineSigma(pencil, line), direction, options_.noise_model.line_direction_rad,
            static_cast<int>(j));
  }
}

void TrackFrame::AddLine(const LineObservation& line, double sigma_px,
                         const TrackMap::Direction& direction, double deviation, int number) {
  if (!line.fit) return;
  if (!FillEvidencePoints(observations_->camera, line.points, line.inliers, sigma_px, false,
                          options_, NumDistortion(options_), &points_))
    return;
  const bool has_camera = map_.has_camera();
  Term& term = AddTerm(Term::Kind::kLine, (deviation > 0.0 ? 1 : 0) + (has_camera ? 2 : 0));
  term.blocks = {TrackMap::kRotation, direction.block, kOwn};
  if (has_camera) term.blocks.push_back(TrackMap::kCamera);
  term.id = direction.id;
  if (number >= 0) {
    char text[16];
    std::snprintf(text, sizeof(text), "[%d]", number);
    term.id += text;
  }
  term.dof = 1;
  term.own = deviation > 0.0 ? 2 : 1;
  term.free_twice_cost = FreeTwiceCost(points_, line.fit->line);
  if (term.cost == nullptr)
    term.cost = std::make_unique<DirectionLineCost>(
        ImagePoints(), line.fit->line, DirectionLineCost::Options{deviation, has_camera});
  static_cast<DirectionLineCost&>(*term.cost).Exchange(&points_, line.fit->line);
}

void TrackFrame::Parameters(const Term& term, const double* x, const double* own,
                            const double** out) const {
  const auto index = static_cast<std::size_t>(&term - &terms_[0]);
  for (std::size_t k = 0; k < term.blocks.size(); ++k) {
    out[k] = term.blocks[k] == kOwn ? own + 2 * index : x + map_.block(term.blocks[k]).offset;
  }
}

// Both poses of the best known circle, turned about its normal as the prediction is; how many.
int TrackFrame::CircleStarts(const TrackState& prior, CameraPose* starts) const {
  int num_starts = 0;
  if (best_circle_ < 0) return num_starts;
  const TrackMap::Circle& circle = map_.circles[static_cast<std::size_t>(best_circle_)];
  const CameraPose predicted = prior.Pose(map_);
  const double* center = prior.x.data() + map_.block(circle.center).offset;
  const double radius = prior.x[map_.block(circle.radius).offset];
  const Eigen::Vector3d in_plane(center[0], center[1], 0.0), normal = predicted.rotation.col(2);
  const bool faces = normal.dot(predicted.rotation * in_plane + predicted.translation) < 0.0;
  std::array<CirclePose, 2> poses;
  const int count = CirclePoses(
      observations_->circles[static_cast<std::size_t>(best_observation_)].fit->conic, &poses);
  for (int i = 0; i < count; ++i) {
    const CirclePose& p = poses[static_cast<std::size_t>(i)];
    CameraPose start;
    start.rotation = Eigen::Quaterniond::FromTwoVectors(normal, (faces ? 1.0 : -1.0) * p.normal) *
                     predicted.rotation;
    start.translation = radius * p.center - start.rotation * in_plane;
    if (start.rotation.allFinite() && start.translation.allFinite()) starts[num_starts++] = start;
  }
  return num_starts;
}

// A term's own unknowns at the present pose. False where it cannot lie there.
bool TrackFrame::Place(std::size_t index, TrackFit* fit) const {
  const Term& term = terms_[index];
  if (term.own == 0) return true;
  const double* parameters[kMostBlocks];
  Parameters(term, fit->state.x.data(), fit->own.data(), parameters);
  return static_cast<const DirectionLineCost&>(*term.cost)
      .Start(parameters, fit->own.data() + 2 * index);
}

// All unknowns at a pose and a focal length; lines that cannot lie there are left out.
bool TrackFrame::Begin(const TrackState& prior, const CameraPose& start, double log_focal,
                       TrackFit* fit) const {
  fit->state = prior;
  CameraPose pose = start;
  if (!map_.has_position()) pose.translation = prior.Pose(map_).translation;
  fit->state.SetPose(map_, pose);
  if (!map_.camera_is_considered) fit->state.x[map_.block(TrackMap::kCamera).offset] = log_focal;
  fit->own.assign(2 * terms_.size(), 0.0);
  fit->active.assign(terms_.size(), 1);
  for (std::size_t i = 0; i < terms_.size(); ++i) fit->active[i] = Place(i, fit) ? 1 : 0;
  return std::find(fit->active.begin(), fit->active.end(), 1) != fit->active.end();
}

// Twice a term's cost; infinite where it has none.
double TrackFrame::TwiceCost(std::size_t index, const TrackFit& fit) const {
  const double* parameters[kMostBlocks];
  Parameters(terms_[index], fit.state.x.data(), fit.own.data(), parameters);
  return TwiceCostOf(*terms_[index].cost, nullptr, Weighing(), parameters);
}

double TrackFrame::TermsCost(const TrackFit& fit) const {
  double cost = 0.0;
  for (std::size_t i = 0; i < terms_.size(); ++i)
    cost += fit.active[i] != 0 ? 0.5 * TwiceCost(i, fit) : 0.0;
  return cost;
}

bool TrackFrame::RefineFrom(const TrackState& prior, const CameraPose& pose, double log_focal,
                            Kept<TrackFit>* fits) {
  TrackFit& fit = fits->Add();
  if (Begin(prior, pose, log_focal, &fit) && Minimize(prior, &fit)) return true;
  fits->Shorten(fits->size() - 1);
  return false;
}

void TrackFrame::Refine(const TrackState& prior, Kept<TrackFit>* fits) {
  std::array<CameraPose, 3> poses;
  std::array<double, 3> prior_costs, costs;
  const auto num_circle_poses = static_cast<std::size_t>(CircleStarts(prior, poses.data()));
  const CameraPose predicted = prior.Pose(map_);
  poses[num_circle_poses] = predicted;
  std::size_t best = 0;
  for (std::size_t i = 0; i <= num_circle_poses; ++i) {
    prior_costs[i] = 0.5 * SquaredDistance(predicted, poses[i], prior.PoseCovariance(map_));
    costs[i] = prior_costs[i] + (Begin(prior, poses[i], LogFocal(prior), &begun_)
                                     ? TermsCost(begun_)
                                     : std::numeric_limits<double>::infinity());
    if (costs[i] < costs[best]) best = i;
  }
  RefineFrom(prior, poses[best], LogFocal(prior), fits);
  // The circle's other pose, where the prior does not exclude it.
  constexpr double kExcluded = 20.0;  // Of cost.
  if (num_circle_poses < 2) return;
  const std::size_t other = best < 2 ? 1 - best : prior_costs[0] > prior_costs[1] ? 0 : 1;
  if (prior_costs[other] < kExcluded) RefineFrom(prior, poses[other], LogFocal(prior), fits);
}

}  // namespace circline
