// Which loss at which scale serves these photos best.
#ifndef CIRCLINE_APPS_COMPARE_SWEEP_H_
#define CIRCLINE_APPS_COMPARE_SWEEP_H_

#include <set>
#include <string>
#include <vector>

#include "apps/compare/summary.h"

namespace circline::apps {

// One loss with one scale.
struct LossPoint {
  std::string loss;
  double scale_px = 0.0;  // 0 = auto.
};

// In the order of the rows; a sweep has two or more.
std::vector<LossPoint> LossPoints(const Summary& summary);

// The names of the solvers that have a refined answer to some photo, in the order of the rows.
std::vector<std::string> RefinedSolvers(const Summary& summary);

// Null if there is no such row.
const SummaryRow* FindRefined(const Summary& summary, const std::string& solver,
                              const LossPoint& point);

// The best row of a solver, or of all where `solver` is empty. Of rows that answer at least nine
// tenths as many photos as the one that answers most: where there is a truth the smallest median
// error, then the smallest mean. Without a truth the largest mean share of inliers (to the percent:
// a loss that throws half of the points away has small residuals, too), then the smallest median
// residual. Null if nothing was answered.
const SummaryRow* BestRow(const Summary& summary, const std::string& solver = "");

// The rows that tables and plots show beside those of the sweep: all but those with a loss and
// scale that are not their solver's best.
std::set<const SummaryRow*> RowsToShow(const Summary& summary);

// "joint refined, tukey 0.5: median error 0.12 degrees in 26 of 26 images".
std::string DescribeRow(const SummaryRow& row);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_SWEEP_H_
