// Robust fits of conics, lines and pencils among outliers, beside what OpenCV, a plain RANSAC and a
// RANSAC with a Tukey finish reach on the same data. Every row says whether it meets its bar.
//
//     circline_robust_fit_benchmark --trials=200
//     circline_robust_fit_benchmark --rows=cluster --peers=false
//
// C is the error along the true curve over the Cramer-Rao bound of the inliers; a fit is ok if
// C <= 3; times are processor time of one fit.

#include <gflags/gflags.h>

#include "apps/benchmark/robust_fit_options.h"
#include "apps/benchmark/robust_fit_table.h"
#include "apps/common/flags_util.h"
#include "circline/estimators/status.h"

DEFINE_int32(trials, 200, "Data sets for each row; 1 or more.");
DEFINE_uint64(seed, 1, "Of the data sets.");
DEFINE_double(sigma_px, 1.0, "Standard deviation of each coordinate of a point, pixels.");
DEFINE_double(direction_sigma_deg, 5.0, "Standard deviation of the edge directions, degrees.");
DEFINE_string(rows, "", "Only the rows whose name holds this.");
DEFINE_bool(peers, true, "Run the other methods too.");
DEFINE_int32(peer_max_iterations, 10000, "Draws of the plain RANSAC; 1 or more.");

// The engine's options, all of them.
DEFINE_double(inlier_sigmas, 3.03, "Threshold, in standard deviations of the noise.");
DEFINE_double(confidence, circline::RansacOptions().confidence, "RansacOptions::confidence.");
DEFINE_int32(min_iterations, circline::RansacOptions().min_iterations,
             "RansacOptions::min_iterations.");
DEFINE_int32(max_iterations, circline::RansacOptions().max_iterations,
             "RansacOptions::max_iterations.");
DEFINE_int32(local_start, circline::RansacOptions().local_start, "RansacOptions::local_start.");
DEFINE_int32(local_samples, circline::RansacOptions().local_samples,
             "RansacOptions::local_samples.");
DEFINE_int32(local_steps, circline::RansacOptions().local_steps, "RansacOptions::local_steps.");
DEFINE_uint64(ransac_seed, circline::RansacOptions().seed, "RansacOptions::seed.");

namespace circline::apps {

RansacOptions EngineOptions() {
  RansacOptions options;
  options.threshold = FLAGS_inlier_sigmas;
  options.confidence = FLAGS_confidence;
  options.min_iterations = FLAGS_min_iterations;
  options.max_iterations = FLAGS_max_iterations;
  options.local_start = FLAGS_local_start;
  options.local_samples = FLAGS_local_samples;
  options.local_steps = FLAGS_local_steps;
  options.seed = FLAGS_ransac_seed;
  return options;
}

RobustFitOptions PixelOptions() {
  RobustFitOptions options;
  options.ransac = EngineOptions();
  options.ransac.threshold *= FLAGS_sigma_px;
  options.sigma_px = FLAGS_sigma_px;
  return options;
}

bool Wanted(const std::string& name) { return name.find(FLAGS_rows) != std::string::npos; }

std::uint64_t TrialSeed(int trial) { return 1000 * FLAGS_seed + static_cast<std::uint64_t>(trial); }

namespace {

constexpr char kUsage[] =
    "circline_robust_fit_benchmark: robust conics, lines and pencils beside their peers.";

// Not ok: one line that names the flag.
Status CheckFlags() {
  if (FLAGS_trials < 1) return Status::Invalid("--trials: must be 1 or more");
  if (FLAGS_peer_max_iterations < 1) {
    return Status::Invalid("--peer_max_iterations: must be 1 or more");
  }
  if (!(FLAGS_direction_sigma_deg >= 0.0 && FLAGS_direction_sigma_deg <= 180.0)) {
    return Status::Invalid("--direction_sigma_deg: must be from 0 to 180");
  }
  return PixelOptions().Validate();
}

int Run() {
  const Status status = CheckFlags();
  if (!status.ok()) {
    SayOnStderr("circline_robust_fit_benchmark: " + status.message);
    return kExitUsage;
  }
  RunConics();
  RunContours();
  RunLines();
  RunPencils();
  return kExitOk;
}

}  // namespace
}  // namespace circline::apps

int main(int argc, char** argv) {
  return circline::apps::RunApp(argc, argv, "circline_robust_fit_benchmark", circline::apps::kUsage,
                                circline::apps::Run);
}
