// The plots of report.html, each as a <div> with inline SVG; empty where there is nothing to show.
#ifndef CIRCLINE_APPS_COMPARE_REPORT_PLOTS_H_
#define CIRCLINE_APPS_COMPARE_REPORT_PLOTS_H_

#include <string>

#include "apps/compare/summary.h"

namespace circline::apps {

// Share of images within an error, a curve for each row: rotation, normal, direction where there is
// a truth, and the residual.
std::string CumulativePlots(const Summary& summary);

// For each solver: median error (or residual and share of inliers) against the scale, a curve for
// each loss; dashed: the estimated scale.
std::string SweepPlots(const Summary& summary);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_REPORT_PLOTS_H_
