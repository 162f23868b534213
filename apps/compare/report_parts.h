// The parts of report.html; a table or plot is empty where there is nothing to show.
#ifndef CIRCLINE_APPS_COMPARE_REPORT_PARTS_H_
#define CIRCLINE_APPS_COMPARE_REPORT_PARTS_H_

#include <string>
#include <vector>

#include "apps/compare/agreement.h"
#include "apps/compare/record.h"
#include "apps/compare/summary.h"

namespace circline::apps {

// ---- Tables ----

std::string SummaryTable(const Summary& summary);

// A row and a column for each solver that answered together with some other.
std::string AgreementTable(const Agreement& agreement);

// A row for each loss and scale, a column for each solver, the best of each column marked.
std::string SweepTable(const Summary& summary);

// ---- Plots, each as a <div> with inline SVG ----

// Share of images within an error, a curve for each row: rotation, normal, direction where there is
// a truth, and the residual.
std::string CumulativePlots(const Summary& summary);

// For each solver: median error (or residual and share of inliers) against the scale, a curve for
// each loss; dashed: the estimated scale.
std::string SweepPlots(const Summary& summary);

// ---- Photos ----

// What was found, every hypothesis of the solvers in `keys` and of the answer shown, and why the
// others refused. `picture` is the overlay as JPEG (may be empty), `why` as SelectImages says.
std::string ImageSection(const ImageRecord& record, const std::vector<SolverKey>& keys,
                         const std::string& picture, const std::string& why);

// What the colours of the overlays mean.
std::string OverlayLegend();

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_REPORT_PARTS_H_
