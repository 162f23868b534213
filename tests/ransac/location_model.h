// The simplest model of the robust engine, for the tests of the engine itself.
#ifndef CIRCLINE_TESTS_RANSAC_LOCATION_MODEL_H_
#define CIRCLINE_TESTS_RANSAC_LOCATION_MODEL_H_

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "circline/estimators/random.h"
#include "circline/ransac/sampler.h"

namespace circline {

// The location of scalars: two equal enough ones make a sample, their mean the model. It keeps a
// record of how it was called.
class Location {
 public:
  using Value = std::array<double, 1>;
  static constexpr int kMinSamples = 2;

  explicit Location(std::vector<double> data) : data_(std::move(data)) {}

  int NumData() const { return static_cast<int>(data_.size()); }
  bool Fit(const int* sample, Value* value) const {
    ++fits_;
    if (always_degenerate_) return false;
    const double a = Datum(sample[0]), b = Datum(sample[1]);
    EXPECT_NE(sample[0], sample[1]);
    const bool all_inliers = std::abs(a) < 10.0 && std::abs(b) < 10.0;
    if (all_inliers && first_good_ == 0) first_good_ = fits_;
    *value = {0.5 * (a + b)};
    return std::abs(a - b) < 10.0;
  }
  void SquaredResiduals(const Value& value, int begin, int end, float* r2) const {
    for (int i = begin; i < end; ++i) {
      const double r = Datum(i) - value[0];
      *r2++ = static_cast<float>(r * r);
    }
  }
  bool Refine(const float* weights, Value* value) const {
    double sum = 0.0, mean = 0.0;
    for (int i = 0; i < NumData(); ++i) {
      const double w = static_cast<double>(weights[i]);
      sum += w;
      mean += w * Datum(i);
    }
    if (!(sum > 0.0)) return false;
    *value = {mean / sum};
    return true;
  }
  bool Accept(const Value& value, double /*threshold*/) const { return value[0] < accept_below_; }

  double Datum(int i) const { return data_[static_cast<std::size_t>(i)]; }

  bool always_degenerate_ = false;
  double accept_below_ = std::numeric_limits<double>::infinity();
  mutable int fits_ = 0, first_good_ = 0;

 private:
  std::vector<double> data_;
};

// `inliers` values about 0 with standard deviation `sigma`, the rest 100 apart from each other.
inline Location MakeData(int n, int inliers, double sigma) {
  const std::vector<int> position = RandomOrder(n, 7);
  std::vector<double> data(static_cast<std::size_t>(n));
  Random random(3);
  for (int i = 0; i < n; ++i) {
    data[static_cast<std::size_t>(position[static_cast<std::size_t>(i)])] =
        i < inliers ? sigma * random.Normal() : 100.0 * (i + 1);
  }
  return Location(data);
}

}  // namespace circline

#endif  // CIRCLINE_TESTS_RANSAC_LOCATION_MODEL_H_
