// The whole comparison: images through solvers into files.
#ifndef CIRCLINE_APPS_COMPARE_RUN_H_
#define CIRCLINE_APPS_COMPARE_RUN_H_

#include <string>
#include <vector>

#include "apps/common/scene.h"
#include "apps/compare/options.h"
#include "circline/estimators/status.h"

namespace circline::apps {

struct ComparisonResult {
  int num_unreadable = 0;  // Images, each named on stderr.
  std::string table;       // Summary for people.
};

// Works on options.threads images at a time and writes their lines in the order of `images`, so
// that the files do not depend on the number of threads. A file has its name only once it is whole.
// Not ok: a folder or file that cannot be written.
Status RunComparison(const std::vector<SceneImage>& images, const CompareOptions& options,
                     ComparisonResult* result);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_RUN_H_
