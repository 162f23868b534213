// Where a refinement of an unknown focal length starts: the closed forms of focal_length.h,
// circle_focal.h and plane_focal.h on whatever of the evidence of one photo admits them.
#ifndef CIRCLINE_ESTIMATORS_FOCAL_STARTS_H_
#define CIRCLINE_ESTIMATORS_FOCAL_STARTS_H_

#include <string>
#include <vector>

#include "circline/estimators/export.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/observations.h"

namespace CIRCLINE_EXPORT circline {

// A focal length to start from.
struct FocalStart {
  double focal_px = 0.0;   // Of fx; fy keeps its ratio to it.
  double sigma_log = 0.0;  // Standard deviation of log focal length.
  std::string evidence;    // What says so, in words: "circle 'c0' and its centre".
};

// Every focal length that a part of the evidence admits, the surest first; of those that agree
// within their standard deviations the surest alone:
// - pencils along two or three of the axes, and pencils at known angles;
// - a circle and its centre: given, the origin, or where its diameters cross;
// - concentric circles;
// - circles of one plane, of any radii, of equal ones (`radius_group`) or of known ones, and
//   pencils of that plane, for fields of view of the photo's longer side from 10 to 120 degrees.
//
// `observations` are fitted (FitDirect, FitObservations) with a camera whose focal length is a
// guess; what has no fit is passed over. Principal point, aspect and distortion are taken as given.
// The coefficients of a distortion are those of calibrated coordinates: points are undistorted as
// the guess has it. Where there is one, `noise.camera.log_focal`, the guess's own uncertainty, is
// carried through fits at longer and shorter focal lengths; under strong distortion little more
// than the guess may be left.
//
// `noise` is the one of the fits; its sigmas of the principal point, of circles against their plane
// and of pencils against their axes count as well. `default_sigma_px`: of what states no sigma.
//
// `problems` (optional) receives a sentence for each part of the evidence that could not say.
// Empty where none could. 10 us for pencils and pairs of circles, 0.2 to 1.4 ms for a plane; three
// times that and two FitDirect where a lens bends and the guess is not sure.
std::vector<FocalStart> FocalLengthStarts(const Observations& observations, double default_sigma_px,
                                          const NoiseModel& noise = NoiseModel(),
                                          std::vector<std::string>* problems = nullptr);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_FOCAL_STARTS_H_
