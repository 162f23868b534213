// A small seeded generator whose numbers are the same on every platform and standard library.
#ifndef CIRCLINE_ESTIMATORS_RANDOM_H_
#define CIRCLINE_ESTIMATORS_RANDOM_H_

#include <cmath>
#include <cstdint>

#include "circline/estimators/basics.h"
#include "circline/estimators/export.h"

namespace CIRCLINE_EXPORT circline {

// SplitMix64 (Steele, Lea, Flood 2014): 8 bytes of state, passes BigCrush, 1 ns a draw.
class Random {
 public:
  // Any seed will do, 0 too.
  explicit Random(std::uint64_t seed) : state_(seed) {}

  // All 64 bits at random.
  std::uint64_t Next() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ULL);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31);
  }
  // In [0, n), n > 0; bias below n / 2^32.
  int UniformInt(int n) {
    return static_cast<int>(((Next() >> 32) * static_cast<std::uint64_t>(n)) >> 32);
  }
  // In [0, 1).
  double Uniform() { return static_cast<double>(Next() >> 11) * 0x1.0p-53; }
  // In [low, high), to rounding.
  double Uniform(double low, double high) { return low + (high - low) * Uniform(); }
  // Standard normal (Box-Muller, one of the two values).
  double Normal() {
    const double u = 1.0 - Uniform();
    return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * kPi * Uniform());
  }

 private:
  std::uint64_t state_;
};

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_RANDOM_H_
