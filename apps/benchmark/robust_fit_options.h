// What circline_robust_fit_benchmark was asked to do.
#ifndef CIRCLINE_APPS_BENCHMARK_ROBUST_FIT_OPTIONS_H_
#define CIRCLINE_APPS_BENCHMARK_ROBUST_FIT_OPTIONS_H_

#include <gflags/gflags_declare.h>

#include <cstdint>
#include <string>

#include "circline/ransac/ransac.h"
#include "circline/ransac/robust_conic.h"

DECLARE_int32(trials);
DECLARE_double(sigma_px);
DECLARE_double(direction_sigma_deg);
DECLARE_bool(peers);
DECLARE_int32(peer_max_iterations);
DECLARE_double(inlier_sigmas);
DECLARE_double(confidence);
DECLARE_uint64(ransac_seed);

namespace circline::apps {

RansacOptions EngineOptions();    // Its threshold in standard deviations.
RobustFitOptions PixelOptions();  // For points: in pixels.
bool Wanted(const std::string& row);
std::uint64_t TrialSeed(int trial);  // Of its data.

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_ROBUST_FIT_OPTIONS_H_
