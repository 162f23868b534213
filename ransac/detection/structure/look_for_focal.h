// A photo looked at through a camera whose focal length is a guess. Internal: not installed, but
// exported, for circline_simulate.
#ifndef CIRCLINE_RANSAC_DETECTION_STRUCTURE_LOOK_FOR_FOCAL_H_
#define CIRCLINE_RANSAC_DETECTION_STRUCTURE_LOOK_FOR_FOCAL_H_

#include <functional>

#include "circline/estimators/export.h"
#include "circline/ransac/detection/structure/observe_evidence.h"

namespace CIRCLINE_EXPORT circline {

// What is found in the photo through a camera.
using CollectEvidenceFn = std::function<PhotoEvidence(const Camera&)>;

// Moves the camera of `observations`, which has it as it is guessed, to the focal length at which
// the photo's structure is likeliest, and returns the evidence seen through that: what is found is
// straight and round at one focal length, so another one is looked through where it is clearly
// likelier. Where looks lead back to an earlier one, the one that is contradicted least.
PhotoEvidence LookForFocal(const CollectEvidenceFn& collect, const DetectionOptions& options,
                           double diagonal_px, Observations* observations);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_STRUCTURE_LOOK_FOR_FOCAL_H_
