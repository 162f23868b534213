// The chapters of circline_robust_fit_benchmark's table.
#ifndef CIRCLINE_APPS_BENCHMARK_ROBUST_FIT_ROWS_H_
#define CIRCLINE_APPS_BENCHMARK_ROBUST_FIT_ROWS_H_

namespace circline::apps {

void RunConics();    // One ellipse among outliers of many kinds.
void RunContours();  // The same through FitObservations, and what only that decides.
void RunLines();
void RunPencils();  // Three orthogonal directions among clutter.

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_ROBUST_FIT_ROWS_H_
