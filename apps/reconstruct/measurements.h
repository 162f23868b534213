// Lengths, angles, heights and radii of what one photo shows, each with its standard deviation.
#ifndef CIRCLINE_APPS_RECONSTRUCT_MEASUREMENTS_H_
#define CIRCLINE_APPS_RECONSTRUCT_MEASUREMENTS_H_

#include <string>
#include <vector>

#include "apps/reconstruct/fit_box.h"
#include "apps/reconstruct/model.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/refine/estimate_pose.h"

namespace circline::apps {

struct MeasuredValue {
  // "length", "ratio", "angle", "radius", "height", "distance", "agreement".
  std::string what;
  std::string id;  // Of what it was measured.
  double value = 0.0;
  double sigma = 0.0;
  // "world" (that of the known radius or length), "distance", "deg"; "" of ratios.
  std::string unit;
  double truth = 0.0;  // 0 = not known.
};

// Of the plane: the segments of its pencils, the pairs of points of `known.length`, the angles
// between pencils, each by its own lines alone, the circles' radii; the heights of the upright
// edges and of cylinders; the distance of the camera from the plane. Standard deviations are
// first-order, of the pose and of the points, taken as independent: `point_sigma_px` is that of
// each coordinate where a line and its pencil state none.
std::vector<MeasuredValue> Measure(const Observations& observations,
                                   const PoseHypothesis& hypothesis, const Model& model,
                                   double point_sigma_px);

// The lengths of the box's edges and their ratios; the distance of the camera from its origin,
// where a length is known; for each circle of `observations` the angle between its normal, from the
// circle alone, and the box's axes, from its edges alone ("agreement"): the least over the poses
// that the circle leaves and the three axes.
std::vector<MeasuredValue> MeasureBox(const BoxFit& fit, const BoxObservation& box,
                                      const Observations& observations,
                                      const EstimationOptions& options);

// what,id,value,sigma,unit,truth,relative_error; the last two are empty where no truth is known.
std::string MeasurementsCsv(const std::vector<MeasuredValue>& measurements);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_MEASUREMENTS_H_
