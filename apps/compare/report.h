// report.html: one file that shows everything, with nothing to fetch.
#ifndef CIRCLINE_APPS_COMPARE_REPORT_H_
#define CIRCLINE_APPS_COMPARE_REPORT_H_

#include <string>
#include <vector>

#include "apps/compare/image_run.h"
#include "apps/compare/summary.h"

namespace circline::apps {

// The part of the report on one image. `picture` is the overlay as JPEG (may be empty),
// `overlay_file` the name of the full picture beside the report (may be empty).
std::string ReportSection(const ImageRun& run, const std::vector<std::uint8_t>& picture,
                          const std::string& overlay_file);

// The whole page.
std::string RenderReport(const Summary& summary, const std::vector<std::string>& sections);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_REPORT_H_
