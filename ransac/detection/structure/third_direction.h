// The direction at right angles to two others, and what lines say of it. Internal: not installed.
//
// Of a house's three directions the third often has few lines: too few to be told from accidents by
// themselves, enough where two others say where it is to be.
#ifndef CIRCLINE_RANSAC_DETECTION_STRUCTURE_THIRD_DIRECTION_H_
#define CIRCLINE_RANSAC_DETECTION_STRUCTURE_THIRD_DIRECTION_H_

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "circline/ransac/detection/structure/choose_plane.h"
#include "circline/ransac/detection/structure/line_odds.h"
#include "circline/ransac/detection/structure/pencil_fitter.h"
#include "circline/ransac/detection/structure/uncertain_direction.h"

namespace circline {

// Where the third one is, as houses are made. None where the two are nearly parallel.
std::optional<UncertainDirection> ThirdDirection(const UncertainDirection& a,
                                                 const UncertainDirection& b,
                                                 const CameraError& camera);

// What LinesAlong finds.
struct SharedDirection {
  double ratio = 0.0;  // Of the likelihoods that some lines share it, and that none do.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  // The likeliest.
};

// Whether some of the lines, any share of them, share a direction that is known to its covariance:
// the likelihood is summed over both.
SharedDirection LinesAlong(const std::vector<LineOdds>& lines, const UncertainDirection& expected);

// What FindThirdPencil finds.
struct ThirdPencil {
  DetectedPencil pencil;
  double ratio = 0.0;  // Of the likelihoods that lines share this direction, and that none do.
};

// The pencil of those of the lines that are of neither of two others and along the third direction;
// none where they are too few, or may be along it by accident.
std::optional<ThirdPencil> FindThirdPencil(const LineSet& set, const PlacedPencil& a,
                                           const PlacedPencil& b, const CameraError& camera);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_STRUCTURE_THIRD_DIRECTION_H_
