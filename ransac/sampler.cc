#include "circline/ransac/sampler.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

namespace circline {
namespace {

// Expected number, of `draws` samples of m from n_all, that lie within the n best (T_n of PROSAC).
double PoolDraws(int n, int n_all, int m, double draws) {
  for (int i = 0; i < m; ++i) draws *= static_cast<double>(n - i) / (n_all - i);
  return draws;
}

}  // namespace

std::vector<int> RandomOrder(int n, std::uint64_t seed) {
  std::vector<int> order(static_cast<std::size_t>(std::max(n, 0)));
  std::iota(order.begin(), order.end(), 0);
  Random random(seed);
  for (int i = n - 1; i > 0; --i) {
    std::swap(order[static_cast<std::size_t>(i)],
              order[static_cast<std::size_t>(random.UniformInt(i + 1))]);
  }
  return order;
}

void Sampler::Reset(int num_data, int num_samples, std::uint64_t seed,
                    const std::vector<int>* order, int uniform_after) {
  random_ = Random(seed);
  num_data_ = num_data;
  num_samples_ = num_samples;
  order_ = order;
  draw_ = 0;
  pool_ = num_samples;
  pool_until_ = 1;
  pool_draws_ = order != nullptr && num_data >= num_samples
                    ? PoolDraws(pool_, num_data, num_samples, uniform_after)
                    : 0.0;
}

void Sampler::DrawFrom(int n, int count, int* sample) {
  for (int i = 0; i < count; ++i) {
    bool repeated = true;
    while (repeated) {
      sample[i] = random_.UniformInt(n);
      repeated = std::find(sample, sample + i, sample[i]) != sample + i;
    }
  }
}

void Sampler::Draw(int* sample) {
  if (order_ == nullptr) return DrawFrom(num_data_, num_samples_, sample);
  ++draw_;
  // Equation 3 and step 1 of algorithm 1 of Chum and Matas: the pool grows by one datum each time
  // as many samples have been drawn from it as uniform sampling would have.
  while (draw_ > pool_until_ && pool_ < num_data_) {
    const double next = pool_draws_ * (pool_ + 1) / (pool_ + 1 - num_samples_);
    pool_until_ += static_cast<int>(std::ceil(next - pool_draws_));
    pool_draws_ = next;
    ++pool_;
  }
  if (draw_ > pool_until_) {
    DrawFrom(num_data_, num_samples_, sample);
  } else {
    // The newest datum of the pool and others of it (step 2): no sample is drawn twice for long.
    DrawFrom(std::max(pool_ - 1, num_samples_ - 1), num_samples_ - 1, sample);
    sample[num_samples_ - 1] = pool_ - 1;
  }
  for (int i = 0; i < num_samples_; ++i) sample[i] = (*order_)[static_cast<std::size_t>(sample[i])];
}

}  // namespace circline
