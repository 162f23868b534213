// Cameras, poses and worlds to start from.
#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "circline/estimators/statistics.h"
#include "circline/refine/joint/known_pose.h"
#include "circline/refine/many/adjustment.h"

namespace circline {
namespace {

// To rounding: a photo's may have been set back to the one given.
bool IsSameCamera(const Camera& a, const Camera& b) {
  constexpr double kRounding = 1e-9;  // Of the focal length; of a distortion coefficient.
  const auto near = [&](double x, double y, double unit) {
    return std::abs(x - y) <= kRounding * unit;
  };
  bool same = a.model == b.model && a.width == b.width && a.height == b.height;
  for (const auto& [x, y] : {std::pair(a.fx, b.fx), {a.fy, b.fy}, {a.cx, b.cx}, {a.cy, b.cy}})
    same = same && near(x, y, a.fx);
  for (std::size_t k = 0; k < a.distortion.size(); ++k)
    same = same && near(a.distortion[k], b.distortion[k], 1.0);
  return same;
}

// A sigma of a camera that no photo has is a slip of its name: the camera meant would count as
// unknown.
Status CheckNames(const std::map<std::string, CameraSigma>& sigmas,
                  const std::map<std::string, std::size_t>& cameras) {
  std::string known;
  for (const auto& [id, index] : cameras) known += (known.empty() ? "'" : ", '") + id + "'";
  for (const auto& [id, sigma] : sigmas) {
    if (cameras.count(id) == 0) {
      return Status::Invalid("camera_sigma: no photo has a camera '" + id + "', only " + known);
    }
  }
  return Status::Ok();
}

// Through a camera that is a little off the most exact contours of one plane contradict each other:
// to start from, none is more exact than this.
Observations LessExact(Observations observations) {
  constexpr double kLeastPx = 0.3;  // Serves simulated noise of 0.02 to 0.4; no photo chose it.
  for (CircleObservation& circle : observations.circles) {
    if (circle.sigma_px > 0.0) circle.sigma_px = std::max(circle.sigma_px, kLeastPx);
  }
  for (PencilObservation& pencil : observations.pencils) {
    if (pencil.sigma_px > 0.0) pencil.sigma_px = std::max(pencil.sigma_px, kLeastPx);
    for (LineObservation& line : pencil.lines) {
      if (line.sigma_px > 0.0) line.sigma_px = std::max(line.sigma_px, kLeastPx);
    }
  }
  return observations;
}

// Nor are right angles right through it: a direction 45 degrees off the middle of the photo turns
// by half of the error of log f. With exact axes, lines that are right would be left out.
EstimationOptions LessExact(EstimationOptions options) {
  constexpr double kLeastAxisRad = 0.04;  // Half of 0.3 / sqrt(12): the step that f is tried with.
  double& axis = options.noise_model.pencil_axis_rad;
  axis = std::max(axis, kLeastAxisRad);
  return options;
}

}  // namespace

// kOpenCV has k1 k2 p1 p2 k3, kFisheye k1 to k4.
Shifts ShiftSigmas(const Camera& camera, const CameraSigma& prior, const AdjustOptions& options) {
  Shifts sigma = ShiftSigmas(camera, prior);
  sigma[4] = 0.0;
  if (camera.model == CameraModel::kPinhole) return sigma;
  const bool opencv = camera.model == CameraModel::kOpenCV;
  const std::array<std::size_t, 4> radial = {4, 5, opencv ? 8U : 6U, 7};
  const int count = std::min(options.num_radial, opencv ? 3 : 4);
  for (int k = 0; k < count; ++k) sigma[radial[static_cast<std::size_t>(k)]] = prior.k1;
  if (opencv && count > 0) sigma[6] = sigma[7] = options.tangential_sigma;
  return sigma;
}

Shifts ShiftsBetween(const Camera& from, const Camera& to) {
  Shifts shifts{};
  shifts[0] = std::log(to.fx / from.fx);
  shifts[1] = std::log(to.fy / from.fy) - shifts[0];
  shifts[2] = to.cx - from.cx;
  shifts[3] = to.cy - from.cy;
  for (std::size_t k = 0; k < to.distortion.size(); ++k)
    shifts[4 + k] = to.distortion[k] - from.distortion[k];
  return shifts;
}

Status Adjustment::FindCameras() {
  if (given_.empty()) return Status::Refused("there is no photo");
  std::map<std::string, std::size_t> index;
  for (std::size_t i = 0; i < given_.size(); ++i) {
    const Camera& camera = given_[i].camera;
    const auto [known, is_new] = index.insert({camera.id, cameras_.size()});
    inputs_[i].camera = known->second;
    if (is_new) {
      const Status status = camera.Validate();
      if (!status.ok()) return status;
      cameras_.push_back(camera);
      const auto stated = options_.camera_sigma.find(camera.id);
      priors_.push_back(stated != options_.camera_sigma.end() ? stated->second
                                                              : UnknownCamera(camera));
    } else if (!IsSameCamera(camera, cameras_[known->second])) {
      return Status::Invalid("photo " + std::to_string(i) + ": its camera '" + camera.id +
                             "' is not the one that an earlier photo has under that id");
    }
    out_.photos[i].camera = static_cast<int>(known->second);
    out_.photos[i].status = given_[i].Validate();
  }
  guesses_ = cameras_;
  // From a start it is the photos of one camera of several.
  const Status status = start_ == nullptr ? CheckNames(options_.camera_sigma, index) : Status::Ok();
  return status.ok() ? CheckGivenPoses() : status;
}

Status Adjustment::CheckGivenPoses() {
  const std::vector<std::optional<CameraPose>>& poses = options_.given_poses;
  if (poses.empty()) return Status::Ok();
  if (poses.size() != given_.size())
    return Status::Invalid("given_poses must be one for each photo, or none");
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!poses[i]) {
      out_.photos[i].status = Status::Refused("no pose is given for it");
      continue;
    }
    if (!IsRotation(poses[i]->rotation) || !poses[i]->translation.allFinite()) {
      return Status::Invalid("given_poses[" + std::to_string(i) +
                             "] must be a rotation and a finite translation");
    }
    inputs_[i].given = &*poses[i];
  }
  return Status::Ok();
}

// Every photo through the cameras as they stand.
void Adjustment::Estimate() {
  std::mutex mutex;
  int done = 0;
  estimates_.assign(given_.size(), {});
  ParallelFor(given_.size(), options_.num_threads, [&](std::size_t i) {
    if (out_.photos[i].status.ok()) {
      prepared_[i] = Prepare(given_[i], cameras_[inputs_[i].camera], PoseOptions(options_));
      inputs_[i].observations = &prepared_[i];
      if (start_ != nullptr) {
        CoarsePose(prepared_[i], PoseOptions(options_), &estimates_[i]);
      } else {
        const EstimationOptions options = PoseOptions(options_);
        const bool is_wide = priors_[inputs_[i].camera].IsWide();
        estimates_[i] = is_wide ? EstimatePose(LessExact(prepared_[i]), LessExact(options))
                                : EstimatePose(prepared_[i], options);
      }
    } else {
      estimates_[i].status = out_.photos[i].status;
    }
    const std::lock_guard<std::mutex> lock(mutex);
    if (options_.progress) options_.progress("poses", ++done, static_cast<int>(given_.size()));
  });
}

// The camera that photos lead to from each candidate, and the best of those.
void Adjustment::FindCamera(std::size_t c) {
  constexpr int kCoarseIterations = 10;
  constexpr double kMostPhotos = 12.0;  // So many tell a start.
  std::vector<const Observations*> members;
  for (std::size_t i = 0; i < given_.size(); ++i) {
    if (inputs_[i].camera == c && out_.photos[i].status.ok()) members.push_back(&given_[i]);
  }
  const double step = std::max(1.0, static_cast<double>(members.size()) / kMostPhotos);
  std::vector<Observations> used;
  for (double i = 0.0; i < static_cast<double>(members.size()); i += step)
    used.push_back(LessExact(*members[static_cast<std::size_t>(i)]));
  EstimationOptions pose = PoseOptions(options_);
  pose.conic_distance = ConicDistanceType::kSampson;  // Cheaper.
  CameraSweep sweep(used, guesses_[c], pose, options_.num_threads);
  // What a fisheye lens bends is in its model.
  const bool has_radial = cameras_[c].model == CameraModel::kOpenCV &&
                          ShiftSigmas(cameras_[c], priors_[c], options_)[4] > 0.0;
  std::vector<Camera> candidates = sweep.Candidates(priors_[c].log_focal, has_radial);
  if (candidates.empty()) return;  // No photo gives a pose at any focal length.
  if (candidates.size() > 1) {
    AdjustOptions coarse = options_;
    coarse.max_iterations = kCoarseIterations;
    coarse.progress = nullptr;
    coarse.given_poses.clear();
    for (Camera& candidate : candidates) {
      Adjustment alone(used, coarse);
      alone.start_ = &candidate;
      const AdjustedPhotos led_to = alone.Run();
      if (led_to.status.ok()) candidate = led_to.cameras.front().camera;
    }
  }
  const std::vector<double> costs = sweep.CostsAt(candidates);
  cameras_[c] = candidates[static_cast<std::size_t>(std::min_element(costs.begin(), costs.end()) -
                                                    costs.begin())];
}

Status Adjustment::Start() {
  if (start_ != nullptr) cameras_.front() = *start_;
  const auto tell = [this](std::size_t found) {
    if (options_.progress)
      options_.progress("cameras", static_cast<int>(found), static_cast<int>(cameras_.size()));
  };
  if (start_ == nullptr) tell(0);
  for (std::size_t c = 0; c < cameras_.size() && start_ == nullptr; ++c) {
    if (priors_[c].IsWide()) FindCamera(c);
    tell(c + 1);
  }
  Estimate();
  const Status status = PlaceWorlds();
  if (status.ok()) ScaleWorlds();
  return status;
}

// What one world states twice it states alike.
Status Adjustment::CheckRadii() const {
  std::map<std::string, double> known;
  for (const AdjustInput& input : inputs_) {
    if (!input.takes_part || input.world != 0 || !input.names.empty()) continue;
    for (const CircleObservation& circle : input.observations->circles) {
      if (!(circle.radius > 0.0)) continue;
      const double radius = known.emplace(circle.id, circle.radius).first->second;
      if (radius != circle.radius)
        return Status::Invalid("circle '" + circle.id + "' has different radii in two photos");
    }
  }
  return Status::Ok();
}

// One world, where the photos' circles lie alike, by their ids or whatever these are; else each its
// own.
Status Adjustment::PlaceWorlds() {
  // Of the units of Place. What matches by its pattern lies farther off where the camera to start
  // from is rough.
  constexpr double kAlikePattern = 0.15, kAlikeById = 0.1;
  constexpr double kMostPhotos = 0.8;  // Of those with a pose.
  int with_pose = 0;
  layouts_.assign(given_.size() + 1, Layout());
  for (std::size_t i = 0; i < given_.size(); ++i) {
    AdjustedPhoto& photo = out_.photos[i];
    photo.status = estimates_[i].status;
    inputs_[i].takes_part = photo.status.ok() && !estimates_[i].hypotheses.empty();
    if (!inputs_[i].takes_part) continue;
    ++with_pose;
    inputs_[i].world = i + 1;
    inputs_[i].pose = estimates_[i].hypotheses.front().cam_from_world;
    layouts_[i + 1] = LayoutOf(estimates_[i].hypotheses.front());
  }
  if (with_pose == 0)
    return Status::Refused("no photo gives a pose: " + estimates_.front().status.message);
  SharedLayout shared;
  if (!options_.given_poses.empty()) {
    given_frame_ = PlaceByGivenPoses(estimates_, options_.given_poses, &shared);
    if (!given_frame_)
      return Status::Refused("no circle is found in two photos where their given poses have it");
    ShareWorld(shared);
    return Status::Ok();
  }
  if (options_.rigid == RigidWorld::kNo) return Status::Ok();
  for (const bool by_id : {true, false}) {
    SharedLayout found = AlignLayouts(estimates_, by_id);
    const auto placed =
        static_cast<int>(std::count(found.placed.begin(), found.placed.end(), true));
    const bool is_alike = placed > 1 && found.misfit < (by_id ? kAlikeById : kAlikePattern) &&
                          placed >= kMostPhotos * with_pose;
    if (is_alike || (by_id && placed > 1 && options_.rigid == RigidWorld::kYes))
      shared = std::move(found);
    if (is_alike) break;
  }
  if (!shared.circles.empty()) {
    ShareWorld(shared);
  } else if (options_.rigid == RigidWorld::kYes) {
    out_.notes.emplace_back("the photos share no circles: each has a world of its own");
  }
  return CheckRadii();
}

// Every world in the unit of the radii that are known in it.
void Adjustment::ScaleWorlds() {
  std::map<std::size_t, std::vector<double>> ratios;
  for (const AdjustInput& input : inputs_) {
    if (!input.takes_part) continue;
    for (const CircleObservation& circle : input.observations->circles) {
      const Layout& layout = layouts_[input.world];
      const auto at = layout.find(input.NameOf(circle.id));
      if (circle.radius > 0.0 && at != layout.end())
        ratios[input.world].push_back(circle.radius / at->second.radius);
    }
  }
  for (auto& [world, own] : ratios) {
    const double scale = Median(std::move(own));
    for (auto& [id, circle] : layouts_[world])
      circle = {scale * circle.center, scale * circle.radius};
    for (AdjustInput& input : inputs_) {
      if (input.takes_part && input.world == world) input.pose.translation *= scale;
    }
    if (world == 0 && given_frame_) given_frame_->scale /= scale;
  }
}

void Adjustment::ShareWorld(const SharedLayout& shared) {
  out_.rigid = true;
  layouts_[0] = shared.circles;
  const bool by_id = shared.IsById();
  for (std::size_t i = 0; i < given_.size(); ++i) {
    AdjustInput& input = inputs_[i];
    if (!input.takes_part) continue;
    if (!shared.placed[i]) {
      input.takes_part = false;
      out_.photos[i].status = Status::Refused(
          "its circles do not lie as those of the other photos, or it has too few of them");
      continue;
    }
    input.world = 0;
    input.pose = shared.poses[i];
    if (!by_id) input.names = shared.names[i];
    input.pencil_names = shared.pencil_names[i];
  }
}

}  // namespace circline
