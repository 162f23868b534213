// The blocks and terms of many photos.
#include "circline/refine/many/adjust_problem.h"

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "circline/refine/evidence_points.h"
#include "circline/refine/manifolds.h"
#include "circline/refine/mostly_exact.h"

namespace circline {

EstimationOptions PoseOptions(const AdjustOptions& options) {
  EstimationOptions pose;
  pose.conic_loss = options.conic_loss;
  pose.line_loss = options.line_loss;
  pose.noise_model = options.noise_model;
  // In the pose's covariance only: the camera is not what the photo says of it.
  pose.camera_sigma = CameraSigma::Exact();
  return pose;
}

namespace {

// The block of this key; -1 until there is one.
template <typename Key>
int& OneOf(const Key& key, std::map<Key, int>* blocks) {
  return blocks->emplace(key, -1).first->second;
}

}  // namespace

AdjustProblem::AdjustProblem(const std::vector<AdjustInput>& photos,
                             const std::vector<Layout>& layouts,
                             const std::vector<SquareLattice>& lattices,
                             std::vector<CameraPrior> priors, const AdjustOptions& options,
                             const GivenFrame* given)
    : photos_(photos),
      layouts_(layouts),
      priors_(std::move(priors)),
      options_(options),
      pose_options_(PoseOptions(options)) {
  rotations_.assign(photos.size(), -1);
  translations_.assign(photos.size(), -1);
  AddCameras();
  for (std::size_t i = 0; i < photos.size(); ++i) {
    if (photos[i].takes_part) AddPhoto(i);
  }
  AddKnownRadii();
  for (std::size_t world = 0; world < lattices.size(); ++world) AddLattice(world, lattices[world]);
  SetGauge();
  if (given != nullptr) AddGivenPoses(*given);
}

void AdjustProblem::AddFeature(std::size_t photo, const std::string& id,
                               std::unique_ptr<FeatureCost> cost, std::vector<int> blocks) {
  const bool active = photos_[photo].left_out.count(id) == 0;
  const int term = AddTerm(cost.release(), std::move(blocks), static_cast<int>(features_.size()));
  features_.push_back({photo, id, term, active});
}

// Of the last camera. Most lenses are centred, some of cheap cameras are far from it.
void AdjustProblem::AddCameraPrior(const CameraPrior& prior) {
  // Of eight calibrated cameras three have p1 or p2 of 0.002 or more, one 0.01. Chosen between 0.5
  // and 0.7, 6 and 10 on that one (robot10x10); the others' answers are the same with all.
  constexpr double kCentred = 0.7, kWider = 10.0;
  std::vector<double> sigma(prior.sigma.begin(), prior.sigma.end());
  const std::vector<double> mean(prior.mean.begin(), prior.mean.end());
  for (int shift = 0; shift < kCameraSize; ++shift) {
    const auto k = static_cast<std::size_t>(shift);
    if (!IsTangential(prior.model, shift) || !(sigma[k] > 0.0)) continue;
    std::vector<double> one(sigma.size(), 0.0);
    std::swap(one[k], sigma[k]);
    one[k] *= kWider;
    const int term = AddTerm(NewGaussianPrior(one, mean), {cameras_.back()}, -1,
                             std::make_unique<TwoGaussians>(kCentred, 1.0 / kWider, 1.0));
    this->term(term).is_mostly_exact = false;
  }
  AddTerm(NewGaussianPrior(sigma, mean), {cameras_.back()});
}

void AdjustProblem::AddCameras() {
  for (const CameraPrior& prior : priors_) {
    auto manifold = ShiftManifold(prior.sigma);
    const bool is_held = manifold == nullptr;
    cameras_.push_back(AddBlock(kCameraSize, {}, std::move(manifold), is_held));
    AddCameraPrior(prior);
    for (int k = 4; k < kCameraSize; ++k) {
      if (prior.sigma[static_cast<std::size_t>(k)] > 0.0)
        num_distortion_ = std::max(num_distortion_, k - 3);
    }
  }
}

int AdjustProblem::AddRotation(const Eigen::Matrix3d& rotation) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(rotation).normalized();
  return AddBlock(4, {q.x(), q.y(), q.z(), q.w()}, std::make_unique<WorldRotationManifold<3>>());
}

void AdjustProblem::AddGivenPoses(const GivenFrame& given) {
  const Eigen::Vector3d& t = given.translation;
  given_ = {AddRotation(given.rotation), AddBlock(3, {t.x(), t.y(), t.z()}),
            AddBlock(1, {std::log(given.scale)})};
  for (std::size_t i = 0; i < photos_.size(); ++i) {
    if (rotations_[i] < 0 || photos_[i].given == nullptr) continue;
    const double distance = photos_[i].pose.translation.norm();
    AddTerm(NewGivenPosePrior(photos_[i].given->rotation, photos_[i].given->translation,
                              options_.given_rotation_sigma,
                              options_.given_translation_sigma * distance),
            {rotations_[i], translations_[i], given_[0], given_[1], given_[2]});
  }
}

void AdjustProblem::AddPhoto(std::size_t photo) {
  const AdjustInput& input = photos_[photo];
  const Eigen::Vector3d& t = input.pose.translation;
  rotations_[photo] = AddRotation(input.pose.rotation);
  translations_[photo] = AddBlock(3, {t.x(), t.y(), t.z()});
  const Observations& obs = *input.observations;
  for (const CircleObservation& circle : obs.circles) {
    if (circle.fit && circle.plane == obs.frame.plane) AddCircle(photo, circle);
  }
  for (std::size_t k = 0; k < obs.pencils.size(); ++k) AddPencil(photo, k);
}

// Where a world lies, how large it is and how it is turned about its normal is nobody's to say: the
// first photo's translation is held, but for its length where a length is known, and its spin,
// unless a pencil fixes that.
void AdjustProblem::SetGauge() {
  std::set<int> observed;  // Translations.
  for (const Feature& feature : features_) {
    if (feature.active) observed.insert(term(feature.term).blocks[1]);
  }
  std::set<std::size_t> done;  // Worlds.
  for (std::size_t i = 0; i < photos_.size(); ++i) {
    const std::size_t world = photos_[i].world;
    if (rotations_[i] < 0 || photos_[i].grid != nullptr) continue;  // A grid says all.
    if (observed.count(translations_[i]) == 0) {
      block(translations_[i]).is_constant = true;  // Nothing speaks of it.
      continue;
    }
    if (!done.insert(world).second) continue;
    if (has_scale_[world]) {
      SetManifold(translations_[i], std::make_unique<ScaleManifold>());
    } else {
      block(translations_[i]).is_constant = true;
    }
    if (!x_is_fixed_[world])
      SetManifold(rotations_[i], std::make_unique<WorldRotationManifold<2>>());
  }
}

// Stated again, in another photo or of another circle of its group, it is the same statement, as
// well known as where it is known best (ResolveWorld).
void AdjustProblem::StateRadius(std::size_t world, const CircleObservation& circle, int radius) {
  if (!(circle.radius > 0.0)) return;
  const double sigma =
      circle.radius_sigma > 0.0 ? circle.radius_sigma : options_.noise_model.radius;
  KnownRadius& known = known_radii_.insert({radius, {circle.radius, sigma, false}}).first->second;
  const bool is_better = circle.radius_sigma > 0.0 && (!known.is_stated || sigma < known.sigma);
  if (is_better) known = {circle.radius, sigma, true};
  has_scale_[world] = metric_ = true;
}

void AdjustProblem::AddKnownRadii() {
  for (const auto& [radius, known] : known_radii_) {
    *Values(radius) = known.radius;
    if (known.sigma > 0.0) AddTerm(NewLogPrior(known.radius, known.sigma), {radius});
    block(radius).is_constant = !(known.sigma > 0.0);
  }
}

AdjustProblem::Circle* AdjustProblem::CircleOf(std::size_t photo, const CircleObservation& circle) {
  const AdjustInput& input = photos_[photo];
  const std::size_t world = input.world;
  const std::string& id = input.NameOf(circle.id);
  const auto known = circles_.find({world, id});
  if (known != circles_.end()) {
    StateRadius(world, circle, known->second.radius);
    return &known->second;
  }
  const Layout& layout = layouts_[world];
  const auto start = layout.find(id);
  if (start == layout.end()) return nullptr;
  const NoiseModel& model = options_.noise_model;
  // Where circles were matched by how they lie, ids of groups are a photo's own.
  const std::string own = input.names.empty() ? "" : std::to_string(photo) + ":";
  Circle made;
  int& center =
      circle.concentric.empty() ? made.center : OneOf({world, own + circle.concentric}, &centers_);
  const Eigen::Vector2d& at = start->second.center;
  if (center < 0) center = AddBlock(2, {at.x(), at.y()});
  made.center = center;
  int& radius = circle.radius_group.empty()
                    ? made.radius
                    : OneOf({world, own + circle.radius_group}, &radius_groups_);
  if (radius < 0) radius = AddBlock(1, {start->second.radius});
  made.radius = radius;
  StateRadius(world, circle, radius);
  const std::array<double, 3> tilt_sigmas = TiltSigmas(model);
  if (tilt_sigmas[0] > 0.0) made.tilt = AddDeviation({tilt_sigmas.begin(), tilt_sigmas.end()});
  if (model.circle_shape > 0.0)
    made.shape = AddShape(model.circle_shape * circle.fit->irregularity);
  return &(circles_[{world, id}] = made);
}

// Contours of one contrast share an offset, in each photo its own.
int AdjustProblem::OffsetOf(std::size_t photo, const CircleObservation& circle) {
  const double sigma = options_.noise_model.contour_offset_px;
  if (!(sigma > 0.0)) return -1;
  int& offset = OneOf({photo, std::clamp(circle.contrast, -1, 1)}, &offsets_);
  if (offset < 0) offset = AddDeviation({sigma}, -1, std::make_unique<MostlyExact>());
  return offset;
}

void AdjustProblem::AddCircle(std::size_t photo, const CircleObservation& circle) {
  const AdjustInput& input = photos_[photo];
  ImagePoints points;
  if (!FillEvidencePoints(input.observations->camera, circle.points, circle.inliers,
                          circle.sigma_px, true, pose_options_, num_distortion_, &points))
    return;
  Circle* made = CircleOf(photo, circle);
  if (made == nullptr) return;
  const double center_sigma = ContourSigma(points);
  const double on_sheet = input.pose.translation.norm() / input.observations->camera.fx;
  made->told =
      std::min(made->told, on_sheet * center_sigma / std::sqrt(static_cast<double>(points.size())));
  const int rotation = rotations_[photo], translation = translations_[photo],
            offset = OffsetOf(photo, circle), camera = cameras_[input.camera];
  const PlaneCircleContourCost::Blocks with = {made->tilt >= 0, made->shape >= 0, offset >= 0,
                                               true};
  AddFeature(
      photo, circle.id, std::make_unique<PlaneCircleContourCost>(std::move(points), with),
      {rotation, translation, made->center, made->radius, made->tilt, made->shape, offset, camera});
  if (!circle.center) return;
  AddFeature(photo, circle.id + ".center",
             std::make_unique<PlanePointCost>(input.observations->camera, *circle.center,
                                              center_sigma, options_.line_loss.type, true),
             {rotation, translation, made->center, camera});
}

// Where a world has its pencils: along an axis, or in the plane.
int AdjustProblem::DirectionOf(std::size_t photo, const PencilObservation& pencil) {
  constexpr double kAlong = 0.98;  // Cosine: it is that axis, not one turned against it.
  const AdjustInput& input = photos_[photo];
  const auto named = input.pencil_names.find(pencil.id);
  const bool is_own =
      named == input.pencil_names.end() && (!input.names.empty() || input.given != nullptr);
  std::string id = is_own ? std::to_string(photo) + ":" + pencil.id : pencil.id;
  if (named != input.pencil_names.end()) id = named->second;
  Direction& made = directions_[{input.world, id}];
  if (made.block >= 0) return made.block;
  made.photo = static_cast<int>(is_own ? photo + 1 : input.world) - 1;
  const double sigma = std::max(options_.noise_model.pencil_axis_rad, 1e-6);
  Eigen::Vector3d d = input.pose.rotation.transpose() * pencil.fit->direction;
  const bool is_free = pencil.direction == PencilDirection::kFree;
  const Eigen::Vector3d axis = is_free ? Eigen::Vector3d::UnitZ()
                                       : Eigen::Vector3d::Unit(static_cast<int>(pencil.direction));
  const bool is_along = !is_free && std::abs(d.dot(axis)) > kAlong;
  if (is_along) d = axis;
  made.block = AddBlock(3, {d.x(), d.y(), d.z()}, std::make_unique<ceres::SphereManifold<3>>());
  if (is_along) {
    AddTerm(NewDirectionPrior(axis, sigma), {made.block}, -1, std::make_unique<MostlyExact>());
    x_is_fixed_[input.world] = x_is_fixed_[input.world] || pencil.direction != PencilDirection::kZ;
  } else if (pencil.direction != PencilDirection::kZ) {
    AddTerm(NewInPlanePrior(Eigen::Vector3d::UnitZ(), sigma), {made.block}, -1,
            std::make_unique<MostlyExact>());
  }
  return made.block;
}

void AdjustProblem::AddPencil(std::size_t photo, std::size_t index) {
  const AdjustInput& input = photos_[photo];
  const PencilObservation& pencil = input.observations->pencils[index];
  const bool is_free = pencil.direction == PencilDirection::kFree;
  if (!pencil.fit || (is_free && pencil.plane != input.observations->frame.plane)) return;
  const int rotation = rotations_[photo], direction = DirectionOf(photo, pencil),
            camera = cameras_[input.camera];
  for (std::size_t j = 0; j < pencil.lines.size(); ++j) {
    const LineObservation& line = pencil.lines[j];
    if (!line.fit || !line.is_parallel) continue;
    ImagePoints points;
    if (!FillEvidencePoints(input.observations->camera, line.points, line.inliers,
                            LineSigma(pencil, line), false, pose_options_, num_distortion_,
                            &points))
      continue;
    const double deviation = options_.noise_model.line_direction_rad;
    auto cost = std::make_unique<DirectionLineCost>(std::move(points), line.fit->line,
                                                    DirectionLineCost::Options{deviation, true});
    const int place = AddBlock(deviation > 0.0 ? 2 : 1, {});
    const double* at[] = {Values(rotation), Values(direction), Values(place), Values(camera)};
    if (!cost->Start(at, Values(place))) continue;
    const std::vector<int> on_plane = {rotation, translations_[photo], direction, place};
    const int on_grid = input.grid != nullptr ? AddGridPlace(photo, index, j, *cost, on_plane) : -1;
    AddFeature(photo, pencil.id + "[" + std::to_string(j) + "]", std::move(cost),
               {rotation, direction, place, camera});
    features_.back().grid_term = on_grid;
  }
}

}  // namespace circline
