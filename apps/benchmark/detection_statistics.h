// Times and order statistics of the tables of detection.
#ifndef CIRCLINE_APPS_BENCHMARK_DETECTION_STATISTICS_H_
#define CIRCLINE_APPS_BENCHMARK_DETECTION_STATISTICS_H_

#include <ctime>
#include <vector>

namespace circline::benchmark {

// Processor time, which other work on the machine does not lengthen; there is one thread only.
double Milliseconds(std::clock_t since);

// Of a list that is sorted here; NaN where it is empty.
double Quantile(std::vector<double> values, double q);

}  // namespace circline::benchmark

#endif  // CIRCLINE_APPS_BENCHMARK_DETECTION_STATISTICS_H_
