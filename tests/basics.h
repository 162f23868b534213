// What tests of every room need.
#ifndef CIRCLINE_TESTS_BASICS_H_
#define CIRCLINE_TESTS_BASICS_H_

#include <Eigen/Core>
#include <algorithm>
#include <stdexcept>
#include <string>

#include "circline/estimators/random.h"

#define EXPECT_CONTAINS(text, part) EXPECT_PRED_FORMAT2(testing::IsSubstring, part, text)

namespace circline {

// Of both coordinates of a pixel.
inline Eigen::Vector2d Noise2(double sigma, Random* random) {
  const double x = random->Normal(), y = random->Normal();
  return {sigma * x, sigma * y};
}

inline Eigen::Vector3d Noise3(double sigma, Random* random) {
  const double x = random->Normal(), y = random->Normal(), z = random->Normal();
  return {sigma * x, sigma * y, sigma * z};
}

// A result that the test needs: where it was refused, that is why the test fails.
template <typename Result>
Result Ok(Result result) {
  if (!result.status.ok()) throw std::runtime_error(result.status.message);
  return result;
}

template <typename Result>
bool HasNote(const Result& result, const std::string& words) {
  return std::any_of(result.notes.begin(), result.notes.end(), [&](const std::string& note) {
    return note.find(words) != std::string::npos;
  });
}

}  // namespace circline

#endif  // CIRCLINE_TESTS_BASICS_H_
