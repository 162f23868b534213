#include "circline/estimators/focal_length.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/estimators/focal_roots.h"

namespace circline {
namespace {

bool IsAtInfinity(const VanishingPointFit& point) {
  return std::abs(point.direction.z()) <= std::max(kRounding, std::sqrt(point.covariance(2, 2)));
}

// F^2 of two directions at an angle, (a1, a2, angle): with points scaled to third coordinate 1,
// d = a1.a2, n_i = a_i.a_i, k = cos^2: (1 - k) F^2 + 2 (d - k (n1 + n2) / 2) F + d^2 - k n1 n2 = 0,
// whose discriminant is k times what follows.
FocalRoots AtAngle(const Vector<7>& z) {
  if (!(std::abs(z[2] * z[5]) > 0.0)) return FocalRoots(FocalRefusal::kAtInfinity);
  const Eigen::Vector2d a = z.segment<2>(0) / z[2], b = z.segment<2>(3) / z[5];
  const double d = a.dot(b), n1 = a.squaredNorm(), n2 = b.squaredNorm();
  const double cosine = std::cos(z[6]), k = cosine * cosine;
  const double sine2 = std::sin(z[6]) * std::sin(z[6]);
  if (!(sine2 > kRounding)) return FocalRoots(FocalRefusal::kParallel);
  const double inside = a.dot(a - b) * b.dot(b - a) + 0.25 * k * (n1 - n2) * (n1 - n2);
  constexpr double kRight = 1e-6;  // Cosine of a right angle: both roots are one.
  const bool is_right = std::abs(cosine) < kRight;
  if (!is_right && !(inside >= 0.0)) return FocalRoots(FocalRefusal::kNoAngle);
  const double middle = 0.5 * k * (n1 + n2) - d, half = cosine * std::sqrt(std::fmax(0.0, inside));
  FocalRoots roots;
  roots.Add((middle + half) / sine2);
  if (!is_right) roots.Add((middle - half) / sine2);
  return roots;
}

}  // namespace

const char* FocalRefusalSentence(FocalRefusal why) {
  constexpr const char* kOpen =
      "the evidence leaves the focal length open by more than a factor of 2.7 (little tilt, small "
      "circles, or lines along the axis of tilt)";
  constexpr const char* kSentences[] = {
      "",
      "an input is not finite",
      "a conic is not an ellipse",
      "a vanishing point lies at infinity within its uncertainty",
      "the two directions are parallel",
      "no focal length makes the angle between the directions",
      "the square of the focal length would not be positive",
      "the plane is seen frontally: its vanishing line lies at infinity",
      "the vanishing line would meet the circle",
      "the two circles coincide, or have one centre",
      "one circle and no direction of its plane leave the focal length open",
      "no focal length within the range explains the plane best",
      kOpen};
  return kSentences[static_cast<std::size_t>(why)];
}

int FocalFromVanishingPoints(const VanishingPointFit& a, const VanishingPointFit& b, double angle,
                             double angle_sigma, std::array<FocalSolution, 2>* solutions,
                             FocalRefusal* why) {
  if (IsAtInfinity(a) || IsAtInfinity(b)) return RefuseFocal(FocalRefusal::kAtInfinity, why);
  FocalInputs<7> inputs;
  inputs.SetPoint(0, a.direction, a.covariance);
  inputs.SetPoint(3, b.direction, b.covariance);
  inputs.z[6] = angle;
  inputs.covariance(6, 6) = angle_sigma * angle_sigma;
  return FocalSolutionsOf<7>(AtAngle, inputs, solutions->data(), why);
}

int FocalFromThreeVanishingPoints(const std::array<VanishingPointFit, 3>& directions,
                                  double angle_sigma, FocalSolution* solution, FocalRefusal* why) {
  FocalInputs<12> inputs;  // The points, and the angle opposite to each.
  for (int i = 0; i < 3; ++i) {
    const VanishingPointFit& v = directions[static_cast<std::size_t>(i)];
    inputs.SetPoint(3 * i, v.direction, v.covariance);
    inputs.z[9 + i] = kRightAngle;
    inputs.covariance(9 + i, 9 + i) = angle_sigma * angle_sigma;
  }
  return CombinedSolution<3>(
      [](const Vector<12>& z) {
        std::array<FocalRoots, 3> roots;
        for (int i = 0; i < 3; ++i) {
          Vector<7> pair;
          pair << z.segment<3>(3 * ((i + 1) % 3)), z.segment<3>(3 * ((i + 2) % 3)), z[9 + i];
          roots[static_cast<std::size_t>(i)] = AtAngle(pair);
        }
        return roots;
      },
      inputs, solution, why);
}

}  // namespace circline
