// What is not exact beside the noise of single points: one struct of standard deviations, which
// everything that weighs, tests or reports uses (fits, gates, closed forms, refinement).
//
// Simulated evidence has point noise and nothing else: NoiseModel::Exact(). Photographs have more:
// prints bleed, sheets bend, walls lean, calibrations are a little off. The defaults are those of
// photographs, chosen between what discs (rgb), dots (visp36), a large circle, a street, a box and
// chessboards ask for; photographs of infrared discs, of a robot's dots, of ChArUco boards and of a
// turntable (but for circle_shape), and the harder halves of street and box had no part in it
// (apps/benchmark/coverage.py).
#ifndef CIRCLINE_ESTIMATORS_NOISE_MODEL_H_
#define CIRCLINE_ESTIMATORS_NOISE_MODEL_H_

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/export.h"
#include "circline/estimators/status.h"

namespace CIRCLINE_EXPORT circline {

// Residuals within this many standard deviations are inliers: 99.8 % of a Gaussian's.
constexpr double kInlierSigmas = 3.09;

// Of the figures that cameras write into their photos: placeholders.
constexpr double kDoubtfulShare = 0.1;

// How well a camera is known. Standard deviations; 0 = exact. The defaults are those of a good
// calibration.
struct CameraSigma {
  double log_focal = 0.002;         // Of log f, f the common factor of fx and fy.
  double log_aspect = 0.001;        // Of log (fy / fx).
  double principal_point_px = 1.0;  // Of each coordinate, pixels.
  double k1 = 0.0;                  // Of the first distortion coefficient.
  // Of log f where the figure given is a placeholder, as one in ten (kDoubtfulShare) of those that
  // cameras write into their photos is taken to be; 0: it is none.
  double doubtful_log_focal = 0.0;

  // A camera that is known exactly: all zero.
  static CameraSigma Exact() { return {0.0, 0.0, 0.0, 0.0, 0.0}; }
  // The wider of the two of log f: how far the focal length is to be looked for.
  double LargestLogFocal() const { return std::max(log_focal, doubtful_log_focal); }
  // Known so badly that the camera is an unknown of every refinement; known better it is only
  // counted in covariances.
  bool IsEstimated() const { return LargestLogFocal() >= 0.01; }
  // So badly that right angles may look wrong: the focal length is searched for.
  bool IsWide() const { return LargestLogFocal() >= 0.1; }
  // Nothing is known of the lens: how much it bends is looked for in the photo, whatever the focal
  // length, and k1 is that of the photo, over the focal length's square.
  bool IsLensOpen() const { return k1 >= 0.1; }
  // Whether this camera's lens bends a photo otherwise at another focal length: one that is known
  // does, and a fisheye's does in any case.
  bool BendsWithFocal(const Camera& camera) const;
  // Ok, or a sentence that names the field that is negative or not finite.
  Status Validate() const;
};

// Standard deviations, all >= 0; 0 = exact.
struct NoiseModel {
  // Error that neighbouring points of one contour or line share (blur, edge bias), pixels, and over
  // which length it stays the same, pixels: n points on a length L are worth no more than L /
  // correlation_px (and no less than one) that have this error.
  double contour_px = 0.12;
  double line_px = 0.1;
  double correlation_px = 50.0;
  // Offset that all contours of one contrast share (print bleed, exposure), pixels.
  double contour_offset_px = 0.1;
  // A circle's plane against the world's plane: tilt about each of two axes, radians, and height,
  // a share of the circle's radius.
  double circle_tilt_rad = 0.003;
  double circle_height = 0.003;
  // How far what is called a circle is out of round: each of the two components of an oval, a share
  // of its radius. Rims are thick and rounded, boards are sawn; what is printed is rounder, and its
  // contour more regular, by which this is scaled (ConicFit::irregularity). Between a turntable's
  // rim and discs (rgb), of 0.0015 to 0.004.
  double circle_shape = 0.0025;
  // A line against the direction of its pencil, and a wall's lines against the axis that they are
  // taken for (each of two components; LeanShape is what it makes of a pencil), radians.
  double line_direction_rad = 0.003;
  double pencil_axis_rad = 0.004;
  // A line of a grid of equal squares (a chessboard), or either coordinate of a circle's centre on
  // one, from its place, a share of the board's width: boards bend. Chosen on chessboard-opencv;
  // chessboard-charuco-robot had no part, nor had circles, whose centres are 0.0002 (tir) to 0.0009
  // (robot10x10) off.
  double grid_line = 0.0007;
  // A known radius or length that states no sigma of its own, relative.
  double radius = 0.001;
  double length = 0.001;
  CameraSigma camera;  // Of cameras of square pixels, where nothing else is said of them: SigmaOf.
  // Standard deviation, from photo to photo, of the logarithm of the figures of contours, and of
  // those of lines (shared error, tilt, height, deviation): some worlds are more exact than others,
  // and where a photo has many features they tell. 0: the figures are believed as they are.
  double spread = 1.0;

  // Nothing but the noise of points: for simulated evidence, and for bounds.
  static NoiseModel Exact();
  // Ok, or a sentence that names the field that is negative or not finite, or a correlation length
  // that is not positive.
  Status Validate() const;

  // `camera` as it holds for this one. Pixels that a calibration found not to be square are those
  // of analogue video, sampled and smeared along its lines, or the calibration is off by as much:
  // the aspect is known to |log (fy / fx)|, at most 0.02 (photos may be squeezed on purpose), if to
  // no less than camera.log_aspect; where that is 0 it is exact. Seen on dots (visp36), 0.014.
  CameraSigma SigmaOf(const Camera& taken_by) const;

  // What a feature of `num_points` points over a length of `length_px` counts, from 0 to 1, beside
  // one whose points share no error: sigma^2 / (sigma^2 + (n / m) shared^2), m = length /
  // correlation. Multiplies the sum of its squared residuals.
  double Weight(double shared_px, double sigma_px, double num_points, double length_px) const;
  // What residuals of this root mean square are worth as an estimate of their variance: so many
  // that share no error (Satterthwaite 1946).
  double Freedom(double shared_px, double rms_px, double num_points, double length_px) const;
  // Those of a contour, of a line: of those of their points, pixels, that are inliers (no mask:
  // all). The length is that of an ellipse with the points' box, which is right within a factor of
  // 2 for arcs, and the distance of the ends.
  double ContourWeight(double sigma_px, const std::vector<Eigen::Vector2d>& points,
                       const std::vector<std::uint8_t>& inliers) const;
  double LineWeight(double sigma_px, const std::vector<Eigen::Vector2d>& points,
                    const std::vector<std::uint8_t>& inliers) const;
  double ContourFreedom(double rms_px, const std::vector<Eigen::Vector2d>& points,
                        const std::vector<std::uint8_t>& inliers) const;
  double LineFreedom(double rms_px, const std::vector<Eigen::Vector2d>& points,
                     const std::vector<std::uint8_t>& inliers) const;
};

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_NOISE_MODEL_H_
