// A joint adjustment of many photos while it runs: the input, and where it stands. Internal: not
// installed.
#ifndef CIRCLINE_REFINE_ADJUSTMENT_H_
#define CIRCLINE_REFINE_ADJUSTMENT_H_

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "circline/refine/adjust_layout.h"
#include "circline/refine/adjust_photos.h"
#include "circline/refine/adjust_problem.h"
#include "circline/refine/adjust_start.h"

namespace circline {

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
  void ScaleWorlds();
  void SolveWithoutOutliers();
  bool FindGrids();
  void StartOnGrids();
  bool LeaveGridLinesOut();
  bool HasMoved() const;
  void PrepareAnew();
  double JudgePhotos();
  bool LeaveOut();
  void SolveOnce();
  void Report();
  void ReportSigmas(double scale);
  std::size_t CameraOf(std::size_t photo) const {
    return static_cast<std::size_t>(inputs_[photo].camera);
  }

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
  std::optional<GivenFrame> given_frame_;  // Where poses are given; as it stands.
  std::unique_ptr<AdjustProblem> problem_;
  AdjustedPhotos out_;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_ADJUSTMENT_H_
