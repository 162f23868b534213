// The measurements that circline_reconstruct writes.
#ifndef CIRCLINE_TESTS_APPS_MEASURED_ROWS_H_
#define CIRCLINE_TESTS_APPS_MEASURED_ROWS_H_

#include <map>
#include <string>

namespace circline::apps {

// A row of measurements.csv; truth and relative error 0 where it has none.
struct MeasuredRow {
  double value = 0.0, sigma = 0.0, truth = 0.0, relative_error = 0.0;
  std::string unit;
};
// By what was measured and its id: "length carton x".
std::map<std::string, MeasuredRow> ReadMeasurements(const std::string& path);

}  // namespace circline::apps

#endif  // CIRCLINE_TESTS_APPS_MEASURED_ROWS_H_
