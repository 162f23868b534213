// A joint adjustment of many photos while it runs: the input, and where it stands. Internal: not
// installed.
#ifndef CIRCLINE_REFINE_MANY_ADJUSTMENT_H_
#define CIRCLINE_REFINE_MANY_ADJUSTMENT_H_

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/estimators/point_noise.h"
#include "circline/estimators/pose.h"
#include "circline/refine/adjust_photos.h"
#include "circline/refine/many/adjust_layout.h"
#include "circline/refine/many/adjust_problem.h"

namespace circline {

// --- adjust_start.cc: a camera that explains photos to start from, and a pose for each. ---

// Calls work(0) .. work(count - 1) on so many threads. What one of them throws ends the rest, and
// is thrown again.
void ParallelFor(std::size_t count, int num_threads, const std::function<void(std::size_t)>& work);

// A photo as it is refined: fitted anew through this camera, resolved (ResolveWorld), each feature
// with its noise, which is measured where `noise` is null.
Observations Prepare(const Observations& given, const Camera& camera,
                     const EstimationOptions& options, const PointNoise* noise = nullptr);

// A pose of a photo after a few steps from the best closed form, and how badly it explains the
// photo: the robust cost, half of chi^2; infinity where there is none. `estimate` may be null.
double CoarsePose(const Observations& photo, const EstimationOptions& options,
                  PoseEstimate* estimate);

// Cameras that might have taken some photos, by how well these are explained.
class CameraSweep {
 public:
  // `given`: the camera that the photos come with. All outlive it.
  CameraSweep(const std::vector<Observations>& photos, const Camera& given,
              const EstimationOptions& options, int num_threads);
  // Of CoarsePose, all photos, none counted for more than being hopeless.
  std::vector<double> CostsAt(const std::vector<Camera>& cameras);
  // Up to three to start from, the best first: the minima over a grid of focal lengths, as far as
  // the prior reaches, and (with has_radial) of the first distortion coefficient. Empty where no
  // photo gives a pose at any.
  std::vector<Camera> Candidates(double log_focal_sigma, bool has_radial);

 private:
  const std::vector<Observations>& photos_;
  const Camera& given_;
  const EstimationOptions& options_;
  int num_threads_;
  std::vector<PointNoise> noise_;  // Through the camera given.
  std::vector<double> least_;      // By photo, of all costs so far.
};

// --- adjustment.cc, adjustment_start.cc, adjust_grids.cc ---

// Prior standard deviations of a camera's shifts; 0 = held.
Shifts ShiftSigmas(const Camera& camera, const CameraSigma& prior, const AdjustOptions& options);
// From one camera to another of its model.
Shifts ShiftsBetween(const Camera& from, const Camera& to);

class Adjustment {
 public:
  Adjustment(const std::vector<Observations>& photos, const AdjustOptions& options)
      : options_(options),
        given_(photos),
        prepared_(photos.size()),
        inputs_(photos.size()),
        grids_(photos.size()) {
    out_.photos.resize(photos.size());
  }

  AdjustedPhotos Run() {
    out_.status = options_.Validate();
    if (out_.status.ok()) out_.status = FindCameras();
    if (out_.status.ok()) SetAsideEqualViews();
    if (out_.status.ok()) out_.status = Start();
    if (out_.status.ok()) SolveWithoutOutliers();
    if (out_.status.ok()) Report();
    return std::move(out_);
  }

 private:
  Status FindCameras();
  Status CheckGivenPoses();
  // equal_views.cc: of those photos of a camera that show nearly the same the first one takes part.
  // Four fifths of the features of each lie within nearly_equal of one of the other, whatever the
  // ids.
  void SetAsideEqualViews();
  void Estimate();
  void FindCamera(std::size_t camera);
  Status Start();
  Status PlaceWorlds();
  void ShareWorld(const SharedLayout& shared);
  Status CheckRadii() const;
  void ScaleWorlds();
  void SolveWithoutOutliers();
  bool FindGrids();
  void StartOnGrids();
  bool LeaveGridLinesOut();
  bool LeaveLatticeCirclesOut();
  bool HasLattice() const;
  bool HasMoved() const;
  std::vector<Layout> FoundLayouts() const;  // As the problem has them.
  void PrepareAnew();
  double JudgePhotos();
  bool LeaveOut();
  void SolveOnce();
  void Report();
  void ReportSigmas(double scale);

  const AdjustOptions& options_;
  const std::vector<Observations>& given_;
  const Camera* start_ = nullptr;  // Not null: of the only camera, which is not searched.
  std::vector<Camera> cameras_;    // As they stand.
  std::vector<CameraSigma> priors_;
  std::vector<Camera> guesses_;  // As given.
  std::vector<Observations> prepared_;
  std::vector<AdjustInput> inputs_;
  std::vector<std::optional<SquareGrid>> grids_;
  std::vector<PoseEstimate> estimates_;
  std::vector<Layout> layouts_;            // By world.
  std::vector<SquareLattice> lattices_;    // By world; none until they are looked for.
  std::optional<GivenFrame> given_frame_;  // Where poses are given; as it stands.
  std::unique_ptr<AdjustProblem> problem_;
  AdjustedPhotos out_;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_MANY_ADJUSTMENT_H_
