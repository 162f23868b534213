// When a model is better supported than chance explains.
#ifndef CIRCLINE_RANSAC_FALSE_ALARMS_H_
#define CIRCLINE_RANSAC_FALSE_ALARMS_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace circline {

// Natural logarithm of the number of models with so many inliers to be expected among unrelated
// data (number of false alarms; Desolneux, Moisan, Morel, IJCV 2000): the samples of `sample_size`
// that propose one, times the tail of the Poisson distribution (Chernoff's bound) for all inliers
// but those of the sample. `expected`: inliers by chance.
inline double LogFalseAlarms(std::size_t num_data, int sample_size, double expected,
                             std::size_t num_inliers) {
  double log_samples = 0.0;
  for (int i = 0; i < sample_size; ++i) {
    const double left = static_cast<double>(num_data) - i;
    log_samples += std::log(std::max(1.0, left) / (i + 1.0));
  }
  log_samples = std::max(0.0, log_samples);
  const double k = static_cast<double>(num_inliers) - sample_size;
  if (!(k > expected)) return log_samples;
  if (!(expected > 0.0)) return -std::numeric_limits<double>::max();
  return log_samples + k - expected - k * std::log(k / expected);
}

}  // namespace circline

#endif  // CIRCLINE_RANSAC_FALSE_ALARMS_H_
