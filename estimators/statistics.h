// How large sums of squares get by chance, and what is in the middle. Internal: not installed.
#ifndef CIRCLINE_ESTIMATORS_STATISTICS_H_
#define CIRCLINE_ESTIMATORS_STATISTICS_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace circline {

// What is left of a chi-square variable's distribution beyond x: its probability and density.
struct ChiSquareTail {
  double probability, density;

  // Beyond 1 or 2 degrees of freedom by recurrence; up to some hundreds, where exp(-x / 2)
  // vanishes.
  ChiSquareTail(int dof, double x) {
    constexpr double kTwoOverRootPi = 1.12837916709551257;
    const double half = 0.5 * x;
    const bool is_even = dof % 2 == 0;
    probability = is_even ? std::exp(-half) : std::erfc(std::sqrt(half));
    double term = std::exp(-half) * (is_even ? half : kTwoOverRootPi * std::sqrt(half));
    for (int n = is_even ? 2 : 1; n < dof; n += 2) {
      probability += term;
      term *= half / (0.5 * n + 1.0);
    }
    density = 0.5 * term * dof / x;
  }
};

// A chi-square variable of `dof` degrees of freedom exceeds this with probability p, below 1/2:
// after Wilson and Hilferty (1931; 26 % too large at 1 degree of freedom and p = 1e-9, 0.3 % at
// 100), and Newton's steps on the logarithm of the tail.
inline double ChiSquareLimit(int dof, double p) {
  const double t = std::sqrt(-2.0 * std::log(p));
  const double z = t - (2.515517 + 0.802853 * t + 0.010328 * t * t) /
                           (1.0 + 1.432788 * t + 0.189269 * t * t + 0.001308 * t * t * t);
  const double n = dof, h = 2.0 / (9.0 * n);
  const double root = 1.0 - h + z * std::sqrt(h);
  double limit = n * root * root * root;
  constexpr int kExactUpTo = 100, kSteps = 3;
  for (int k = 0; k < kSteps && dof <= kExactUpTo; ++k) {
    const ChiSquareTail tail(dof, limit);
    limit += std::log(tail.probability / p) * tail.probability / tail.density;
  }
  return limit;
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
