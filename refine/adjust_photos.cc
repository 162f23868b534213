#include "circline/refine/adjust_photos.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <mutex>
#include <utility>

#include "circline/estimators/point_noise.h"
#include "circline/refine/adjust_problem.h"
#include "circline/refine/adjust_start.h"

namespace circline {

const char* RigidWorldName(RigidWorld rigid) {
  return rigid == RigidWorld::kAuto ? "auto" : rigid == RigidWorld::kYes ? "yes" : "no";
}

bool RigidWorldFromName(const std::string& name, RigidWorld* rigid) {
  for (const RigidWorld known : {RigidWorld::kAuto, RigidWorld::kYes, RigidWorld::kNo}) {
    if (name != RigidWorldName(known)) continue;
    *rigid = known;
    return true;
  }
  return false;
}

Status AdjustOptions::Validate() const {
  EstimationOptions same;
  same.conic_loss = conic_loss;
  same.line_loss = line_loss;
  same.noise_model = noise_model;
  same.camera_sigma = camera_sigma;
  const Status status = same.Validate();
  if (!status.ok()) return status;
  if (num_radial < 0 || num_radial > 4) return Status::Invalid("num_radial must be from 0 to 4");
  if (max_iterations < 1) return Status::Invalid("max_iterations must be 1 or more");
  if (num_threads < 1) return Status::Invalid("num_threads must be 1 or more");
  return Status::Ok();
}

CameraSigma UnknownCamera(const Camera& camera) {
  constexpr double kOfDiagonal = 0.03;  // Of 5 calibrated cameras: 0.005 to 0.028.
  return {0.7, 0.0, kOfDiagonal * std::hypot(camera.width, camera.height), 0.3};
}

double AdjustedCamera::Sigma(int shift) const {
  return std::sqrt(covariance[static_cast<std::size_t>(shift * (kCameraSize + 1))]);
}

namespace {

constexpr int kCoarseIterations = 10;

using Shifts = std::array<double, kCameraSize>;
const char* const kShiftNames[kCameraSize] = {
    "focal length", "aspect", "cx", "cy", "k1", "k2", "k3", "k4", "k5", "k6", "k7", "k8"};

bool IsSameCamera(const Camera& a, const Camera& b) {
  return a.model == b.model && a.width == b.width && a.height == b.height && a.fx == b.fx &&
         a.fy == b.fy && a.cx == b.cx && a.cy == b.cy && a.distortion == b.distortion;
}

// Of its shifts; kOpenCV has k1 k2 p1 p2 k3, kFisheye k1 to k4.
Shifts ShiftSigmas(const Camera& camera, const CameraSigma& prior, const AdjustOptions& options) {
  constexpr double kTangential = 0.01;
  Shifts sigma{};
  sigma[0] = prior.log_focal;
  sigma[1] = prior.log_aspect;
  sigma[2] = sigma[3] = prior.principal_point_px;
  if (camera.model == CameraModel::kPinhole) return sigma;
  const bool opencv = camera.model == CameraModel::kOpenCV;
  const std::array<std::size_t, 4> radial = {4, 5, opencv ? 8U : 6U, 7};
  const int count = std::min(options.num_radial, opencv ? 3 : 4);
  for (int k = 0; k < count; ++k) sigma[radial[static_cast<std::size_t>(k)]] = prior.k1;
  if (opencv && options.tangential) sigma[6] = sigma[7] = kTangential;
  return sigma;
}

// From one camera to another of its model.
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

double Median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// A whole run: the input, and where it stands.
class Adjustment {
 public:
  Adjustment(const std::vector<Observations>& photos, const AdjustOptions& options)
      : options_(options),
        given_(photos),
        is_valid_(photos.size(), 0),
        prepared_(photos.size()),
        inputs_(photos.size()) {
    out_.photos.resize(photos.size());
  }

  AdjustedPhotos Run() {
    out_.status = options_.Validate();
    if (out_.status.ok()) out_.status = FindCameras();
    if (out_.status.ok()) out_.status = Start();
    if (out_.status.ok()) SolveWithoutGross();
    if (out_.status.ok()) Report();
    return std::move(out_);
  }

 private:
  Status FindCameras();
  EstimationOptions PoseOptions() const;
  void Estimate();
  Status FindCamera(std::size_t camera);
  Status Start();
  Status StartHere();
  bool PlaceWorlds();
  void ShareWorld(const SharedLayout& shared, bool by_id);
  void SolveWithoutGross();
  bool HasMoved() const;
  void SeeAnew();
  bool LeaveOut();
  void SolveOnce(int rounds);
  void Report();
  std::size_t CameraOf(std::size_t photo) const {
    return static_cast<std::size_t>(inputs_[photo].camera);
  }

  const AdjustOptions& options_;
  const std::vector<Observations>& given_;
  const Camera* start_ = nullptr;  // Not null: of the only camera, which is not searched.
  std::vector<Camera> cameras_;    // As they stand.
  std::vector<CameraSigma> priors_;
  std::vector<Camera> guesses_;  // As given.
  std::vector<std::uint8_t> is_valid_;  // By photo.
  std::vector<PreparedPhoto> prepared_;
  std::vector<AdjustInput> inputs_;
  std::vector<PoseEstimate> estimates_;
  std::vector<Layout> layouts_;  // By world.
  std::unique_ptr<AdjustProblem> problem_;
  AdjustedPhotos out_;
};

Status Adjustment::FindCameras() {
  if (given_.empty()) return Status::Refused("there is no photo");
  std::map<std::string, int> index;
  for (std::size_t i = 0; i < given_.size(); ++i) {
    const Camera& camera = given_[i].camera;
    const auto [known, is_new] = index.insert({camera.id, static_cast<int>(cameras_.size())});
    inputs_[i].camera = known->second;
    if (is_new) {
      const Status status = camera.Validate();
      if (!status.ok()) return status;
      cameras_.push_back(camera);
      priors_.push_back(options_.camera_sigma.value_or(UnknownCamera(camera)));
    } else if (!IsSameCamera(camera, cameras_[static_cast<std::size_t>(known->second)])) {
      return Status::Invalid("photo " + std::to_string(i) + ": its camera '" + camera.id +
                             "' is not the one that an earlier photo has under that id");
    }
    out_.photos[i].camera = known->second;
    out_.photos[i].status = given_[i].Validate();
    is_valid_[i] = out_.photos[i].status.ok() ? 1 : 0;
  }
  guesses_ = cameras_;
  return Status::Ok();
}

EstimationOptions Adjustment::PoseOptions() const {
  EstimationOptions pose;
  pose.conic_loss = options_.conic_loss;
  pose.line_loss = options_.line_loss;
  pose.noise_model = options_.noise_model;
  // In the pose's covariance only: the camera is not what the photo says of it.
  pose.camera_sigma = CameraSigma::Exact();
  return pose;
}

// Every photo through the cameras as they stand.
void Adjustment::Estimate() {
  const int count = static_cast<int>(given_.size());
  std::mutex mutex;
  int done = 0;
  estimates_.assign(given_.size(), {});
  ParallelFor(count, options_.num_threads, [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    if (is_valid_[i]) {
      prepared_[i] = Prepare(given_[i], cameras_[CameraOf(i)], options_.noise_model);
      inputs_[i].observations = &prepared_[i].observations;
      inputs_[i].noise = prepared_[i].noise;
      if (start_ != nullptr) {
        CoarsePose(prepared_[i], prepared_[i].noise, PoseOptions(), &estimates_[i]);
      } else {
        estimates_[i] = EstimatePose(prepared_[i].observations, PoseOptions());
      }
    } else {
      estimates_[i].status = out_.photos[i].status;
    }
    const std::lock_guard<std::mutex> lock(mutex);
    if (options_.progress) options_.progress("poses", ++done, count);
  });
}

// The camera that photos lead to from each candidate, and the best of those.
Status Adjustment::FindCamera(std::size_t c) {
  constexpr double kMostPhotos = 12.0;  // So many tell a start.
  std::vector<Observations> members;
  for (std::size_t i = 0; i < given_.size(); ++i) {
    if (CameraOf(i) == c && is_valid_[i]) members.push_back(given_[i]);
  }
  const double step = std::max(1.0, static_cast<double>(members.size()) / kMostPhotos);
  std::vector<Observations> used;
  for (double i = 0.0; i < static_cast<double>(members.size()); i += step)
    used.push_back(members[static_cast<std::size_t>(i)]);
  std::vector<const Observations*> pointers;
  for (const Observations& photo : used) pointers.push_back(&photo);
  EstimationOptions pose = PoseOptions();
  pose.conic_distance = ConicDistanceType::kSampson;  // Cheaper.
  CameraSweep sweep(pointers, guesses_[c], pose, options_.num_threads);
  const bool has_radial = ShiftSigmas(cameras_[c], priors_[c], options_)[4] > 0.0;
  std::vector<Camera> candidates = sweep.Candidates(priors_[c].log_focal, has_radial);
  if (candidates.empty()) return Status::Refused("no photo gives a pose at any focal length");
  if (candidates.size() > 1) {
    AdjustOptions coarse = options_;
    coarse.max_iterations = kCoarseIterations;
    coarse.progress = nullptr;
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
  return Status::Ok();
}

Status Adjustment::Start() {
  constexpr double kWide = 0.1;  // Of log f: from here on it is searched.
  if (start_ != nullptr) cameras_.front() = *start_;
  for (std::size_t c = 0; c < cameras_.size() && start_ == nullptr; ++c) {
    if (options_.progress)
      options_.progress("cameras", static_cast<int>(c), static_cast<int>(cameras_.size()));
    if (priors_[c].log_focal < kWide) continue;
    const Status status = FindCamera(c);
    if (!status.ok()) return status;
  }
  return StartHere();
}

Status Adjustment::StartHere() {
  Estimate();
  return PlaceWorlds() ? Status::Ok()
                       : Status::Refused("no photo gives a pose: " +
                                         estimates_.front().status.message);
}

// One world, where the photos' circles lie alike under one id; else each its own.
bool Adjustment::PlaceWorlds() {
  constexpr double kAlike = 0.1;        // Radii.
  constexpr double kMostPhotos = 0.8;   // Of those with a pose.
  bool any = false;
  layouts_.assign(given_.size() + 1, Layout());
  for (std::size_t i = 0; i < given_.size(); ++i) {
    AdjustedPhoto& photo = out_.photos[i];
    photo.status = estimates_[i].status;
    inputs_[i].takes_part = photo.status.ok() && !estimates_[i].hypotheses.empty();
    if (!inputs_[i].takes_part) continue;
    any = true;
    inputs_[i].world = static_cast<int>(i) + 1;
    inputs_[i].pose = estimates_[i].hypotheses.front().cam_from_world;
    layouts_[i + 1] = LayoutOf(estimates_[i].hypotheses.front());
    inputs_[i].layout = &layouts_[i + 1];
  }
  if (!any || options_.rigid == RigidWorld::kNo) return any;
  const auto with_pose = std::count_if(inputs_.begin(), inputs_.end(),
                                       [](const AdjustInput& input) { return input.takes_part; });
  for (const bool by_id : {true, false}) {
    const SharedLayout shared = AlignLayouts(estimates_, by_id);
    const auto placed = std::count(shared.placed.begin(), shared.placed.end(), true);
    const bool alike = placed > 1 && shared.misfit < kAlike &&
                       static_cast<double>(placed) >= kMostPhotos * static_cast<double>(with_pose);
    out_.rigid = alike || (by_id && options_.rigid == RigidWorld::kYes);
    if (!out_.rigid) continue;
    ShareWorld(shared, by_id);
    break;
  }
  return true;
}

void Adjustment::ShareWorld(const SharedLayout& shared, bool by_id) {
  layouts_[0] = shared.circles;
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
    input.layout = &layouts_[0];
    input.names = by_id ? std::map<std::string, std::string>() : shared.names[i];
  }
}

// From wide losses to narrow ones, the camera's coarse parameters first.
void Adjustment::SolveOnce(int rounds) {
  constexpr double kWidest = 300.0, kNear = 3.0, kNarrower = 0.25;
  constexpr int kIterations = 8;
  std::vector<CameraPrior> priors;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    priors.push_back({ShiftsBetween(cameras_[c], guesses_[c]),
                      ShiftSigmas(cameras_[c], priors_[c], options_)});
  }
  problem_ = std::make_unique<AdjustProblem>(inputs_, priors, options_);
  double width = std::min(problem_->LargestMiss(), kWidest);
  for (bool first = true; width > kNear && out_.status.ok(); width *= kNarrower, first = false)
    out_.status = problem_->Solve(width, first, kIterations);
  if (out_.status.ok()) out_.status = problem_->Solve(1.0, false, rounds);
}

// Photos, then features, that contradict the rest as a whole. True where there were any.
bool Adjustment::LeaveOut() {
  constexpr double kGross = 10.0;         // A photo, of the median one's misfit or what is expected.
  constexpr double kGrossFeature = 30.0;  // A feature: p = 1e-7 for one degree of freedom.
  problem_->Judge();
  std::vector<double> misfits;
  for (std::size_t i = 0; i < given_.size(); ++i) {
    if (!inputs_[i].takes_part) continue;
    std::vector<double> own;
    for (const AdjustProblem::Feature& feature : problem_->features()) {
      if (feature.photo == static_cast<int>(i) && feature.active && feature.rows > 0)
        own.push_back(feature.chi2 / feature.rows);
    }
    out_.photos[i].misfit = Median(std::move(own));
    misfits.push_back(out_.photos[i].misfit);
  }
  const double median = Median(misfits), common = std::max(1.0, median);
  bool any = false;
  for (std::size_t i = 0; i < given_.size(); ++i) {
    if (!inputs_[i].takes_part || !(out_.photos[i].misfit > kGross * common)) continue;
    any = true;
    inputs_[i].takes_part = false;
    char text[120];
    std::snprintf(text, sizeof(text),
                  "it contradicts the other photos: misfit %.3g, theirs %.3g (1 expected)",
                  out_.photos[i].misfit, median);
    out_.photos[i].status = Status::Refused(text);
  }
  for (const AdjustProblem::Feature& feature : problem_->features()) {
    const auto i = static_cast<std::size_t>(feature.photo);
    if (!inputs_[i].takes_part || !feature.active || !(feature.chi2 > kGrossFeature * common))
      continue;
    any = true;
    inputs_[i].left_out.insert(feature.id);
    out_.photos[i].left_out.push_back(feature.id);
  }
  return any;
}

// Whether the photos have led to another camera than they were prepared with.
bool Adjustment::HasMoved() const {
  constexpr double kMoved[] = {0.005, 0.005};  // Of log f; of the first distortion coefficient.
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (!problem_->IsUsed(static_cast<int>(c))) continue;
    const Shifts moved = ShiftsBetween(cameras_[c], problem_->CameraAt(static_cast<int>(c)));
    if (std::abs(moved[0]) > kMoved[0] || std::abs(moved[4]) > kMoved[1]) return true;
  }
  return false;
}

// Fits, noise and robust distances are those of the camera that the photos have led to.
void Adjustment::SeeAnew() {
  std::vector<Layout> found(layouts_.size());
  for (const AdjustedCircle& circle : problem_->Circles())
    found[static_cast<std::size_t>(circle.photo + 1)][circle.id] = {circle.center.head<2>(),
                                                                    circle.radius};
  layouts_ = std::move(found);
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (problem_->IsUsed(static_cast<int>(c)))
      cameras_[c] = problem_->CameraAt(static_cast<int>(c));
  }
  ParallelFor(static_cast<int>(given_.size()), options_.num_threads, [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    if (!inputs_[i].takes_part) return;
    prepared_[i] = Prepare(given_[i], cameras_[CameraOf(i)], options_.noise_model);
    inputs_[i].noise = prepared_[i].noise;
    inputs_[i].pose = problem_->PoseAt(index);
    inputs_[i].layout = &layouts_[static_cast<std::size_t>(inputs_[i].world)];
  });
}

void Adjustment::SolveWithoutGross() {
  constexpr int kRounds = 4;
  SolveOnce(options_.max_iterations);
  if (start_ != nullptr) return;  // Good enough to be compared.
  for (int round = 0; round < kRounds && out_.status.ok(); ++round) {
    const bool moved = HasMoved(), left_out = LeaveOut();
    if (!moved && !left_out) return;
    SeeAnew();
    SolveOnce(options_.max_iterations);
  }
}

void Adjustment::Report() {
  const double scale = std::max(1.0, problem_->Misfit());
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    AdjustedCamera made;
    made.camera = cameras_[c];
    if (!problem_->IsUsed(static_cast<int>(c))) {
      out_.notes.push_back("camera '" + made.camera.id + "': no photo of it takes part");
      out_.cameras.push_back(made);
      continue;
    }
    made.camera = problem_->CameraAt(static_cast<int>(c));
    Eigen::Map<Eigen::Matrix<double, kCameraSize, kCameraSize, Eigen::RowMajor>>(
        made.covariance.data()) = scale * problem_->CameraCovariance(static_cast<int>(c));
    const Shifts prior = ShiftSigmas(cameras_[c], priors_[c], options_);
    constexpr double kNextToNothing = 0.7;  // Of the prior's standard deviation.
    for (int k = 0; k < kCameraSize; ++k) {
      const double sigma = prior[static_cast<std::size_t>(k)];
      if (sigma > 0.0 && made.Sigma(k) > kNextToNothing * sigma)
        made.at_prior.emplace_back(kShiftNames[k]);
    }
    out_.cameras.push_back(std::move(made));
  }
  std::vector<double> squares(cameras_.size(), 0.0);
  std::vector<int> counts(cameras_.size(), 0);
  for (std::size_t i = 0; i < given_.size(); ++i) {
    if (!inputs_[i].takes_part) continue;
    AdjustedPhoto& photo = out_.photos[i];
    photo.cam_from_world = problem_->PoseAt(static_cast<int>(i));
    photo.residuals = problem_->Residuals(static_cast<int>(i));
    const int count = static_cast<int>(photo.residuals.size());
    double sum = 0.0;
    for (const AdjustedResidual& r : photo.residuals) sum += r.offset.squaredNorm();
    photo.rms_px = count > 0 ? std::sqrt(sum / count) : 0.0;
    squares[CameraOf(i)] += sum;
    counts[CameraOf(i)] += count;
    ++out_.cameras[CameraOf(i)].num_photos;
  }
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (counts[c] > 0) out_.cameras[c].rms_px = std::sqrt(squares[c] / counts[c]);
  }
  out_.circles = problem_->Circles();
  out_.metric = problem_->metric();
}

}  // namespace

AdjustedPhotos AdjustPhotos(const std::vector<Observations>& photos, const AdjustOptions& options) {
  return Adjustment(photos, options).Run();
}

}  // namespace circline
