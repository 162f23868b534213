#include "circline/refine/joint/joint_builder.h"

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "circline/refine/evidence_points.h"
#include "circline/refine/manifolds.h"
#include "circline/refine/mostly_exact.h"

namespace circline {
namespace {

// Features of a kind, the first few by name.
std::string Names(const char* kind, const std::vector<std::string>& ids) {
  constexpr std::size_t kMost = 3;
  std::string names = ids.size() == 1 ? kind : std::string(kind) + "s";
  for (std::size_t i = 0; i < std::min(kMost, ids.size()); ++i)
    names += (i == 0 ? " '" : ", '") + ids[i] + "'";
  if (ids.size() > kMost) names += " and " + std::to_string(ids.size() - kMost) + " more";
  return names;
}

}  // namespace

int JointProblemBuilder::AddFeature(Feature feature) {
  p_.features_.push_back(std::move(feature));
  return static_cast<int>(p_.features_.size()) - 1;
}

bool JointProblemBuilder::Points(const std::vector<Eigen::Vector2d>& pixels,
                                 const std::vector<std::uint8_t>& inliers, double sigma_px,
                                 bool is_circle, ImagePoints* points) const {
  return FillEvidencePoints(obs_.camera, pixels, inliers, sigma_px, is_circle, p_.options_,
                            p_.camera_sigma_.k1 > 0.0 ? 1 : 0, points);
}

void JointProblemBuilder::Build() {
  const Shifts sigmas = ShiftSigmas(obs_.camera, p_.camera_sigma_);
  std::unique_ptr<ceres::Manifold> manifold = ShiftManifold(sigmas);
  if (manifold != nullptr) camera_ = JointProblem::kCamera;
  p_.camera_is_estimated_ = p_.camera_sigma_.IsEstimated();

  p_.AddBlock(4, {0.0, 0.0, 0.0, 1.0});
  p_.AddBlock(3, {0.0, 0.0, 1.0});
  p_.AddBlock(kCameraSize, {}, std::move(manifold), !p_.camera_is_estimated_);
  if (p_.camera_is_estimated_) AddCameraPrior({sigmas.begin(), sigmas.end()});
  AddOrigin();
  for (const CircleObservation& circle : obs_.circles)
    num_circles_[ContrastOf(circle)] += InPlane(circle) ? 1 : 0;
  for (std::size_t i = 0; i < obs_.circles.size(); ++i) AddCircle(i);
  p_.directions_.assign(obs_.pencils.size(), -1);
  for (std::size_t i = 0; i < obs_.pencils.size(); ++i) AddPencil(i);
  AddDrawnAxis(obs_.frame.x_axis, 0);
  AddDrawnAxis(obs_.frame.y_axis, 1);
  for (std::size_t i = 0; i < obs_.known_angles.size(); ++i) AddAngle(i);
  for (std::size_t i = 0; i < obs_.known_lengths.size(); ++i) AddLength(i);
  AddTranslation();
  p_.x_is_seen_ = p_.x_is_fixed_;
  if (p_.options_.pose_prior) AddPosePrior(*p_.options_.pose_prior);
  if (p_.options_.gravity_prior) AddGravityPrior(*p_.options_.gravity_prior);
  NoteWhatIsOutside();
  if (p_.x_is_fixed_) {
    p_.SetManifold(JointProblem::kRotation, std::make_unique<WorldRotationManifold<3>>());
  } else {
    p_.SetManifold(JointProblem::kRotation, std::make_unique<WorldRotationManifold<2>>());
  }
}

// Of the shifts of the camera, but that the focal length may be doubtful.
void JointProblemBuilder::AddCameraPrior(std::vector<double> sigmas) {
  std::vector<double> mean(kCameraSize, 0.0);
  mean[0] = StatedLogFocal(obs_);
  mean[4] = -obs_.found_k1;
  const double narrow = sigmas[0], wide = p_.camera_sigma_.doubtful_log_focal;
  if (wide > narrow) {
    std::vector<double> focal(kCameraSize, 0.0);
    focal[0] = wide;
    sigmas[0] = 0.0;
    const int term =
        p_.AddTerm(NewGaussianPrior(focal, mean), {JointProblem::kCamera}, -1,
                   std::make_unique<TwoGaussians>(1.0 - kDoubtfulShare, narrow / wide, 1.0));
    p_.term(term).is_mostly_exact = false;
  }
  p_.AddTerm(NewGaussianPrior(sigmas, mean), {JointProblem::kCamera});
}

// A circle says nothing of a plane that it does not name; nor does a pencil of another one.
void JointProblemBuilder::NoteWhatIsOutside() {
  const std::string& plane = obs_.frame.plane;
  bool is_named = false;
  std::vector<std::string> circles, pencils;
  for (const CircleObservation& circle : obs_.circles) {
    is_named = is_named || circle.plane == plane;
    if (circle.fit && circle.plane != plane) circles.push_back(circle.id);
  }
  for (const PencilObservation& pencil : obs_.pencils) {
    is_named = is_named || pencil.plane == plane;
    const bool is_elsewhere = !pencil.plane.empty() && pencil.plane != plane;
    if (is_elsewhere && !RunsAlongAxis(pencil)) pencils.push_back(pencil.id);
  }
  const std::string why = ": not used, not in the world's plane '" + plane + "'" +
                          (is_named ? "" : ", which no circle or pencil names");
  if (!circles.empty()) p_.unused_.push_back(Names("circle", circles) + why);
  if (!pencils.empty()) p_.unused_.push_back(Names("pencil", pencils) + why);
}

void JointProblemBuilder::AddAngle(std::size_t index) {
  const KnownAngle& known = obs_.known_angles[index];
  const std::string name =
      "the known angle between '" + known.pencils[0] + "' and '" + known.pencils[1] + "'";
  int blocks[2];
  double told = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 2; ++k) {
    const auto pencil = static_cast<std::size_t>(FindPencil(obs_, known.pencils[k]));
    blocks[k] = p_.directions_[pencil];
    if (blocks[k] < 0) {
      p_.unused_.push_back(name + ": not used, '" + known.pencils[k] +
                           "' is no pencil of the world's plane");
      return;
    }
    if (obs_.pencils[pencil].fit)
      told = std::min(told, LeastSigma(obs_.pencils[pencil].fit->covariance));
  }
  if (p_.block(blocks[0]).is_constant && p_.block(blocks[1]).is_constant) {
    p_.unused_.push_back(name + ": not used, both run along axes, which are orthogonal");
    return;
  }
  const double sigma = std::max(known.sigma, kExactShare * told);
  Feature feature{Feature::Kind::kAngle, "angle[" + std::to_string(index) + "]", name};
  feature.covariance = sigma * sigma * Eigen::Matrix3d::Identity();
  p_.AddTerm(NewAngleCost(known.value, sigma), {blocks[0], blocks[1]}, AddFeature(feature));
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
  const int f = AddFeature(feature), a = p_.AddBlock(2, {}), b = p_.AddBlock(2, {});
  AddPoint(known.points[0], DrawnSigma(), a, f);
  AddPoint(known.points[1], DrawnSigma(), b, f);
  const double sigma = known.sigma > 0.0 ? known.sigma : model_.length;
  const double told = DrawnSigma() / (known.points[0] - known.points[1]).norm();
  p_.AddTerm(NewLengthCost(known.value, std::max(sigma, kExactShare * told)), {a, b}, f);
  p_.lengths_.push_back({a, b, f});
  is_metric_ = true;
}

void JointProblemBuilder::AddTranslation() {
  const bool has_origin = p_.origin_observed_ || p_.center_at_origin_ >= 0;
  if (is_metric_ && has_origin) return;
  if (is_metric_) {
    p_.SetManifold(JointProblem::kTranslation, std::make_unique<ScaleManifold>());
  } else if (has_origin) {
    p_.SetManifold(JointProblem::kTranslation, std::make_unique<ceres::SphereManifold<3>>());
  } else {
    p_.block(JointProblem::kTranslation).is_constant = true;
  }
}

// What is known of the pose is evidence, which may contradict the photo: a feature to leave out.
void JointProblemBuilder::AddPrior(ceres::CostFunction* cost, std::vector<int> blocks,
                                   bool tells_spin, Feature feature) {
  const int term = p_.AddTerm(cost, std::move(blocks), AddFeature(std::move(feature)));
  p_.pose_priors_.push_back({term, tells_spin});
  p_.x_is_fixed_ = p_.x_is_fixed_ || tells_spin;
}

void JointProblemBuilder::AddPosePrior(const PosePrior& prior) {
  Matrix6d covariance = Eigen::Map<const Matrix6d>(prior.covariance.data());
  Eigen::Vector3d mean = prior.mean.translation;
  Feature feature{Feature::Kind::kPrior, "pose_prior", "the pose known beforehand"};
  feature.dof = 6;
  feature.covariance = covariance.topLeftCorner<3, 3>();
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
    feature.dof = p_.origin_observed_ ? 5 : 3;
  }
  if (ceres::CostFunction* cost = NewPosePrior(prior.mean.rotation, mean, covariance))
    AddPrior(cost, {JointProblem::kRotation, JointProblem::kTranslation}, true, std::move(feature));
}

void JointProblemBuilder::AddGravityPrior(const GravityPrior& prior) {
  constexpr double kAlongNormal = 1e-3;  // Then it does not tell the spin about it.
  Feature feature{Feature::Kind::kPrior, "gravity_prior", "the direction of gravity"};
  feature.dof = 2;
  feature.covariance = prior.sigma_rad * prior.sigma_rad * Eigen::Matrix3d::Identity();
  AddPrior(NewDirectionMeasurement(prior.in_world, prior.in_camera, prior.sigma_rad),
           {JointProblem::kRotation}, prior.in_world.head<2>().norm() > kAlongNormal,
           std::move(feature));
}

JointProblem::JointProblem(const Observations& observations, const EstimationOptions& options)
    : observations_(observations),
      options_(options),
      camera_sigma_(
          options.camera_sigma.value_or(options.noise_model.SigmaOf(observations.camera))) {
  JointProblemBuilder(this).Build();
}

}  // namespace circline
