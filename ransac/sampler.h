// Samples for the robust estimator, the same on every machine.
#ifndef CIRCLINE_RANSAC_SAMPLER_H_
#define CIRCLINE_RANSAC_SAMPLER_H_

#include <cstdint>
#include <vector>

#include "circline/estimators/export.h"
#include "circline/estimators/random.h"

namespace CIRCLINE_EXPORT circline {

// A permutation of 0..n-1, the same on every machine.
std::vector<int> RandomOrder(int n, std::uint64_t seed);

// Draws samples without repetition, all alike.
class Sampler {
 public:
  // Samples of `num_samples` of `num_data` from here on, by a new seed.
  void Reset(int num_data, int num_samples, std::uint64_t seed);
  // The next of these.
  void Draw(int* sample) { DrawFrom(num_data_, num_samples_, sample); }
  // `count` distinct numbers of 0..n-1.
  void DrawFrom(int n, int count, int* sample);

 private:
  Random random_{0};
  int num_data_ = 0, num_samples_ = 0;
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_SAMPLER_H_
