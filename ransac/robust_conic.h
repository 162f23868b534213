// A robust ellipse through contour points, and a second one through what it leaves out.
#ifndef CIRCLINE_RANSAC_ROBUST_CONIC_H_
#define CIRCLINE_RANSAC_ROBUST_CONIC_H_

#include <cstdint>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic_fit.h"
#include "circline/estimators/export.h"
#include "circline/estimators/status.h"
#include "circline/ransac/conic_model.h"
#include "circline/ransac/ransac.h"

namespace CIRCLINE_EXPORT circline {

// The ellipse that the points support best, as a maximum-likelihood fit of its inliers with
// covariance; options.ransac.threshold in pixels of the photo. `mask` (optional) receives one value
// per point, 1 where the returned ellipse passes within the threshold (and along the point's edge,
// where directions are given). Refuses fewer than five points, and points that no ellipse explains:
// one with a semi-minor axis of 2 px or more, along 30 degrees of it or more, and better than a
// straight line. Refuses what is no better than chance, too: an ellipse that leaves points out,
// where one as good or more is expected among clutter as dense as these (Desolneux, Moisan, Morel,
// IJCV 2000). `fit` and `mask` are written only if the status is ok.
//
// `directions` (none if empty) are those of the edge at the points: samples are then of three
// points instead of five, and clutter with another direction has no say. They choose the points;
// the fit is one of positions.
//
// How good: 100 points of a full contour, sigma 1 px, uniform clutter: error over the Cramer-Rao
// bound of the inliers (median; 0.93 is a perfect estimator's) 0.95 at 30 % outliers, 0.98 at 50,
// 1.01 at 70, none lost; with directions good to 5 degrees 0.93, 0.93, 0.94. Among 70 % outliers a
// quarter or half of a contour is found in 99 of 100 trials, among 90 % a full one in 99; with
// directions in all. An ellipse, an edge or a blob among the clutter does not distract while it has
// less than 45, 70 and 70 % of the points. 0.09 ms at 30 % outliers, 0.25 at 50, 2.5 at 70 (with
// directions 0.8), 42 at 90 (6.5). apps/benchmark/robust_fit_benchmark.cc measures it.
Status FitConicRobust(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
                      ConicFit* fit, std::vector<std::uint8_t>* mask = nullptr,
                      const EdgeDirections& directions = {});

// The same from an ellipse that is already near (tracked, predicted): its inliers, reweighted, and
// no search, nor whether chance explains it.
Status RefitConicRobust(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
                        const Eigen::Matrix3d& initial, ConicFit* fit,
                        std::vector<std::uint8_t>* mask = nullptr,
                        const EdgeDirections& directions = {});

// A second ellipse through points that `first` leaves out by more than twice the threshold: a
// second rim, a neighbour. Refuses what is no better than chance: where one as good or more is
// expected in a hundred sets of as many stray points, or the points are a blob. 500 draws at the
// most, 0.2 ms: it is found where it has a third of what is left (a sixth with directions).
Status FitSecondConic(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
                      const Eigen::Matrix3d& first, ConicFit* fit,
                      std::vector<std::uint8_t>* mask = nullptr,
                      const EdgeDirections& directions = {});

}  // namespace circline

#endif  // CIRCLINE_RANSAC_ROBUST_CONIC_H_
