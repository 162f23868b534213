// Samples for the robust estimator, the same on every machine.
#ifndef CIRCLINE_RANSAC_SAMPLER_H_
#define CIRCLINE_RANSAC_SAMPLER_H_

#include <cstdint>
#include <vector>

#include "circline/estimators/random.h"

namespace circline {

// A permutation of 0..n-1, the same on every machine.
std::vector<int> RandomOrder(int n, std::uint64_t seed);

// Draws samples: uniform, or, given an order of decreasing quality, from a growing set of the best
// (PROSAC) that ends as the uniform one.
class Sampler {
 public:
  // `order` (optional) must outlive the sampler; after `uniform_after` draws it plays no part (T_N
  // of the paper).
  void Reset(int num_data, int num_samples, std::uint64_t seed, const std::vector<int>* order,
             int uniform_after = 200000);
  void Draw(int* sample);
  // `count` distinct numbers of 0..n-1.
  void DrawFrom(int n, int count, int* sample);

 private:
  Random random_{0};
  int num_data_ = 0, num_samples_ = 0;
  const std::vector<int>* order_ = nullptr;
  int draw_ = 0, pool_ = 0, pool_until_ = 0;  // Draw number; size of the pool; last draw from it.
  double pool_draws_ = 0.0;                   // Expected draws from the pool (T_n of the paper).
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_SAMPLER_H_
