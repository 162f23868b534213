// FitObservations and EstimatePose of any evidence, under any loss and prior.
#include "circline/ransac/fit_observations.h"
#include "circline/refine/estimate_pose.h"
#include "tests/fuzz/fuzz.h"

namespace circline::fuzz {
namespace {

EstimationOptions ArbitraryOptions(Bytes* bytes) {
  EstimationOptions options;
  options.conic_loss.type = static_cast<LossType>(bytes->Below(4));
  options.line_loss.type = static_cast<LossType>(bytes->Below(4));
  if (bytes->OneIn(4)) options.conic_loss.scale_px = bytes->Number(0.01, 5.0);
  if (bytes->OneIn(2)) options.noise_model = NoiseModel::Exact();
  if (bytes->OneIn(4)) options.camera_sigma.emplace().log_focal = bytes->Number(0.0, 1.0);
  if (bytes->OneIn(8)) options.gravity_prior.emplace().sigma_rad = bytes->Number(0.0, 0.1);
  options.max_iterations = 1 + bytes->Below(20);
  return options;
}

}  // namespace
}  // namespace circline::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace circline;
  fuzz::Bytes bytes(data, size);
  const EstimationOptions options = fuzz::ArbitraryOptions(&bytes);
  const bool robust = bytes.OneIn(2);
  Observations observations = fuzz::ArbitraryObservations(&bytes);
  const bool is_valid = observations.Validate().ok() && options.Validate().ok();
  if (robust) {
    const Status status = FitObservations({}, &observations);
    fuzz::Expect(status.ok() == observations.Validate().ok(), "a fit refuses what is not valid");
  }
  const PoseEstimate estimate = EstimatePose(observations, options);
  fuzz::ExpectSound(estimate);
  fuzz::Expect(is_valid || !estimate.status.ok(), "what is not valid is refused");
  return 0;
}
