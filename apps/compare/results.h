// Lines of results.jsonl, observations.jsonl and timings.jsonl.
#ifndef CIRCLINE_APPS_COMPARE_RESULTS_H_
#define CIRCLINE_APPS_COMPARE_RESULTS_H_

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "apps/compare/image_run.h"
#include "apps/compare/record.h"
#include "circline/estimators/noise_model.h"

namespace circline::apps {

// results: one line for each hypothesis of each solver; one with nulls for a solver that refused or
// failed. `loss` and `loss_scale_px` are null for closed forms; the scale is a number or "auto".
// Numbers are the shortest that read back as the same double.
// observations: one line. `conic` is calibrated, of unit norm: C00 C01 C02 C11 C12 C22; `axes` are
// semi-axes; `coverage` is the share of the ellipse's full turn that has points; `index` counts the
// images of the whole set, `lines` those of the other files that belong to this one. A photo that
// could not be used has an `error`. `overlay` may be empty, and so may `flags`, those with which
// the run was made where they are not the default (CompareOptions::unusual_flags). `sigma_deg` of a
// pencil counts what walls lean and boards bend (`noise`), as the solvers do.
ImageLines WriteLines(const ImageRun& run, const std::string& overlay,
                      const std::vector<std::string>& flags, const NoiseModel& noise);

// The same, for who does not write them: the lines of results.jsonl, and that of
// observations.jsonl.
std::vector<nlohmann::ordered_json> ResultLines(const ImageRun& run);
nlohmann::ordered_json ObservationLine(const ImageRun& run, const std::string& overlay,
                                       const std::vector<std::string>& flags,
                                       const NoiseModel& noise, const LineCounts& counts);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_RESULTS_H_
