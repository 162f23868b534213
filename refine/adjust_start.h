// Where a joint adjustment of many photos starts: a camera that explains them, and a pose for each.
// Internal: not installed.
#ifndef CIRCLINE_REFINE_ADJUST_START_H_
#define CIRCLINE_REFINE_ADJUST_START_H_

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/estimators/point_noise.h"
#include "circline/estimators/pose.h"
#include "circline/refine/adjust_photos.h"

namespace circline {

// Calls work(0) .. work(count - 1) on so many threads. What one of them throws ends the rest, and
// is thrown again.
void ParallelFor(int count, int num_threads, const std::function<void(int)>& work);

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
  CameraSweep(std::vector<const Observations*> photos, const Camera& given,
              const EstimationOptions& options, int num_threads);
  // Of CoarsePose, all photos, none counted for more than being hopeless.
  std::vector<double> CostsAt(const std::vector<Camera>& cameras);
  // Up to three to start from, the best first: the minima over a grid of focal lengths, as far as
  // the prior reaches, and (with has_radial) of the first distortion coefficient. Empty where no
  // photo gives a pose at any.
  std::vector<Camera> Candidates(double log_focal_sigma, bool has_radial);

 private:
  std::vector<const Observations*> photos_;
  const Camera& given_;
  const EstimationOptions& options_;
  int num_threads_;
  std::vector<PointNoise> noise_;  // Through the camera given.
  std::vector<double> least_;      // By photo, of all costs so far.
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_ADJUST_START_H_
