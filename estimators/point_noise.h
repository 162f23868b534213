// How noisy the points of each feature are, where nobody states it.
#ifndef CIRCLINE_ESTIMATORS_POINT_NOISE_H_
#define CIRCLINE_ESTIMATORS_POINT_NOISE_H_

#include <vector>

#include "circline/estimators/export.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/observations.h"

namespace CIRCLINE_EXPORT circline {

// Standard deviations of each coordinate of a point, pixels of the photo; all positive.
struct PointNoise {
  double conic_px = 0.0, line_px = 0.0;    // Common to the circles, to the lines.
  std::vector<double> circles;             // By circle.
  std::vector<std::vector<double>> lines;  // By pencil, by line.
};

// Noise of contour points where nothing tells, pixels.
constexpr double kConicDefaultPx = 0.3;
// The same of lines' points.
constexpr double kLineDefaultPx = 0.4;

// A feature that states its noise has that. Any other has the scatter of its points about its own
// fit, shrunk towards the common noise of its kind; segments of two points have that of their
// pencil's segments about its vanishing point. The common noise is the median over the features,
// each counted by its degrees of freedom, shrunk towards the default, which is what a kind has
// where nothing is redundant; lines have that of the contours for a default where 20 contour points
// or more are redundant, worth ten residuals. Both priors are else worth one degree of freedom (a
// unit-information prior, Kass and Wasserman 1995): with 100 points, a circle that is four times as
// good as the others is given 1.09 times its noise. The square is the mean of the posterior: errors
// in these units have a variance of 1, few as the degrees of freedom f may be (Student's f / (f -
// 2)).
//
// Residuals that share an error (`model`) are fewer degrees of freedom (NoiseModel::Freedom).
//
// The scatter is fit->rms_px where the feature has an inlier mask (of kInlierSigmas); where
// it has none, outliers may be in force, and it is that of the points within three standard
// deviations, by the median absolute residual.
// 0.2 us a feature with a mask, 30 ns a point without (no lens distortion).
PointNoise MeasurePointNoise(const Observations& fitted,
                             const NoiseModel& model = NoiseModel::Exact(),
                             double conic_default_px = kConicDefaultPx,
                             double line_default_px = kLineDefaultPx);

// Makes it what the features state that state no noise of their own; of a kind with a figure of its
// own, `conic_px` or `line_px`, that.
void StateNoise(const PointNoise& noise, double conic_px, double line_px,
                Observations* observations);

// The same for one photo after the other, in memory that it keeps.
class PointNoiseMeter {
 public:
  // As MeasurePointNoise.
  void Measure(const Observations& fitted, const NoiseModel& model, PointNoise* noise,
               double conic_default_px = kConicDefaultPx, double line_default_px = kLineDefaultPx);

  // An estimate of a variance, and what it is worth: Gaussian residuals that would say as much.
  struct Scatter {
    double variance = 0.0;  // px^2.
    double freedom = 0.0;   // Degrees of freedom; 0 = nothing is redundant.
  };

 private:
  template <typename Feature, typename Distance>
  Scatter OfPoints(const Feature& feature, double parameters, const Distance& distance);
  Scatter OfCircle(const CircleObservation& circle);
  Scatter OfLine(const PencilObservation& pencil, const LineObservation& line);
  Scatter OfSegments(const PencilObservation& pencil);
  double Common(const std::vector<Scatter>& scatters, double default_px, double worth = 1.0);

  const Observations* fitted_ = nullptr;
  const NoiseModel* model_ = nullptr;
  std::vector<CalibratedPoint> points_;
  std::vector<double> residuals_, sizes_;
  // By circle; one for each pencil's segments, then one for each of its lines; in order of size.
  std::vector<Scatter> circles_, lines_, sorted_;
};

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_POINT_NOISE_H_
