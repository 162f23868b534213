// Circles and the origin, as blocks and terms.
#include <algorithm>
#include <memory>
#include <utility>

#include "circline/refine/evidence_points.h"
#include "circline/refine/joint/joint_builder.h"
#include "circline/refine/mostly_exact.h"

namespace circline {

// --- The origin ---

void JointProblemBuilder::AddOrigin() {
  const FrameObservation& frame = obs_.frame;
  origin_point_ = AddConstant({0.0, 0.0});
  const auto is_seen = [this](const std::optional<Eigen::Vector2d>& pixel) {
    CalibratedPoint unused;
    return pixel && PixelToCalibrated(obs_.camera, *pixel, &unused);
  };
  const bool both_axes = frame.x_axis && frame.y_axis && is_seen((*frame.x_axis)[0]) &&
                         is_seen((*frame.x_axis)[1]) && is_seen((*frame.y_axis)[0]) &&
                         is_seen((*frame.y_axis)[1]);
  p_.origin_observed_ = both_axes || is_seen(frame.origin);
  const int named = frame.origin_is_center.empty() ? -1 : FindCircle(obs_, frame.origin_is_center);
  if (named >= 0 && InPlane(obs_.circles[static_cast<std::size_t>(named)])) {
    origin_circle_ = &obs_.circles[static_cast<std::size_t>(named)];
    p_.origin_observed_ = true;
  } else if (!p_.origin_observed_) {
    // By convention the first circle's centre.
    const auto first = std::find_if(obs_.circles.begin(), obs_.circles.end(),
                                    [this](const CircleObservation& c) { return InPlane(c); });
    if (first != obs_.circles.end()) origin_circle_ = &*first;
  }
  if (origin_circle_ != nullptr && !origin_circle_->concentric.empty())
    concentric_[origin_circle_->concentric] = origin_point_;
  if (!frame.origin) return;
  // An origin that is an end point of a drawn axis is no measurement of its own.
  const auto is_end = [&](const std::optional<Segment>& axis) {
    return axis && ((*axis)[0] == *frame.origin || (*axis)[1] == *frame.origin);
  };
  if (both_axes && (is_end(frame.x_axis) || is_end(frame.y_axis))) return;
  Feature feature{Feature::Kind::kPoint, "frame.origin", "the origin of the frame"};
  feature.dof = 2;
  AddPoint(*frame.origin, DrawnSigma(), origin_point_, AddFeature(feature));
}

void JointProblemBuilder::AddPoint(const Eigen::Vector2d& pixel, double sigma_px, int block,
                                   int feature) {
  CalibratedPoint unused;
  if (!PixelToCalibrated(obs_.camera, pixel, &unused)) {
    p_.unused_.push_back(p_.feature(feature).name +
                         ": not used, it lies where the camera model cannot undistort it");
    return;
  }
  p_.AddTerm(
      new PlanePointCost(obs_.camera, pixel, sigma_px, p_.options_.line_loss.type, camera_ >= 0),
      {JointProblem::kRotation, JointProblem::kTranslation, block, camera_}, feature);
}

// --- Circles ---

int JointProblemBuilder::CenterBlock(const CircleObservation& circle) {
  int own = &circle == origin_circle_ ? origin_point_ : -1;
  int& block =
      circle.concentric.empty() ? own : concentric_.emplace(circle.concentric, -1).first->second;
  if (block < 0) block = p_.AddBlock(2, {});
  if (block == origin_point_ && p_.center_at_origin_ < 0)
    p_.center_at_origin_ = static_cast<int>(p_.circles_.size());
  return block;
}

int JointProblemBuilder::RadiusBlock(const CircleObservation& circle, int feature) {
  const bool is_grouped = !circle.radius_group.empty();
  const auto found = radius_groups_.find(circle.radius_group);
  if (found != radius_groups_.end()) return found->second;
  const double sigma = circle.radius_sigma > 0.0 ? circle.radius_sigma : model_.radius;
  const bool known = circle.radius > 0.0;
  is_metric_ = is_metric_ || known;
  const int block = p_.AddBlock(1, {known ? circle.radius : 1.0}, {}, known && !(sigma > 0.0));
  if (known && sigma > 0.0)
    p_.AddTerm(NewLogPrior(circle.radius, sigma), {block}, is_grouped ? -1 : feature);
  if (is_grouped) radius_groups_[circle.radius_group] = block;
  return block;
}

// Contours of one contrast share an offset where there are several, or a radius to compare with.
int JointProblemBuilder::OffsetBlock(const CircleObservation& circle) {
  if (!(model_.contour_offset_px > 0.0)) return -1;
  const std::size_t contrast = ContrastOf(circle);
  int& block = offsets_[contrast];
  if (block < 0 && (num_circles_[contrast] > 1 || circle.radius > 0.0))
    block = p_.AddDeviation({model_.contour_offset_px}, -1, std::make_unique<MostlyExact>());
  return block;
}

void JointProblemBuilder::AddCircle(std::size_t index) {
  const CircleObservation& circle = obs_.circles[index];
  if (!InPlane(circle)) return;
  ImagePoints points;
  if (!Points(circle.points, circle.inliers, circle.sigma_px, true, &points)) return;
  Feature feature{Feature::Kind::kCircle, circle.id, "circle '" + circle.id + "'"};
  feature.dof = circle.radius > 0.0 ? 3 : 2;
  feature.observation = static_cast<int>(index);
  feature.free_twice_cost = FreeTwiceCost(points, circle.fit->conic);
  const int f = AddFeature(feature), center = CenterBlock(circle), radius = RadiusBlock(circle, f);
  const std::array<double, 3> tilt_sigmas = TiltSigmas(model_);
  const double shape_sigma = model_.circle_shape * circle.fit->irregularity;
  const int tilt = tilt_sigmas[0] > 0.0 ? p_.AddBlock(3, {}) : -1;
  const int shape = model_.circle_shape > 0.0 ? p_.AddShape(shape_sigma, f) : -1;
  const int offset = OffsetBlock(circle);
  const double mark_sigma = ContourSigma(points);
  const PlaneCircleContourCost::Blocks with = {tilt >= 0, shape >= 0, offset >= 0, camera_ >= 0,
                                               tilt_sigmas};
  const int term = p_.AddTerm(new PlaneCircleContourCost(std::move(points), with),
                              {JointProblem::kRotation, JointProblem::kTranslation, center, radius,
                               tilt, shape, offset, camera_},
                              f);
  p_.circles_.push_back({static_cast<int>(index), f, term, center, radius, tilt});
  if (circle.center) AddMark(circle, mark_sigma, center, f);
  for (std::size_t k = 0; k < circle.diameters.size(); ++k) AddDiameter(circle, k, center, f);
}

void JointProblemBuilder::AddMark(const CircleObservation& circle, double sigma_px, int center,
                                  int feature) {
  Feature mark{Feature::Kind::kCenterMark, circle.id + ".center",
               "the centre of circle '" + circle.id + "'"};
  mark.parent = feature;
  mark.dof = 2;
  AddPoint(*circle.center, sigma_px, center, AddFeature(mark));
}

void JointProblemBuilder::AddDiameter(const CircleObservation& circle, std::size_t index,
                                      int center, int feature) {
  const Segment& segment = circle.diameters[index];
  const double sigma = circle.sigma_px;
  ImagePoints points;
  LineFit fit;
  if (!Points({segment[0], segment[1]}, {}, sigma, false, &points) ||
      !FitLine(points.points(), sigma, &fit).ok())
    return;
  Feature diameter{Feature::Kind::kPlaneLine,
                   circle.id + ".diameters[" + std::to_string(index) + "]",
                   "a diameter of circle '" + circle.id + "'"};
  diameter.parent = feature;
  diameter.covariance = fit.covariance;
  const int f = AddFeature(diameter);
  const int angle = p_.AddBlock(1, {});
  AddPlaneLine(std::move(points), center, angle, f);
  p_.plane_lines_.push_back({angle, fit.line});
}

}  // namespace circline
