// What is made of results.jsonl, observations.jsonl and timings.jsonl once they are whole.
#ifndef CIRCLINE_APPS_COMPARE_FINISH_H_
#define CIRCLINE_APPS_COMPARE_FINISH_H_

#include <string>
#include <vector>

#include "circline/estimators/status.h"

namespace circline::apps {

struct ComparisonResult {
  int num_unreadable = 0;  // Images, each named on stderr.
  std::string table;       // Summary for people, and what else there is to say.
};

struct FinishOptions {
  std::string save_options;          // File for the flags of the best loss and scale; may be empty.
  std::string other_flags;           // To stand in it as well, one a line.
  std::vector<std::string> exports;  // See WriteExports.
};

// Before the work: whether what the options say could be written. The folder need not exist yet.
Status CheckFinish(const std::string& folder, const FinishOptions& options);

// Writes summary.csv and report.html into the folder, and what else the options say.
Status FinishFolder(const std::string& folder, const FinishOptions& options,
                    ComparisonResult* result);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_FINISH_H_
