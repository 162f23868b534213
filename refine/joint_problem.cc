#include "circline/refine/joint_problem.h"

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "circline/refine/block_chain.h"
#include "circline/refine/long_tails.h"
#include "circline/refine/manifolds.h"
#include "circline/refine/square_root.h"

namespace circline {
namespace {

constexpr double kHalfPi = 1.57079632679489661923;
constexpr double kDrawnSigmaPx = 0.5;  // Of points drawn by hand: axes, the origin, lengths' ends.
constexpr double kExactAngle = 1e-6;   // Radians: stands for an angle that is known exactly.
constexpr double kExactLength = 1e-6;  // Relative: the same for a length.
// From here on a camera is estimated, below it is only counted in the covariance.
constexpr double kEstimatedFocal = 0.01;

}  // namespace

// Adds one feature after the other.
class JointProblemBuilder {
 public:
  JointProblemBuilder(const PointNoise& noise, JointProblem* problem)
      : p_(*problem), obs_(p_.observations_), model_(p_.options_.noise_model), noise_(noise) {}

  void Build();

 private:
  int AddBlock(int size, std::vector<double> value, std::unique_ptr<ceres::Manifold> manifold = {},
               bool is_constant = false, int group = -1);
  int AddConstant(std::vector<double> value) {
    const int size = static_cast<int>(value.size());
    return AddBlock(size, std::move(value), {}, true);
  }
  int AddTerm(std::unique_ptr<ceres::CostFunction> cost, std::vector<int> blocks, int feature = -1,
              int group = -1);
  int AddFeatureTerm(std::unique_ptr<FeatureCost> cost, std::vector<int> blocks, int feature,
                     int group);
  int AddFeature(Feature feature);
  std::vector<int> WithCamera(std::vector<int> blocks) const;

  ImagePoints::Options PointOptions(double sigma_px, bool is_circle) const;
  std::optional<ImagePoints> Points(const std::vector<Eigen::Vector2d>& pixels,
                                    const std::vector<std::uint8_t>& inliers, double sigma_px,
                                    bool is_circle) const;
  double FreeCost(const ImagePoints& points, const Eigen::Matrix3d& conic) const;
  double FreeCost(const ImagePoints& points, const Eigen::Vector3d& line) const;

  void AddOrigin();
  void AddCircle(std::size_t index);
  int CenterBlock(const CircleObservation& circle, int group);
  int RadiusBlock(const CircleObservation& circle, int feature, int group);
  int OffsetBlock(const CircleObservation& circle);
  void AddDiameter(const CircleObservation& circle, std::size_t index, int center, int group,
                   int feature);
  void AddMark(const CircleObservation& circle, const ImagePoints& points, int center, int group,
               int feature);
  void AddPencil(std::size_t index);
  void AddLine(ImagePoints points, const Eigen::Vector3d& fit, int direction,
               double direction_sigma, Feature feature);
  int DirectionBlock(const PencilObservation& pencil);
  int AxisOfLine(std::size_t pencil, std::size_t line) const;
  void AddAxisLine(const LineObservation& line, double sigma_px, int axis, const std::string& id,
                   const std::string& name);
  void AddDrawnAxis(const std::optional<Segment>& axis, int which);
  void AddAngle(std::size_t index);
  void AddLength(std::size_t index);
  void AddPoint(const Eigen::Vector2d& pixel, double sigma_px, int block, int feature, int group);
  void AddTranslation();
  void AddPriors();

  bool InPlane(const CircleObservation& circle) const {
    return circle.fit && circle.plane == obs_.frame.plane;
  }
  bool IsAtOrigin(const CircleObservation& circle) const;
  double DrawnSigma() const {
    return p_.options_.line_loss.scale_px > 0.0 ? p_.options_.line_loss.scale_px : kDrawnSigmaPx;
  }

  JointProblem& p_;
  const Observations& obs_;
  const NoiseModel& model_;
  const PointNoise& noise_;
  bool has_camera_ = false, is_metric_ = false;
  int origin_point_ = -1;  // Constant block (0, 0).
  std::string origin_circle_;
  std::map<std::string, int> concentric_, radius_groups_, directions_;
};

int JointProblemBuilder::AddBlock(int size, std::vector<double> value,
                                  std::unique_ptr<ceres::Manifold> manifold, bool is_constant,
                                  int group) {
  Block block;
  block.offset = static_cast<int>(p_.defaults_.size());
  block.size = size;
  block.manifold = manifold.get();
  block.is_constant = is_constant;
  block.group = group;
  if (manifold != nullptr) p_.manifolds_.push_back(std::move(manifold));
  value.resize(static_cast<std::size_t>(size));
  p_.defaults_.insert(p_.defaults_.end(), value.begin(), value.end());
  p_.blocks_.push_back(block);
  return static_cast<int>(p_.blocks_.size()) - 1;
}

int JointProblemBuilder::AddTerm(std::unique_ptr<ceres::CostFunction> cost, std::vector<int> blocks,
                                 int feature, int group) {
  p_.terms_.push_back({std::move(cost), std::move(blocks), feature, group, nullptr, nullptr});
  return static_cast<int>(p_.terms_.size()) - 1;
}

int JointProblemBuilder::AddFeatureTerm(std::unique_ptr<FeatureCost> cost, std::vector<int> blocks,
                                        int feature, int group) {
  FeatureCost* weighed = cost.get();
  const int term = AddTerm(std::unique_ptr<ceres::CostFunction>(std::move(cost)),
                           WithCamera(std::move(blocks)), feature, group);
  p_.terms_.back().weighed = weighed;
  return term;
}

int JointProblemBuilder::AddFeature(Feature feature) {
  p_.features_.push_back(std::move(feature));
  return static_cast<int>(p_.features_.size()) - 1;
}

std::vector<int> JointProblemBuilder::WithCamera(std::vector<int> blocks) const {
  if (has_camera_) blocks.push_back(JointProblem::kCamera);
  return blocks;
}

ImagePoints::Options JointProblemBuilder::PointOptions(double sigma_px, bool is_circle) const {
  const LossOptions& loss = is_circle ? p_.options_.conic_loss : p_.options_.line_loss;
  ImagePoints::Options options;
  options.sigma_px = sigma_px;
  options.loss = loss.type;
  options.distance = p_.options_.conic_distance;
  options.num_distortion = p_.camera_sigma_.k1 > 0.0 ? 1 : 0;
  return options;
}

std::optional<ImagePoints> JointProblemBuilder::Points(const std::vector<Eigen::Vector2d>& pixels,
                                                       const std::vector<std::uint8_t>& inliers,
                                                       double sigma_px, bool is_circle) const {
  if (pixels.empty()) return {};
  // A point is off by its own noise and by what it shares with its neighbours.
  const double shared = is_circle ? model_.contour_px : model_.line_px,
               sigma = std::hypot(sigma_px, shared);
  ImagePoints points(obs_.camera, pixels, inliers, PointOptions(sigma, is_circle));
  if (points.size() < (is_circle ? 5U : 2U)) return {};
  const double weight = is_circle ? model_.ContourWeight(sigma_px, pixels, inliers)
                                  : model_.LineWeight(sigma_px, pixels, inliers);
  points.set_weight(weight * (sigma * sigma) / (sigma_px * sigma_px));
  return points;
}

double JointProblemBuilder::FreeCost(const ImagePoints& points,
                                     const Eigen::Matrix3d& conic) const {
  CurveModel model;
  points.SumConic(conic, 0.0, nullptr, Weighing(), {}, &model);
  const SquareRoot<6> root = SquareRootOf<6>(model, 5, 6, 5);
  return std::max(0.0, model.twice_cost - root.f.squaredNorm());
}

double JointProblemBuilder::FreeCost(const ImagePoints& points, const Eigen::Vector3d& line) const {
  CurveModel model;
  points.SumLine(line, nullptr, Weighing(), false, &model);
  const SquareRoot<3> root = SquareRootOf<3>(model, 2, 3, 2);
  return std::max(0.0, model.twice_cost - root.f.squaredNorm());
}

void JointProblemBuilder::Build() {
  const CameraSigma& sigma = p_.camera_sigma_;
  const bool has_distortion = obs_.camera.model != CameraModel::kPinhole;
  std::vector<double> sigmas(kCameraSize, 0.0);
  sigmas[0] = sigma.log_focal;
  sigmas[1] = sigma.log_aspect;
  sigmas[2] = sigmas[3] = sigma.principal_point_px;
  sigmas[4] = has_distortion ? sigma.k1 : 0.0;
  has_camera_ = std::any_of(sigmas.begin(), sigmas.end(), [](double s) { return s > 0.0; });
  p_.camera_is_estimated_ = sigma.log_focal >= kEstimatedFocal;

  AddBlock(4, {0.0, 0.0, 0.0, 1.0});
  AddBlock(3, {0.0, 0.0, 1.0});
  std::vector<int> held;
  for (int k = 0; k < kCameraSize; ++k) {
    if (!(sigmas[static_cast<std::size_t>(k)] > 0.0)) held.push_back(k);
  }
  std::unique_ptr<ceres::Manifold> manifold;
  if (!held.empty() && has_camera_)
    manifold = std::make_unique<ceres::SubsetManifold>(kCameraSize, held);
  AddBlock(kCameraSize, std::vector<double>(kCameraSize, 0.0), std::move(manifold),
           !p_.camera_is_estimated_);
  if (p_.camera_is_estimated_) {
    AddTerm(std::unique_ptr<ceres::CostFunction>(NewGaussianPrior(sigmas)),
            {JointProblem::kCamera});
  }
  AddOrigin();
  for (std::size_t i = 0; i < obs_.circles.size(); ++i) AddCircle(i);
  for (std::size_t i = 0; i < obs_.pencils.size(); ++i) AddPencil(i);
  AddDrawnAxis(obs_.frame.x_axis, 0);
  AddDrawnAxis(obs_.frame.y_axis, 1);
  for (std::size_t i = 0; i < obs_.known_angles.size(); ++i) AddAngle(i);
  for (std::size_t i = 0; i < obs_.known_lengths.size(); ++i) AddLength(i);
  AddTranslation();
  AddPriors();
  p_.blocks_[JointProblem::kRotation].manifold =
      p_.manifolds_.emplace_back(std::make_unique<WorldRotationManifold>(p_.x_is_fixed_ ? 3 : 2))
          .get();
}

// --- The origin ---

bool JointProblemBuilder::IsAtOrigin(const CircleObservation& circle) const {
  if (origin_circle_.empty()) return false;
  if (circle.id == origin_circle_) return true;
  const int index = FindCircle(obs_, origin_circle_);
  return index >= 0 && !circle.concentric.empty() &&
         obs_.circles[static_cast<std::size_t>(index)].concentric == circle.concentric;
}

void JointProblemBuilder::AddOrigin() {
  const FrameObservation& frame = obs_.frame;
  origin_point_ = AddConstant({0.0, 0.0});
  const bool both_axes = frame.x_axis && frame.y_axis;
  p_.origin_observed_ = both_axes || frame.origin;
  const int named = frame.origin_is_center.empty() ? -1 : FindCircle(obs_, frame.origin_is_center);
  if (named >= 0 && InPlane(obs_.circles[static_cast<std::size_t>(named)])) {
    origin_circle_ = frame.origin_is_center;
    p_.origin_observed_ = true;
  } else if (!p_.origin_observed_) {
    // By convention the first circle's centre.
    const auto first = std::find_if(obs_.circles.begin(), obs_.circles.end(),
                                    [this](const CircleObservation& c) { return InPlane(c); });
    if (first != obs_.circles.end()) origin_circle_ = first->id;
  }
  if (!frame.origin) return;
  // An origin that is an end point of a drawn axis is no measurement of its own.
  const auto is_end = [&](const std::optional<Segment>& axis) {
    return axis && ((*axis)[0] == *frame.origin || (*axis)[1] == *frame.origin);
  };
  if (both_axes && (is_end(frame.x_axis) || is_end(frame.y_axis))) return;
  Feature feature{Feature::Kind::kPoint, "frame.origin", "the origin of the frame"};
  feature.dof = 2;
  AddPoint(*frame.origin, DrawnSigma(), origin_point_, AddFeature(feature), -1);
}

void JointProblemBuilder::AddPoint(const Eigen::Vector2d& pixel, double sigma_px, int block,
                                   int feature, int group) {
  CalibratedPoint unused;
  if (!PixelToCalibrated(obs_.camera, pixel, &unused)) {
    p_.unused_.push_back(p_.features_[static_cast<std::size_t>(feature)].name +
                         ": not used, it lies where the camera model cannot undistort it");
    return;
  }
  const int term =
      AddFeatureTerm(std::make_unique<PlanePointCost>(obs_.camera, pixel, sigma_px,
                                                      p_.options_.line_loss.type, has_camera_),
                     {JointProblem::kRotation, JointProblem::kTranslation, block}, feature, group);
  p_.points_.push_back({term, feature});
}

// --- Circles ---

int JointProblemBuilder::CenterBlock(const CircleObservation& circle, int group) {
  if (IsAtOrigin(circle)) {
    if (p_.center_at_origin_ < 0) p_.center_at_origin_ = static_cast<int>(p_.circles_.size());
    return origin_point_;
  }
  if (circle.concentric.empty()) return AddBlock(2, {0.0, 0.0}, {}, false, group);
  const auto found = concentric_.find(circle.concentric);
  if (found != concentric_.end()) return found->second;
  return concentric_[circle.concentric] = AddBlock(2, {0.0, 0.0});
}

int JointProblemBuilder::RadiusBlock(const CircleObservation& circle, int feature, int group) {
  const bool grouped = !circle.radius_group.empty();
  if (grouped) {
    const auto found = radius_groups_.find(circle.radius_group);
    if (found != radius_groups_.end()) return found->second;
  }
  const double sigma = circle.radius_sigma > 0.0 ? circle.radius_sigma : model_.radius;
  const bool known = circle.radius > 0.0;
  is_metric_ = is_metric_ || known;
  const int block =
      AddBlock(1, {known ? circle.radius : 1.0}, {}, known && !(sigma > 0.0), grouped ? -1 : group);
  if (known && sigma > 0.0) {
    AddTerm(std::unique_ptr<ceres::CostFunction>(NewLogPrior(circle.radius, sigma)), {block},
            grouped ? -1 : feature, grouped ? -1 : group);
  }
  if (grouped) radius_groups_[circle.radius_group] = block;
  return block;
}

// Contours of one contrast share an offset where there are several, or a radius to compare with.
int JointProblemBuilder::OffsetBlock(const CircleObservation& circle) {
  if (!(model_.contour_offset_px > 0.0)) return -1;
  const int contrast = std::clamp(circle.contrast, -1, 1);
  const auto count =
      std::count_if(obs_.circles.begin(), obs_.circles.end(), [&](const CircleObservation& c) {
        return InPlane(c) && std::clamp(c.contrast, -1, 1) == contrast;
      });
  int& block = p_.offsets_[contrast + 1];
  if (block < 0 && (count > 1 || circle.radius > 0.0)) {
    block = AddBlock(1, {0.0});
    AddTerm(std::unique_ptr<ceres::CostFunction>(NewGaussianPrior({model_.contour_offset_px})),
            {block});
    p_.terms_.back().loss = std::make_unique<LongTails>();
  }
  return block;
}

void JointProblemBuilder::AddCircle(std::size_t index) {
  const CircleObservation& circle = obs_.circles[index];
  if (!InPlane(circle)) return;
  const double stated = circle.sigma_px > 0.0 ? circle.sigma_px : p_.options_.conic_loss.scale_px;
  std::optional<ImagePoints> points =
      Points(circle.points, circle.inliers, stated > 0.0 ? stated : noise_.circles[index], true);
  if (!points) return;
  Feature feature{Feature::Kind::kCircle, circle.id, "circle '" + circle.id + "'"};
  feature.dof = circle.radius > 0.0 ? 3 : 2;
  feature.observation = static_cast<int>(index);
  feature.free_twice_cost = FreeCost(*points, circle.fit->conic);
  const int f = AddFeature(feature), group = p_.num_groups_++;
  const int center = CenterBlock(circle, group), radius = RadiusBlock(circle, f, group);

  PlaneCircleContourCost::Blocks blocks;
  blocks.tilt_and_height = model_.circle_tilt_rad > 0.0 || model_.circle_height > 0.0;
  blocks.tilt_sigma = model_.circle_tilt_rad;
  blocks.height_sigma = model_.circle_height;
  blocks.camera = has_camera_;
  std::vector<int> used = {JointProblem::kRotation, JointProblem::kTranslation, center, radius};
  const int tilt = blocks.tilt_and_height ? AddBlock(3, {0.0, 0.0, 0.0}, {}, false, group) : -1;
  if (tilt >= 0) used.push_back(tilt);
  const int offset = OffsetBlock(circle);
  blocks.offset = offset >= 0;
  if (offset >= 0) used.push_back(offset);
  const ImagePoints kept = *points;
  const int term = AddFeatureTerm(
      std::make_unique<PlaneCircleContourCost>(std::move(*points), blocks), used, f, group);
  p_.circles_.push_back({static_cast<int>(index), f, term, center, radius, tilt});
  if (circle.center) AddMark(circle, kept, center, group, f);
  for (std::size_t k = 0; k < circle.diameters.size(); ++k)
    AddDiameter(circle, k, center, group, f);
}

// No better than the contour as a whole.
void JointProblemBuilder::AddMark(const CircleObservation& circle, const ImagePoints& points,
                                  int center, int group, int feature) {
  Feature mark{Feature::Kind::kCenterMark, circle.id + ".center",
               "the centre of circle '" + circle.id + "'"};
  mark.parent = feature;
  mark.dof = 2;
  const ImagePoints::Options& contour = points.options();
  AddPoint(*circle.center, contour.sigma_px / std::sqrt(contour.weight), center, AddFeature(mark),
           group);
}

void JointProblemBuilder::AddDiameter(const CircleObservation& circle, std::size_t index,
                                      int center, int group, int feature) {
  const Segment& segment = circle.diameters[index];
  const double sigma = circle.sigma_px > 0.0 ? circle.sigma_px : DrawnSigma();
  std::optional<ImagePoints> points = Points({segment[0], segment[1]}, {}, sigma, false);
  LineFit fit;
  if (!points || !FitLine(points->points(), 1.0, &fit).ok()) return;
  Feature diameter{Feature::Kind::kPlaneLine,
                   circle.id + ".diameters[" + std::to_string(index) + "]",
                   "a diameter of circle '" + circle.id + "'"};
  diameter.parent = feature;
  const int f = AddFeature(diameter);
  const int angle = AddBlock(1, {0.0}, {}, false, group);
  AddFeatureTerm(std::make_unique<PlaneLineCost>(std::move(*points), has_camera_),
                 {JointProblem::kRotation, JointProblem::kTranslation, center, angle}, f, group);
  p_.plane_lines_.push_back({angle, fit.line});
}

// --- Lines ---

// The drawn axis that a pencil's line carries, where the origin is observed: 0 = x, 1 = y, -1 =
// none.
int JointProblemBuilder::AxisOfLine(std::size_t pencil, std::size_t line) const {
  if (!p_.origin_observed_) return -1;
  const auto carries = [&](const std::optional<Segment>& axis) {
    int p, l;
    return axis && FindAxisLine(obs_, *axis, &p, &l) && p == static_cast<int>(pencil) &&
           l == static_cast<int>(line);
  };
  return carries(obs_.frame.x_axis) ? 0 : carries(obs_.frame.y_axis) ? 1 : -1;
}

// A pencil's direction: tied to its axis or to the plane, as closely as the noise model says.
int JointProblemBuilder::DirectionBlock(const PencilObservation& pencil) {
  const double sigma = model_.pencil_axis_rad;
  const bool is_free = pencil.direction == PencilDirection::kFree;
  const Eigen::Vector3d axis = is_free ? Eigen::Vector3d::UnitX()
                                       : Eigen::Vector3d::Unit(static_cast<int>(pencil.direction));
  const std::vector<double> value(axis.data(), axis.data() + 3);
  if (!(sigma > 0.0)) {
    return is_free ? AddBlock(3, value, std::make_unique<InPlaneManifold>()) : AddConstant(value);
  }
  const int block = AddBlock(3, value, std::make_unique<ceres::SphereManifold<3>>());
  Feature tie{Feature::Kind::kAxis, pencil.id, "the direction of pencil '" + pencil.id + "'"};
  tie.dof = is_free ? 1 : 2;
  tie.observation = FindPencil(obs_, pencil.id);
  const int feature = AddFeature(tie);
  AddTerm(std::unique_ptr<ceres::CostFunction>(
              is_free ? NewInPlanePrior(Eigen::Vector3d::UnitZ(), sigma)
                      : NewDirectionPrior(axis, sigma)),
          {block}, feature);
  p_.terms_.back().loss = std::make_unique<LongTails>();
  return block;
}

void JointProblemBuilder::AddPencil(std::size_t index) {
  const PencilObservation& pencil = obs_.pencils[index];
  const bool is_free = pencil.direction == PencilDirection::kFree;
  // Outside the plane, or a single line: it fixes its own direction, no more.
  if (is_free && (pencil.plane != obs_.frame.plane || !pencil.fit)) return;
  p_.x_is_fixed_ = p_.x_is_fixed_ || pencil.direction == PencilDirection::kX ||
                   pencil.direction == PencilDirection::kY;
  int direction = -1;
  for (std::size_t j = 0; j < pencil.lines.size(); ++j) {
    const LineObservation& line = pencil.lines[j];
    if (!line.fit) continue;
    Feature feature{Feature::Kind::kLine, pencil.id + "[" + std::to_string(j) + "]",
                    "pencil '" + pencil.id + "', line " + std::to_string(j)};
    feature.observation = static_cast<int>(index);
    feature.line = static_cast<int>(j);
    const double own = LineSigma(pencil, line);
    const double stated = own > 0.0 ? own : p_.options_.line_loss.scale_px;
    const double sigma = stated > 0.0 ? stated : noise_.lines[index][j];
    const int axis = AxisOfLine(index, j);
    if (axis >= 0) {
      AddAxisLine(line, sigma, axis, feature.id, feature.name);
      continue;
    }
    std::optional<ImagePoints> points = Points(line.points, line.inliers, sigma, false);
    if (!points) continue;
    if (direction < 0) {
      direction = DirectionBlock(pencil);
      p_.pencils_.push_back({static_cast<int>(index), direction});
    }
    AddLine(std::move(*points), line.fit->line, direction, model_.line_direction_rad, feature);
  }
  if (direction >= 0) directions_[pencil.id] = direction;
}

void JointProblemBuilder::AddLine(ImagePoints points, const Eigen::Vector3d& fit, int direction,
                                  double direction_sigma, Feature feature) {
  feature.free_twice_cost = FreeCost(points, fit);
  DirectionLineCost::Options options;
  options.direction_sigma = direction_sigma;
  options.camera = has_camera_;
  const int f = AddFeature(std::move(feature)), group = p_.num_groups_++;
  const int own = AddBlock(direction_sigma > 0.0 ? 2 : 1, {0.0, 0.0}, {}, false, group);
  const int term =
      AddFeatureTerm(std::make_unique<DirectionLineCost>(std::move(points), fit, options),
                     {JointProblem::kRotation, direction, own}, f, group);
  p_.lines_.push_back({term, own, f});
}

// A line through the observed origin, along X or Y.
void JointProblemBuilder::AddAxisLine(const LineObservation& line, double sigma_px, int axis,
                                      const std::string& id, const std::string& name) {
  std::optional<ImagePoints> points = Points(line.points, line.inliers, sigma_px, false);
  if (!points) return;
  p_.x_is_fixed_ = true;
  Feature feature{Feature::Kind::kPlaneLine, id, name};
  feature.dof = 2;
  feature.free_twice_cost = FreeCost(*points, line.fit->line);
  const int f = AddFeature(feature), angle = AddConstant({axis * kHalfPi});
  AddFeatureTerm(std::make_unique<PlaneLineCost>(std::move(*points), has_camera_),
                 {JointProblem::kRotation, JointProblem::kTranslation, origin_point_, angle}, f,
                 -1);
}

// An axis drawn apart from the pencils is a line of its own: through the origin where that is
// observed, else just along X or Y.
void JointProblemBuilder::AddDrawnAxis(const std::optional<Segment>& axis, int which) {
  int pencil, index;
  if (!axis || FindAxisLine(obs_, *axis, &pencil, &index)) return;
  LineObservation line;
  line.points = {(*axis)[0], (*axis)[1]};
  const std::string id = which == 0 ? "frame.x_axis" : "frame.y_axis",
                    name = which == 0 ? "the X axis" : "the Y axis";
  std::optional<ImagePoints> points = Points(line.points, {}, DrawnSigma(), false);
  LineFit fit;
  if (!points || !FitLine(points->points(), 1.0, &fit).ok()) return;
  line.fit = fit;
  if (p_.origin_observed_) {
    AddAxisLine(line, DrawnSigma(), which, id, name);
    return;
  }
  p_.x_is_fixed_ = true;
  const Eigen::Vector3d direction = Eigen::Vector3d::Unit(which);
  const int along = AddConstant({direction.x(), direction.y(), direction.z()});
  p_.pencils_.push_back({-1, along});
  AddLine(std::move(*points), fit.line, along, 0.0, {Feature::Kind::kLine, id, name});
}

// --- What is known ---

void JointProblemBuilder::AddAngle(std::size_t index) {
  const KnownAngle& known = obs_.known_angles[index];
  const std::string name =
      "the known angle between '" + known.pencils[0] + "' and '" + known.pencils[1] + "'";
  int blocks[2];
  for (std::size_t k = 0; k < 2; ++k) {
    const auto direction = directions_.find(known.pencils[k]);
    if (direction == directions_.end()) {
      p_.unused_.push_back(name + ": not used, '" + known.pencils[k] +
                           "' is no pencil of the world's plane");
      return;
    }
    blocks[k] = direction->second;
  }
  if (p_.blocks_[static_cast<std::size_t>(blocks[0])].is_constant &&
      p_.blocks_[static_cast<std::size_t>(blocks[1])].is_constant) {
    p_.unused_.push_back(name + ": not used, both run along axes, which are orthogonal");
    return;
  }
  AddTerm(std::unique_ptr<ceres::CostFunction>(
              NewAngleCost(known.value, std::max(known.sigma, kExactAngle))),
          {blocks[0], blocks[1]});
}

void JointProblemBuilder::AddLength(std::size_t index) {
  const KnownLength& known = obs_.known_lengths[index];
  if (!IsInWorldPlane(known, obs_)) {
    p_.unused_.push_back("a known length of the plane '" + known.plane +
                         "': not used, the world's is '" + obs_.frame.plane + "'");
    return;
  }
  CalibratedPoint unused;
  if (!PixelToCalibrated(obs_.camera, known.points[0], &unused) ||
      !PixelToCalibrated(obs_.camera, known.points[1], &unused)) {
    p_.unused_.push_back("a known length: not used, the camera model cannot undistort its ends");
    return;
  }
  Feature feature{Feature::Kind::kLength, "length[" + std::to_string(index) + "]",
                  "an end of a known length"};
  feature.observation = static_cast<int>(index);
  const int f = AddFeature(feature), group = p_.num_groups_++;
  const int a = AddBlock(2, {0.0, 0.0}, {}, false, group),
            b = AddBlock(2, {0.0, 0.0}, {}, false, group);
  AddPoint(known.points[0], DrawnSigma(), a, f, group);
  AddPoint(known.points[1], DrawnSigma(), b, f, group);
  const double sigma = known.sigma > 0.0 ? known.sigma : model_.length;
  AddTerm(std::unique_ptr<ceres::CostFunction>(
              NewLengthCost(known.value, std::max(sigma, kExactLength))),
          {a, b}, f, group);
  p_.lengths_.push_back({a, b, f, known.value});
  is_metric_ = true;
}

void JointProblemBuilder::AddTranslation() {
  Block& t = p_.blocks_[JointProblem::kTranslation];
  const bool has_origin = p_.origin_observed_ || p_.center_at_origin_ >= 0;
  if (is_metric_ && has_origin) return;
  if (!is_metric_ && !has_origin) {
    t.is_constant = true;
    return;
  }
  std::unique_ptr<ceres::Manifold> manifold;
  if (is_metric_) {
    manifold = std::make_unique<ScaleManifold>();
  } else {
    manifold = std::make_unique<ceres::SphereManifold<3>>();
  }
  t.manifold = p_.manifolds_.emplace_back(std::move(manifold)).get();
}

void JointProblemBuilder::AddPriors() {
  p_.x_is_seen_ = p_.x_is_fixed_;
  if (p_.options_.pose_prior) {
    const PosePrior& prior = *p_.options_.pose_prior;
    Matrix6d covariance = Eigen::Map<const Matrix6d>(prior.covariance.data());
    Eigen::Vector3d mean = prior.mean.translation;
    constexpr double kUnknown = 1e6;  // Standard deviation that says nothing.
    if (!is_metric_ || !p_.origin_observed_) {
      // A direction only, or nothing.
      const double norm = mean.norm();
      mean /= norm;
      covariance.bottomRightCorner<3, 3>() /= norm * norm;
      covariance.topRightCorner<3, 3>() /= norm;
      covariance.bottomLeftCorner<3, 3>() /= norm;
      const Eigen::Matrix3d more = p_.origin_observed_ ? Eigen::Matrix3d(mean * mean.transpose())
                                                       : Eigen::Matrix3d::Identity();
      covariance.bottomRightCorner<3, 3>() += kUnknown * kUnknown * more;
    }
    if (ceres::CostFunction* cost = NewPosePrior(prior.mean.rotation, mean, covariance)) {
      p_.pose_priors_.push_back(AddTerm(std::unique_ptr<ceres::CostFunction>(cost),
                                        {JointProblem::kRotation, JointProblem::kTranslation}));
      p_.x_is_fixed_ = true;
    }
  }
  if (p_.options_.gravity_prior) {
    const GravityPrior& prior = *p_.options_.gravity_prior;
    p_.pose_priors_.push_back(AddTerm(std::unique_ptr<ceres::CostFunction>(NewDirectionMeasurement(
                                          prior.in_world, prior.in_camera, prior.sigma_rad)),
                                      {JointProblem::kRotation}));
    constexpr double kAlongNormal = 1e-3;  // Then it does not tell the spin about it.
    p_.x_is_fixed_ = p_.x_is_fixed_ || prior.in_world.head<2>().norm() > kAlongNormal;
  }
}

JointProblem::JointProblem(const Observations& observations, const EstimationOptions& options,
                           const PointNoise& noise)
    : observations_(observations),
      options_(options),
      camera_sigma_(options.camera_sigma.value_or(options.noise_model.camera)) {
  JointProblemBuilder(noise, this).Build();
}

std::vector<std::uint8_t> JointProblem::FirstReading() const {
  std::vector<std::uint8_t> reading(features_.size(), 1);
  for (std::size_t i = 0; i < features_.size(); ++i) {
    const Feature& f = features_[i];
    if (f.kind != Feature::Kind::kLine || f.line < 0) continue;
    reading[i] = observations_.pencils[static_cast<std::size_t>(f.observation)]
                         .lines[static_cast<std::size_t>(f.line)]
                         .is_parallel
                     ? 1
                     : 0;
  }
  return reading;
}

bool JointProblem::IsActive(const Term& term, const State& state) const {
  for (int f = term.feature; f >= 0; f = features_[static_cast<std::size_t>(f)].parent) {
    if (state.active[static_cast<std::size_t>(f)] == 0) return false;
  }
  return true;
}

void JointProblem::Parameters(const Term& term, const State& state, const double** out) const {
  for (std::size_t k = 0; k < term.blocks.size(); ++k)
    out[k] = state.x.data() + blocks_[static_cast<std::size_t>(term.blocks[k])].offset;
}

bool JointProblem::IsMetric(const State& state) const {
  const auto is_active = [&](int f) { return state.active[static_cast<std::size_t>(f)] != 0; };
  return std::any_of(
             circles_.begin(), circles_.end(),
             [&](const CircleBlocks& c) {
               return is_active(c.feature) &&
                      observations_.circles[static_cast<std::size_t>(c.observation)].radius > 0.0;
             }) ||
         std::any_of(lengths_.begin(), lengths_.end(),
                     [&](const LengthBlocks& l) { return is_active(l.feature); });
}

bool JointProblem::OriginIsPlaced(const State& state) const {
  if (center_at_origin_ < 0) return origin_observed_;
  const int block = circles_[static_cast<std::size_t>(center_at_origin_)].center;
  return observations_.frame.origin ||
         std::any_of(circles_.begin(), circles_.end(), [&](const CircleBlocks& c) {
           return c.center == block && state.active[static_cast<std::size_t>(c.feature)] != 0;
         });
}

double JointProblem::TwiceCost(const Term& term, const State& state,
                               const Weighing& weighing) const {
  constexpr int kMaxResiduals = CurveModel::kMaxSize + 6;
  double residuals[kMaxResiduals];
  const double* parameters[8];
  Parameters(term, state, parameters);
  const bool evaluated = term.weighed != nullptr
                             ? term.weighed->EvaluateWith(weighing, parameters, residuals, nullptr)
                             : term.cost->Evaluate(parameters, residuals, nullptr);
  if (!evaluated) return std::numeric_limits<double>::infinity();
  double rho[3] = {0.0, 0.0, 0.0};
  for (int i = 0; i < term.cost->num_residuals(); ++i) rho[0] += residuals[i] * residuals[i];
  if (term.loss != nullptr) term.loss->Evaluate(rho[0], rho);
  return rho[0];
}

double JointProblem::Cost(const State& state, const Weighing& weighing) const {
  double cost = 0.0;
  for (const Term& term : terms_) {
    if (IsActive(term, state)) cost += 0.5 * TwiceCost(term, state, weighing);
  }
  return std::isfinite(cost) ? cost : std::numeric_limits<double>::infinity();
}

CameraPose JointProblem::PoseAt(const State& state) const {
  CameraPose pose;
  pose.rotation = RotationFromBlock(state.x.data() + blocks_[kRotation].offset);
  pose.translation =
      Eigen::Map<const Eigen::Vector3d>(state.x.data() + blocks_[kTranslation].offset);
  return pose;
}

}  // namespace circline
