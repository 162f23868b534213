// Lines of results.jsonl, observations.jsonl and timings.jsonl.
#ifndef CIRCLINE_APPS_COMPARE_RESULTS_H_
#define CIRCLINE_APPS_COMPARE_RESULTS_H_

#include <string>

#include "apps/compare/image_run.h"

namespace circline::apps {

// One line for each hypothesis of each solver; one with nulls for a solver that refused or failed.
// `loss` and `loss_scale_px` are null for closed forms; the scale is a number or "auto". Numbers
// are the shortest that read back as the same double.
std::string ResultLines(const ImageRun& run);

// One line. `conic` is calibrated, of unit norm: C00 C01 C02 C11 C12 C22; `axes` are semi-axes;
// `coverage` is the share of the ellipse's full turn that has points. A photo that could not be
// read has an `error`.
std::string ObservationLine(const ImageRun& run);

std::string TimingLines(const ImageRun& run);

// "auto" or the number, for tables.
std::string ScaleText(const LossSetting& loss);

// "ok", "refused" or "failed".
const char* StatusText(const Status& status);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_RESULTS_H_
