// Solved, judged and reported.
#include "circline/refine/many/adjustment.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <utility>
#include <vector>

#include "circline/estimators/statistics.h"

namespace circline {

// From wide losses to narrow ones.
void Adjustment::SolveOnce() {
  constexpr double kWidest = 300.0, kNear = 3.0, kNarrower = 0.25;
  constexpr int kIterations = 8;
  std::vector<CameraPrior> priors;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    priors.push_back({ShiftsBetween(cameras_[c], guesses_[c]),
                      ShiftSigmas(cameras_[c], priors_[c], options_), cameras_[c].model});
  }
  problem_ = std::make_unique<AdjustProblem>(inputs_, layouts_, lattices_, priors, options_,
                                             given_frame_ ? &*given_frame_ : nullptr);
  double width = std::min(problem_->LargestRms(), kWidest);
  for (; width > kNear && out_.status.ok(); width *= kNarrower)
    out_.status = problem_->Solve(width, kIterations);
  if (out_.status.ok()) out_.status = problem_->Solve(1.0, options_.max_iterations);
}

// Fills the photos' misfits; returns their median.
double Adjustment::JudgePhotos() {
  problem_->Judge();
  std::vector<std::vector<double>> by_photo(given_.size());
  for (const AdjustProblem::Feature& feature : problem_->features()) {
    if (feature.active && feature.rows > 0)
      by_photo[feature.photo].push_back(feature.chi2 / feature.rows);
  }
  std::vector<double> misfits;
  for (std::size_t i = 0; i < given_.size(); ++i) {
    if (!inputs_[i].takes_part) continue;
    out_.photos[i].misfit = Median(std::move(by_photo[i]));
    misfits.push_back(out_.photos[i].misfit);
  }
  return Median(std::move(misfits));
}

// Photos, and features, that contradict the rest as a whole. True where there were any.
bool Adjustment::LeaveOut() {
  // A photo, of the median one's misfit or what is expected. Photographs of discs, dots and
  // chessboards here have 0 to 0.5; one squeezed by a fifth has more than 100.
  constexpr double kGross = 10.0;
  constexpr double kGrossFeature = 30.0;  // A feature: p = 1e-7 for one degree of freedom.
  const double median = JudgePhotos(), common = std::max(1.0, median);
  bool any = false;
  std::vector<int> left(given_.size(), 0), all(given_.size(), 0);
  for (const AdjustProblem::Feature& feature : problem_->features()) {
    const std::size_t i = feature.photo;
    ++all[i];
    if (!feature.active) continue;
    ++left[i];
    if (out_.photos[i].misfit > kGross * common || !(feature.chi2 > kGrossFeature * common))
      continue;
    any = true;
    --left[i];
    inputs_[i].left_out.insert(feature.id);
    out_.photos[i].left_out.push_back(feature.id);
  }
  for (std::size_t i = 0; i < given_.size(); ++i) {
    const bool is_gross = out_.photos[i].misfit > kGross * common;
    if (!inputs_[i].takes_part || (!is_gross && 2 * left[i] >= all[i])) continue;
    any = true;
    inputs_[i].takes_part = false;
    char text[120];
    if (is_gross) {
      std::snprintf(text, sizeof(text),
                    "it contradicts the other photos: misfit %.3g, theirs %.3g (1 expected)",
                    out_.photos[i].misfit, median);
    } else {
      std::snprintf(text, sizeof(text), "it contradicts the other photos in %d of %d features",
                    all[i] - left[i], all[i]);
    }
    out_.photos[i].status = Status::Refused(text);
  }
  return any;
}

// Whether the photos have led to another camera than they were prepared with.
bool Adjustment::HasMoved() const {
  constexpr double kMoved = 0.005;  // Of log f; of the first distortion coefficient.
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (!problem_->IsUsed(c)) continue;
    const Shifts moved = ShiftsBetween(cameras_[c], problem_->CameraAt(c));
    if (std::abs(moved[0]) > kMoved || std::abs(moved[4]) > kMoved) return true;
  }
  return false;
}

std::vector<Layout> Adjustment::FoundLayouts() const {
  std::vector<Layout> found(layouts_.size());
  for (const AdjustedCircle& circle : problem_->Circles())
    found[static_cast<std::size_t>(circle.photo + 1)][circle.id] = {circle.center.head<2>(),
                                                                    circle.radius};
  return found;
}

// Fits, noise and robust distances are those of the camera that the photos have led to.
void Adjustment::PrepareAnew() {
  layouts_ = FoundLayouts();
  if (given_frame_) given_frame_ = problem_->GivenFrameAt();
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (problem_->IsUsed(c)) cameras_[c] = problem_->CameraAt(c);
  }
  ParallelFor(given_.size(), options_.num_threads, [&](std::size_t i) {
    if (!inputs_[i].takes_part) return;
    prepared_[i] = Prepare(given_[i], cameras_[inputs_[i].camera], PoseOptions(options_));
    inputs_[i].pose = problem_->PoseAt(i);
  });
}

void Adjustment::SolveWithoutOutliers() {
  constexpr int kRounds = 12;
  SolveOnce();
  if (start_ != nullptr) return;  // Good enough to be compared.
  bool has_looked_for_grids = false;
  for (int round = 0; round < kRounds && out_.status.ok(); ++round) {
    bool changed = HasMoved();
    changed = LeaveOut() || changed;
    changed = LeaveGridLinesOut() || changed;
    changed = LeaveLatticeCirclesOut() || changed;
    const bool looks_for_grids = !changed && !std::exchange(has_looked_for_grids, true);
    if (!changed && !(looks_for_grids && FindGrids())) return;
    PrepareAnew();
    if (looks_for_grids) StartOnGrids();
    SolveOnce();
  }
}

// What the focal lengths' deviations were after 1, 2, 4, ... photos, and are after all, about the
// same estimate. From some dozens on they fall as one over the root of their number.
void Adjustment::ReportSigmas(double scale) {
  std::vector<int> counts(cameras_.size(), 0);
  constexpr int kMost = 64;
  int seen = 0, next = 1;
  const auto add = [&](std::size_t end) {
    const auto covariances = problem_->Covariance(end, false);
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      auto& sigmas = out_.cameras[c].sigma_by_photos;
      if (counts[c] > 0 && (sigmas.empty() || sigmas.back().first < counts[c]))
        sigmas.emplace_back(counts[c], std::sqrt(scale * covariances.cameras[c](0, 0)));
    }
  };
  for (std::size_t i = 0; i < given_.size(); ++i) {
    if (!inputs_[i].takes_part) continue;
    ++counts[inputs_[i].camera];
    if (++seen < next || seen > kMost) continue;
    next *= 2;
    add(i + 1);
  }
  add(given_.size());
}

void Adjustment::Report() {
  JudgePhotos();
  const double scale = std::max(1.0, problem_->Misfit());
  const AdjustProblem::Covariances covariances = problem_->Covariance(given_.size());
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    AdjustedCamera made;
    made.camera = cameras_[c];
    if (!problem_->IsUsed(c)) {
      out_.notes.push_back("camera '" + made.camera.id + "': no photo of it takes part");
      out_.cameras.push_back(made);
      continue;
    }
    made.camera = problem_->CameraAt(c);
    Eigen::Map<Eigen::Matrix<double, kCameraSize, kCameraSize, Eigen::RowMajor>>(
        made.covariance.data()) = scale * covariances.cameras[c];
    const Shifts prior = ShiftSigmas(cameras_[c], priors_[c], options_);
    const Shifts off = ShiftsBetween(guesses_[c], made.camera);
    constexpr double kNextToNothing = 0.7;  // Of the prior's standard deviation.
    for (int k = 0; k < kCameraSize; ++k) {
      const double sigma = prior[static_cast<std::size_t>(k)];
      if (k == 1 || IsTangential(made.camera.model, k))
        continue;  // Their priors are meant to hold them.
      if (sigma > 0.0 && made.Sigma(k) > kNextToNothing * sigma)
        made.at_prior.emplace_back(ShiftName(made.camera.model, k));
      const double most =
          kInlierSigmas * std::max(sigma, k == 0 ? priors_[c].LargestLogFocal() : 0.0);
      if (sigma > 0.0 && std::abs(off[static_cast<std::size_t>(k)]) > most) {
        out_.notes.push_back("camera '" + made.camera.id + "': its " +
                             ShiftName(made.camera.model, k) +
                             " is so far from the one given that this camera, or the evidence, "
                             "is not what it seems");
      }
    }
    out_.cameras.push_back(std::move(made));
  }
  std::vector<double> squares(cameras_.size(), 0.0);
  std::vector<int> counts(cameras_.size(), 0);
  std::vector<std::vector<AdjustedResidual>> residuals = problem_->Residuals();
  for (std::size_t i = 0; i < given_.size(); ++i) {
    if (!inputs_[i].takes_part) continue;
    AdjustedPhoto& photo = out_.photos[i];
    photo.cam_from_world = problem_->PoseAt(i);
    Eigen::Map<Matrix6d>(photo.covariance.data()) = scale * covariances.poses[i];  // Symmetric.
    if (inputs_[i].grid != nullptr)
      photo.num_grid_lines = static_cast<int>(inputs_[i].grid->places.size());
    photo.residuals = std::move(residuals[i]);
    const int count = static_cast<int>(photo.residuals.size());
    double sum = 0.0;
    for (const AdjustedResidual& r : photo.residuals) sum += r.offset.squaredNorm();
    photo.rms_px = count > 0 ? std::sqrt(sum / count) : 0.0;
    squares[inputs_[i].camera] += sum;
    counts[inputs_[i].camera] += count;
    ++out_.cameras[inputs_[i].camera].num_photos;
  }
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (counts[c] > 0) out_.cameras[c].rms_px = std::sqrt(squares[c] / counts[c]);
  }
  const auto boards = std::count_if(inputs_.begin(), inputs_.end(), [](const AdjustInput& input) {
    return input.takes_part && input.grid != nullptr;
  });
  if (boards > 0) {
    out_.notes.push_back(std::to_string(boards) +
                         " photos show a grid of equal squares: their poses are in squares");
  }
  if (HasLattice())
    out_.notes.emplace_back("circles lie on a grid of equal squares, and count as that");
  if (start_ == nullptr) ReportSigmas(scale);
  out_.circles = problem_->Circles();
  out_.directions = problem_->Directions();
  if (given_frame_) {
    out_.given = problem_->GivenFrameAt();
    out_.given->log_scale_sigma = std::sqrt(scale * covariances.log_scale);
  }
  out_.metric = problem_->metric();
}

}  // namespace circline
