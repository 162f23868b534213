// When a model is better supported than chance explains.
#ifndef CIRCLINE_RANSAC_FALSE_ALARMS_H_
#define CIRCLINE_RANSAC_FALSE_ALARMS_H_

#include <cstddef>

namespace circline {

// Natural logarithm of the number of models with so many inliers to be expected among unrelated
// data (number of false alarms; Desolneux, Moisan, Morel, IJCV 2000): the samples of `sample_size`
// that propose one, times the tail of the Poisson distribution (Chernoff's bound) for all inliers
// but those of the sample. `expected`: inliers by chance.
double LogFalseAlarms(std::size_t num_data, int sample_size, double expected,
                      std::size_t num_inliers);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_FALSE_ALARMS_H_
