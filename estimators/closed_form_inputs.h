// The numbers that a closed form works on, read from observations. Internal: not installed.
#ifndef CIRCLINE_ESTIMATORS_CLOSED_FORM_INPUTS_H_
#define CIRCLINE_ESTIMATORS_CLOSED_FORM_INPUTS_H_

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "circline/estimators/error_propagation.h"
#include "circline/estimators/observations.h"

namespace circline {

// A measured vector and a square root of its covariance: `columns` perturb the value by one
// standard deviation along independent directions.
struct Measured {
  Eigen::VectorXd value;
  Eigen::MatrixXd columns;

  Measured() = default;
  Measured(const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance);
  bool present() const { return value.size() > 0; }
};

// Numbers that errors move, in place: of one input, or such as follow the camera alone.
struct MovedInput {
  InputKind kind;
  double* value;
  Eigen::MatrixXd columns;    // As Measured has them; none: exact.
  int contrast = 0;           // Of a conic: CircleObservation::contrast,
  double irregularity = 1.0;  // ConicFit::irregularity.
};

using RayPair = std::array<Eigen::Vector3d, 2>;

struct MeasuredCircle {
  Measured conic;  // ConicToVector, 6.
  // Of its plane against the world's, about two axes of it, 2; 0 as far as is known.
  Measured tilt;
  double normal_weight = 1.0;  // Inverse variance of its normal.
  int contrast = 0;            // CircleObservation::contrast.
  double irregularity = 1.0;   // ConicFit::irregularity.
};

// All calibrated.
struct Inputs {
  std::vector<MeasuredCircle> circles;  // Of one plane; of the first:
  Measured center;                      // Image of its centre, homogeneous, 3.
  Measured x_line, y_line;              // Images of the axes or of lines parallel to them, 3.
  std::array<Measured, 2> directions;   // Vanishing points of two pencils, 3.
  // What of a wall's lean turns each of them (LeanShape).
  std::array<Eigen::Matrix3d, 2> lean_shapes = {Eigen::Matrix3d::Identity(),
                                                Eigen::Matrix3d::Identity()};
  // Where present, directions[on_line] lies in the plane of this line, 3, and makes `angle`,
  // radians, with the other direction, but for what it differs from `rough` by, near which it is.
  Measured line;
  std::size_t on_line = 0;
  Eigen::Vector3d rough = Eigen::Vector3d::Zero();
  double angle = 0.0, angle_sigma = 0.0;
  Measured origin;               // Image of the world origin, homogeneous, 3.
  bool origin_observed = false;  // Else it is a convention.
  std::array<PencilDirection, 2> roles{PencilDirection::kFree, PencilDirection::kFree};
  std::optional<RayPair> x_sense, y_sense;  // Oriented axes, homogeneous.
  bool origin_at_center = false;            // The origin is the first circle's centre.
  double radius = 0.0, radius_sigma = 0.0;  // Metric scale from the circle, or 0; relative.
  std::optional<RayPair> length_points;     // Metric scale from two points ...
  double length = 0.0, length_sigma = 0.0;  // ... of the plane, or 0; relative.

  // Every input that an error may move, by its value in this.
  std::vector<MovedInput> Moved();
  bool DrawnAxesCross() const { return x_sense && y_sense && x_line.present() && y_line.present(); }
  bool IsMetric() const { return (!circles.empty() && radius > 0.0) || length > 0.0; }
};

// `sigma_px` below: of points that state none. `observations` are fitted and resolved.

// Whether it is the one of two pencils, and the first that is; null where none is.
bool IsBetween(const KnownAngle& known, const std::string& a, const std::string& b);
const KnownAngle* FindKnownAngle(const std::vector<KnownAngle>& known, const std::string& a,
                                 const std::string& b);

// A pixel as a homogeneous calibrated point; absent where the camera cannot undistort it.
Measured MeasuredPoint(const Camera& camera, const Eigen::Vector2d& pixel, double sigma_px);

// Images of the drawn axes, fitted to the pencils' lines that they are parts of, or else to their
// own two points.
void GatherDrawnAxes(const Observations& observations, double sigma_px, Inputs* inputs);

// Images of the drawn axes, or else of the best-measured lines along them: those need not lie in
// the plane to have the axis' direction.
void GatherAxisLines(const Observations& observations, double sigma_px, Inputs* inputs);

// The two directions, unit; false where a line of known angle has none.
bool DirectionsOf(const Inputs& inputs, std::array<Eigen::Vector3d, 2>* directions);

// Senses of the axes, the origin, a known length.
void GatherFrame(const Observations& observations, double sigma_px, Inputs* inputs);

// The directions of the evidence's two pencils: their vanishing points, or, where the angle between
// them is known, one of these and a line of the other pencil: of what agrees with all lines, the
// one with the least expected error. Lines that nearly coincide have a vanishing point that may be
// anywhere along them, whatever its covariance says. The angle is known where it is given or, with
// `axes_are_orthogonal`, where the pencils run along two of the axes.
void GatherDirections(const Observations& evidence, bool axes_are_orthogonal, Inputs* inputs);

// The image of a circle's centre: as given, or the origin where that is the centre; else absent.
Measured MeasuredCenter(const Observations& observations, const CircleObservation& circle,
                        double sigma_px);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_CLOSED_FORM_INPUTS_H_
