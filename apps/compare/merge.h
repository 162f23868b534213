// The folders of the shards of one set become the folder of the whole set.
#ifndef CIRCLINE_APPS_COMPARE_MERGE_H_
#define CIRCLINE_APPS_COMPARE_MERGE_H_

#include <string>
#include <vector>

#include "circline/estimators/status.h"

namespace circline::apps {

// Writes results.jsonl, observations.jsonl, timings.jsonl and the overlays as a run without --shard
// would have; `folders` in any order. Nothing is written unless every folder is finished, all ran
// the same solvers with the same flags and cameras, and together they have every image once.
Status MergeFolders(const std::vector<std::string>& folders, const std::string& output);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_MERGE_H_
