// Going on where a run was stopped.
#ifndef CIRCLINE_APPS_COMPARE_RESUME_H_
#define CIRCLINE_APPS_COMPARE_RESUME_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "apps/compare/inputs.h"
#include "apps/compare/options.h"
#include "apps/compare/record.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// The images, from the first on, whose lines are in the files whole, and how many bytes of
// results.jsonl, observations.jsonl and timings.jsonl these are.
struct DonePart {
  std::size_t images = 0;
  std::array<std::uint64_t, 3> bytes{};
};

// Removes what an earlier run of circline_compare or circline_track wrote into that folder, by its
// names: results, report, exported poses and the overlays that its observations.jsonl names.
void RemoveEarlierRun(const std::string& folder);

// What has the name of a file of results must be one, to be replaced. Not ok: names what is none.
Status CheckResultFiles(const std::string& folder);

// Clears a folder of the results of an earlier run, or, with `resume`, finds what of them stands.
// Not ok: CheckResultFiles, or they are those of other images, cameras, solvers or flags. Photos
// that could not be read are named on stderr again.
Status PrepareFolder(const CompareOptions& options, const ImageSet& images,
                     const std::vector<SolverKey>& solvers, DonePart* done);

// A folder is unfinished, as photos are missing, from PrepareFolder until this.
void MarkFinished(const std::string& folder);
bool IsUnfinished(const std::string& folder);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_RESUME_H_
