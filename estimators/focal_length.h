// The unknown focal length of one photo in closed form, from two or three directions or from one or
// two circles of a plane: starts of a refinement. More circles, and pencils beside them, are in
// plane_focal.h.
//
// Coordinates: x = (u - p) / g, u an undistorted pixel, p the principal point, g any one length in
// pixels; square pixels. What is calibrated at a guessed focal length g is such: every ConicFit and
// VanishingPointFit of a camera that is a guess goes in as it is. Focal lengths come out in units
// of g: 1 says that the guess is right. With w = diag(1, 1, f^2), directions a and b are orthogonal
// where a^T w b = 0, and a plane's circular points m, in which its vanishing line meets the image
// of any of its circles, have m^T w m = 0: scaled to m = (a + ib, 1), f^2 = |b|^2 - |a|^2.
//
// Every function writes ALL solutions and returns how many; where that is 0, `why` (optional)
// receives the reason, which FocalRefusalSentence puts in words. A solution whose log f is open by
// more than a factor of e (one standard deviation) is none. All refuse what is not finite or no
// ellipse. Nothing allocates; calls on different data may run at once.
#ifndef CIRCLINE_ESTIMATORS_FOCAL_LENGTH_H_
#define CIRCLINE_ESTIMATORS_FOCAL_LENGTH_H_

#include <Eigen/Core>
#include <array>

#include "circline/estimators/export.h"
#include "circline/estimators/vanishing_point.h"

namespace CIRCLINE_EXPORT circline {

// One focal length that the inputs admit.
struct FocalSolution {
  double focal = 0.0;     // In units of g.
  double variance = 0.0;  // Of log focal, first order, from the covariances of the inputs alone.
  // d log focal / d p, per g: what the principal point's uncertainty adds.
  Eigen::Vector2d per_principal_point = Eigen::Vector2d::Zero();
  double chi2 = 0.0;  // Of the searches: what of the evidence contradicts the rest.
};

// Why there is none.
enum class FocalRefusal {
  kNone,
  kNotFinite,
  kNoEllipse,
  kAtInfinity,
  kParallel,
  kNoAngle,
  kNotPositive,
  kFrontal,
  kLineMeetsCircle,
  kSameCircle,
  kTooLittle,
  kOutOfRange,
  kUndetermined,
};
// The same in words, for people.
const char* FocalRefusalSentence(FocalRefusal why);

// Two directions that make `angle` (0 to pi, radians; they have no sense, so it and its supplement
// are the same) known to `angle_sigma`. Orthogonal: f^2 = -a.b, one solution. Else cos^2 = (f^2 +
// a.b)^2 / ((f^2 + a.a)(f^2 + b.b)), quadratic in f^2: up to two. Refuses a vanishing point at
// infinity (f cancels), an angle of 0, an angle that no f makes. 1 us.
int FocalFromVanishingPoints(const VanishingPointFit& a, const VanishingPointFit& b, double angle,
                             double angle_sigma, std::array<FocalSolution, 2>* solutions,
                             FocalRefusal* why = nullptr);

// Three directions, mutually orthogonal, each pair but for `angle_sigma` (the principal point is
// the orthocentre of their vanishing points): the mean log f of the three pairs that has the least
// variance, their common errors considered. One solution. One of the points may be at infinity, two
// not. 10 us.
int FocalFromThreeVanishingPoints(const std::array<VanishingPointFit, 3>& directions,
                                  double angle_sigma, FocalSolution* solution,
                                  FocalRefusal* why = nullptr);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_FOCAL_LENGTH_H_
