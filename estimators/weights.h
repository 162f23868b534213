// Optional weights of points and lines. Internal: not installed.
#ifndef CIRCLINE_ESTIMATORS_WEIGHTS_H_
#define CIRCLINE_ESTIMATORS_WEIGHTS_H_

#include <cstddef>
#include <vector>

namespace circline {

// Of item i; 1 where there are no weights.
inline double WeightAt(const std::vector<double>* weights, std::size_t i) {
  return weights == nullptr ? 1.0 : (*weights)[i];
}

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_WEIGHTS_H_
