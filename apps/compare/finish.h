// What is made of results.jsonl, observations.jsonl and timings.jsonl once they are whole.
#ifndef CIRCLINE_APPS_COMPARE_FINISH_H_
#define CIRCLINE_APPS_COMPARE_FINISH_H_

#include <string>

#include "circline/estimators/status.h"

namespace circline::apps {

struct ComparisonResult {
  int num_unreadable = 0;  // Images, each named on stderr.
  std::string table;       // Summary for people, and what else there is to say.
};

// Writes summary.csv and report.html into the folder.
Status FinishFolder(const std::string& folder, ComparisonResult* result);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_FINISH_H_
