// Robust fits of conics, lines and pencils among outliers, beside what OpenCV, a plain RANSAC and a
// RANSAC with a Tukey finish reach on the same data. Every row says whether it meets its bar.
//
//     circline_robust_fit_benchmark --trials=200
//     circline_robust_fit_benchmark --rows=cluster --peers=false
//
// C is the error along the true curve over the Cramer-Rao bound of the inliers; a fit is ok if
// C <= 3; times are processor time of one fit.

#include "apps/benchmark/robust_fit_options.h"
#include "apps/benchmark/robust_fit_rows.h"
#include "apps/common/flags_util.h"

namespace circline::apps {
namespace {

constexpr char kUsage[] =
    "circline_robust_fit_benchmark: robust conics, lines and pencils beside their peers.";

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
