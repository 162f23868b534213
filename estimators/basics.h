// Numbers and signs that the formulas of every room need.
#ifndef CIRCLINE_ESTIMATORS_BASICS_H_
#define CIRCLINE_ESTIMATORS_BASICS_H_

#include <Eigen/Core>

#include "circline/estimators/export.h"

namespace CIRCLINE_EXPORT circline {

inline constexpr double kPi = 3.14159265358979323846;     // Half a turn in radians.
inline constexpr double kRightAngle = 0.5 * kPi;          // In radians.
inline constexpr double kDegree = kPi / 180.0;            // In radians.
inline constexpr double kSqrt2 = 1.41421356237309504880;  // Of symmetric matrices as vectors.

// Twice the signed area of the triangle (0, a, b).
inline double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_BASICS_H_
