// How large sums of squares get by chance, and what is in the middle. Internal: not installed.
#ifndef CIRCLINE_ESTIMATORS_STATISTICS_H_
#define CIRCLINE_ESTIMATORS_STATISTICS_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace circline {

// A chi-square variable of `dof` degrees of freedom exceeds this with probability p (Wilson and
// Hilferty 1931; p by the tail of a Gaussian, good to 1 % from 1e-3 to 1e-9).
inline double ChiSquareLimit(int dof, double p) {
  const double t = std::sqrt(-2.0 * std::log(p));
  const double z = t - (2.515517 + 0.802853 * t + 0.010328 * t * t) /
                           (1.0 + 1.432788 * t + 0.189269 * t * t + 0.001308 * t * t * t);
  const double n = dof, h = 2.0 / (9.0 * n);
  const double root = 1.0 - h + z * std::sqrt(h);
  return n * root * root * root;
}

// The larger one in the middle of an even number; 0 of none.
inline double Median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_STATISTICS_H_
