// How exact the world of a photo is, beside the figures of its NoiseModel. Internal: not installed,
// but shown to circline_refine.
#ifndef CIRCLINE_ESTIMATORS_EXACTNESS_H_
#define CIRCLINE_ESTIMATORS_EXACTNESS_H_

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/export.h"
#include "circline/estimators/noise_model.h"

namespace CIRCLINE_EXPORT circline {

// One misfit d^2, its degrees of freedom, and the share of imperfections: their variance over that
// of the points' own noise.
struct Misfit {
  double d2, dof, share;
};

// The scale s of the standard deviations of all imperfections: d^2 (1 + share) / (1 + s^2 share) is
// chi-square with dof degrees of freedom; log s has a Gaussian prior of deviation `spread`, and s
// is at most `most`. The root of the posterior mean of s^2, which few misfits leave above its mode;
// 1 where there is no spread.
double ExpectedScale(const Misfit* misfits, std::size_t num_misfits, double spread, double most);

// How irregular a contour is (ConicFit::irregularity): the scale of what its pieces of
// NoiseModel::correlation_px miss its ellipse by, against NoiseModel::contour_px. An oval itself
// shows in no contour, as its image is an ellipse, too; but what is turned or printed is as exact
// all around as it is round, and of a thick or sawn rim both are off. 1 where the model has no
// circle_shape to scale.
double Irregularity(const std::vector<CalibratedPoint>& points, const Eigen::Matrix3d& conic,
                    const NoiseModel& noise);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_EXACTNESS_H_
