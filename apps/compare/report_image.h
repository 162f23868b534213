// The part of report.html on one photo.
#ifndef CIRCLINE_APPS_COMPARE_REPORT_IMAGE_H_
#define CIRCLINE_APPS_COMPARE_REPORT_IMAGE_H_

#include <string>
#include <vector>

#include "apps/compare/record.h"

namespace circline::apps {

// What was found, every hypothesis of the solvers in `keys` and of the answer shown, and why the
// others refused. `picture` is the
// overlay as JPEG (may be empty), `why` as SelectImages says.
std::string ImageSection(const ImageRecord& record, const std::vector<SolverKey>& keys,
                         const std::string& picture, const std::string& why);

// What the colours of the overlays mean.
std::string OverlayLegend();

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_REPORT_IMAGE_H_
