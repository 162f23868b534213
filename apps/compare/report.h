// report.html: one file that shows everything, with nothing to fetch.
#ifndef CIRCLINE_APPS_COMPARE_REPORT_H_
#define CIRCLINE_APPS_COMPARE_REPORT_H_

#include <string>

#include "apps/compare/digest.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// Photos shown in full, with their pictures; the others are listed by name.
inline constexpr std::size_t kMaxReportImages = 200;

// Writes report.html of a folder whose results.jsonl, its companions and overlays are there. Photos
// beyond `max_images` are not shown in full.
Status WriteReport(const std::string& folder, const Digest& digest,
                   std::size_t max_images = kMaxReportImages);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_REPORT_H_
