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

// `count` distinct numbers of 0..n-1, all alike; `count` is n at most.
void DrawSample(int n, int count, Random* random, int* sample);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_SAMPLER_H_
