// Covariances for a closed form of your own, as the built-in ones have theirs: each independent
// error of its inputs and of the camera, one standard deviation up and down, through the closed
// form itself (statistical linearisation). docs/examples/own_solver is a solver made with it.
#ifndef CIRCLINE_ESTIMATORS_ERROR_PROPAGATION_H_
#define CIRCLINE_ESTIMATORS_ERROR_PROPAGATION_H_

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "circline/estimators/conic_fit.h"
#include "circline/estimators/export.h"
#include "circline/estimators/line.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/status.h"
#include "circline/estimators/vanishing_point.h"

namespace CIRCLINE_EXPORT circline {

// What a number is in the image, which says how an error of the camera moves it.
enum class InputKind { kPoint, kLine, kConic, kNumber };

// One measured input of a closed form, calibrated, with its covariance.
struct MeasuredInput {
  InputKind kind = InputKind::kNumber;  // Says which size `value` has.
  // 3 of a point, direction or line; 6 of a conic, in ConicToVector's order; 1 of a number, in a
  // unit of its own.
  std::vector<double> value;
  std::vector<double> covariance;  // Of `value`, square, row-major.
  int contrast = 0;                // Of a conic: CircleObservation::contrast,
  double irregularity = 1.0;       // ConicFit::irregularity.

  // A point of the image, homogeneous.
  static MeasuredInput Point(const Eigen::Vector3d& point, const Eigen::Matrix3d& covariance);
  // The direction of a pencil: its vanishing point.
  static MeasuredInput Direction(const VanishingPointFit& fit);
  // A line of the image.
  static MeasuredInput Line(const LineFit& fit);
  // The image of a circle.
  static MeasuredInput Conic(const ConicFit& fit, int contrast = 0);
  // A radius, an angle: whatever no error of the camera moves.
  static MeasuredInput Number(double value, double sigma);

  // Of a point, a direction or a line.
  Eigen::Vector3d AsVector() const { return {value[0], value[1], value[2]}; }
  // Of a conic, 3x3.
  Eigen::Matrix3d AsConic() const;
};

// A pose that a closed form finds, and how far it contradicts the inputs that it was not computed
// from: numbers that are zero where all of them agree, as many for every pose; or none. Poses that
// are not finite do not count.
struct ClosedFormPose {
  CameraPose pose;                    // World to camera.
  std::vector<double> contradiction;  // In any unit: its variance is found, too.
};

// All poses of the inputs, in any order; none where they are degenerate.
using ClosedForm = std::function<std::vector<ClosedFormPose>(const std::vector<MeasuredInput>&)>;

// What of a pose its closed form does not know.
struct UnknownOfPose {
  bool scale = true;  // The translation is a unit vector; else it is metric.
  bool spin = false;  // The turn about the plane's normal is a convention.
};

// The poses of the closed form as hypotheses: covariance, rank and free directions of each, cost
// from the contradictions (1/2 chi^2), ranked, with probabilities. Of the noise model the camera's
// part and the contours' offset count; what else it holds belongs into the inputs' covariances.
// Calls the closed form twice for each error: some 50 times. Ok and empty where it finds no pose;
// invalid and empty, with a sentence, where an input has the wrong size or is not finite (which
// one: its index), where its poses are not contradicted by as many numbers each, or where camera or
// noise model are wrong. Thread-safe if `closed_form` is.
Status PropagateErrors(const ClosedForm& closed_form, const std::vector<MeasuredInput>& inputs,
                       const Camera& camera, const NoiseModel& noise_model,
                       const UnknownOfPose& unknown, std::vector<PoseHypothesis>* hypotheses);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_ERROR_PROPAGATION_H_
