#include "circline/ransac/detection/structure/judge_axes.h"

#include <algorithm>
#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/ransac/detection/lines/segment_meetings.h"
#include "circline/ransac/detection/structure/plane_angles.h"
#include "circline/ransac/detection/structure/structure_focal.h"

namespace circline {
namespace {

// The prior of the focal length is summed over so many of its standard deviations to either side.
constexpr double kSummedSigmas = 2.5;
// So much of the length of one of two pencils meets the other by accident; the odds that they are
// of one thing grow with this power of the share. On box-camprodon, where rooms behind the box meet
// it over a quarter, its own edges over two fifths and more, and chessboard-opencv, where all do;
// the other sets had no part in it.
constexpr double kAccidentalShare = 0.25, kPower = 4.0;
// Of things whose lines run two ways, how many have them square, others being tiled in diamonds or
// hexagons. All nine in the sets of docs/photographs.md that have two such directions in a plane do
// (six boards and sheets, two boxes, a town's house fronts): 10 of 11 by the rule of succession. No
// photo of tiles had a part in it.
constexpr double kSquareThings = 0.9;
// What is less likely adds 5 % to the deviation of a focal length that is guessed to 50 %, and a
// hypothesis to those of most photos.
constexpr double kSure = 0.99;

double Odds(const UncertainDirection& a, const UncertainDirection& b, const CameraError& camera) {
  return std::exp(RightAngle(a, b, camera).LogOdds());
}

// Of the first one's length that meets the second, as if one more of its lines did by accident.
double MeetingShare(const PlacedPencil& a, const PlacedPencil& b, double diagonal_px) {
  const double n = static_cast<double>(a.ends.size()),
               share = MeetingLength(a.ends, b.ends, diagonal_px) / a.support_px;
  return (n * share + kAccidentalShare) / (n + 1.0);
}

double ProbabilityOfOneThing(const PlacedPencil& a, const PlacedPencil& b, double diagonal_px) {
  const double share = std::max(MeetingShare(a, b, diagonal_px), MeetingShare(b, a, diagonal_px));
  const double odds = std::pow(share / kAccidentalShare, kPower);
  return odds / (1.0 + odds);
}

double Gaussian(double off) { return std::exp(-0.5 * off * off); }

double SureOr(double probability) { return probability > kSure ? 1.0 : probability; }

}  // namespace

void JudgeAxes(const AssemblyOptions& options, const PlacedPencil& x, PlacedPencil* y,
               PlacedPencil* z, const PlacedPencil* skew, double z_ratio) {
  const double square =
      kSquareThings * ProbabilityOfOneThing(x, *y, options.diagonal_px);  // Before any angle.
  // Summed over the focal lengths: all; those where x and y are square; of both those where z is
  // square to x and y, or shares one of the axes.
  double pairs = 0.0, corners = 0.0, all = 0.0, corner = 0.0, third = 0.0;
  double of_third = 0.0, looked_at = 0.0;  // Near the focal length at which z was looked for.
  constexpr double kSixth = kPi / 3.0;     // Of a turn: what hexagons have.
  constexpr double kAnyFocal = 3.0;        // Of log f: what is known less is not known at all.
  const double focal_sigma = std::min(options.focal_sigma, kAnyFocal);
  for (double off = -kSummedSigmas; off <= kSummedSigmas; off += kFocalStep / focal_sigma) {
    const double log_focal = options.prior_log_focal + off * focal_sigma;
    const CameraError camera{options.camera.middle_rad * std::exp(-log_focal), 0.0};
    const UncertainDirection a = Refocus(x.along, log_focal), b = Refocus(y->along, log_focal);
    const double weight = Gaussian(off);
    double is_corner = Odds(a, b, camera), is_lattice = 0.0;
    // Of things with one more direction in the plane, squares with a brace of any angle, squares
    // with their diagonals and lattices of three directions, of triangles or hexagons, are as
    // likely.
    if (skew != nullptr) {
      const UncertainDirection c = Refocus(skew->along, log_focal);
      is_corner += AnglesInPlane(a, b, c, camera, kRightAngle, 0.5 * kRightAngle);
      is_lattice = AnglesInPlane(a, b, c, camera, kSixth, 2.0 * kSixth);
    }
    is_corner *= weight * square;
    const double is_pair = is_corner + weight * (square * is_lattice + 1.0 - square);
    double of_z = 1.0;
    if (z != nullptr) {
      const UncertainDirection c = Refocus(z->along, log_focal);
      const double to_x = Odds(a, c, camera), to_y = Odds(b, c, camera);
      const double is_third = 0.5 * to_x * to_y;  // Half of the corners are square.
      of_z = is_third + 0.25 * (to_x + to_y);
      third += is_third * is_pair;
      const double near = Gaussian(log_focal / options.camera.log_focal);
      of_third += near * is_third;
      looked_at += near;
    }
    pairs += is_pair;
    corners += is_corner;
    all += is_pair * of_z;
    corner += is_corner * of_z;
  }
  // By accident z is where it was looked for, whatever the focal length.
  const double by_accident = looked_at > 0.0 ? of_third / (looked_at * z_ratio) : 0.0;
  all += by_accident * pairs;
  corner += by_accident * corners;
  if (!(all > 0.0)) return;
  y->observation.axis_probability = SureOr(corner / all);
  if (z != nullptr) z->observation.axis_probability = SureOr(third / all);
}

}  // namespace circline
