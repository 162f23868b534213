// Lengths of a box, and how well circles agree with it, each with its standard deviation.
#ifndef CIRCLINE_APPS_RECONSTRUCT_MEASURE_BOX_H_
#define CIRCLINE_APPS_RECONSTRUCT_MEASURE_BOX_H_

#include <vector>

#include "apps/reconstruct/fit_box.h"
#include "apps/reconstruct/measurements.h"
#include "circline/estimators/observations.h"
#include "circline/refine/estimate_pose.h"

namespace circline::apps {

// The lengths of the box's edges and their ratios; the distance of the camera from its origin,
// where a length is known; for each circle of `observations` the angle between its normal, from the
// circle alone, and the box's axes, from its edges alone ("agreement"): the least over the poses
// that the circle leaves and the three axes.
std::vector<MeasuredValue> MeasureBox(const BoxFit& fit, const BoxObservation& box,
                                      const Observations& observations,
                                      const EstimationOptions& options);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_MEASURE_BOX_H_
