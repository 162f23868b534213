// The whole comparison: images through solvers into files.
#ifndef CIRCLINE_APPS_COMPARE_RUN_H_
#define CIRCLINE_APPS_COMPARE_RUN_H_

#include <string>

#include "apps/compare/inputs.h"
#include "apps/compare/options.h"
#include "apps/compare/ranks.h"
#include "circline/estimators/status.h"

namespace circline::apps {

struct ComparisonResult {
  int num_unreadable = 0;  // Images, each named on stderr.
  std::string table;       // Summary for people, and what else there is to say.
};

// Works on options.threads images at a time, on every rank, and writes their lines in the order of
// `images` as they are done, so that the files do not depend on the number of threads. Summary and
// report are made of these files at the end. Not ok: a folder or file that cannot be written. Ranks
// beside the first return without a result.
Status RunComparison(const ImageSet& images, const CompareOptions& options, const Ranks& ranks,
                     ComparisonResult* result);

// Joins the folders options.inputs.merge (see MergeFolders), then as above.
Status MergeComparison(const CompareOptions& options, ComparisonResult* result);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_RUN_H_
