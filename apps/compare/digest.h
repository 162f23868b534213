// The output files of a folder boiled down to what the tables and plots need.
#ifndef CIRCLINE_APPS_COMPARE_DIGEST_H_
#define CIRCLINE_APPS_COMPARE_DIGEST_H_

#include <string>
#include <vector>

#include "apps/compare/agreement.h"
#include "apps/compare/selection.h"
#include "apps/compare/summary.h"
#include "circline/estimators/status.h"

namespace circline::apps {

struct Digest {
  Summary summary;
  Agreement agreement;
  std::vector<ImageScore> scores;  // One for each image, in order.
};

// Reads results.jsonl and its companions, one image at a time. Not ok: a line that is not as this
// program writes it.
Status ReadDigest(const std::string& folder, Digest* digest);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_DIGEST_H_
