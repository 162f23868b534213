// report.html: one file that shows everything, with nothing to fetch.
#ifndef CIRCLINE_APPS_COMPARE_REPORT_H_
#define CIRCLINE_APPS_COMPARE_REPORT_H_

#include <string>
#include <vector>

#include "apps/compare/agreement.h"
#include "apps/compare/selection.h"
#include "apps/compare/summary.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// The output files of a folder boiled down to what the tables and plots need.
struct Digest {
  Summary summary;
  Agreement agreement;
  std::vector<ImageScore> scores;  // One for each image, in order.
};

// Reads results.jsonl and its companions, one image at a time. Not ok: a line that is not as this
// program writes it.
Status ReadDigest(const std::string& folder, Digest* digest);

// Photos shown in full, with their pictures; the others are listed by name.
inline constexpr std::size_t kMaxReportImages = 200;

// Writes report.html of a folder whose results.jsonl, its companions and overlays are there. Photos
// beyond `max_images` are not shown in full.
Status WriteReport(const std::string& folder, const Digest& digest,
                   std::size_t max_images = kMaxReportImages);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_REPORT_H_
