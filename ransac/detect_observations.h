// Has moved; this one goes with the next version.
#ifndef CIRCLINE_RANSAC_DETECT_OBSERVATIONS_H_
#define CIRCLINE_RANSAC_DETECT_OBSERVATIONS_H_

#include "circline/ransac/detection/detect_observations.h"

#endif  // CIRCLINE_RANSAC_DETECT_OBSERVATIONS_H_
