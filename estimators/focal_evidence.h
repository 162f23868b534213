// What the fits of one photo say of its focal length, each part of the evidence for itself.
// Internal: not installed.
#ifndef CIRCLINE_ESTIMATORS_FOCAL_EVIDENCE_H_
#define CIRCLINE_ESTIMATORS_FOCAL_EVIDENCE_H_

#include <string>
#include <vector>

#include "circline/estimators/focal_starts.h"

namespace circline {

// As FocalLengthStarts, with the fits as they are, in the order of the evidence. `observations`
// have a valid camera.
std::vector<FocalStart> FocalStartsOfFits(const Observations& observations, double sigma_px,
                                          const NoiseModel& noise,
                                          std::vector<std::string>* problems);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_FOCAL_EVIDENCE_H_
