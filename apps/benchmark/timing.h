// Times and order statistics of the tables.
#ifndef CIRCLINE_APPS_BENCHMARK_TIMING_H_
#define CIRCLINE_APPS_BENCHMARK_TIMING_H_

#include <algorithm>
#include <cmath>
#include <ctime>
#include <vector>

namespace circline::apps {

// Milliseconds that `work` takes of processor time, which other work on the machine does not
// lengthen; there is one thread only.
template <typename Work>
double Milliseconds(const Work& work) {
  const std::clock_t start = std::clock();
  work();
  return 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

// NaN where there are no values.
inline double Quantile(std::vector<double> values, double q) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_TIMING_H_
