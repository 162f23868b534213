// What one circle, line or point of the joint problem costs at a place, and its quadratic model
// there: the sums over its points that Gauss and Newton's method needs. Internal: not installed.
//
// Every model counts in "local" variables: first the rotation, as delta in R exp([delta]x), then
// what the feature has of its own. Lengths in units of the plane's distance; a plane point (X, Y)
// is R (X, Y, facing) in the camera frame. Hand-written derivatives, summed over the points as they
// come: a contour's 100 points enter the solver as one 6x6 matrix.
#ifndef CIRCLINE_REFINE_QUADRATIC_MODELS_H_
#define CIRCLINE_REFINE_QUADRATIC_MODELS_H_

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/robust_loss.h"
#include "circline/refine/estimate_pose.h"

namespace circline {

// 1/2 sum rho(r^2) about the present place. `hessian` is that of the model: exact in the losses'
// curvature (never negative), without that of the geometry.
struct QuadraticModel {
  double cost = 0.0;
  Vector6d gradient = Vector6d::Zero();
  Matrix6d hessian = Matrix6d::Zero();
};

// How residuals count: all under the loss, its tuning constant stretched (graduated refinement
// lowers `stretch` from large to 1); or only inliers, their gate stretched, without loss.
struct SetWeighing {
  double stretch = 1.0;
  bool inliers_only = false;
};

// Points of one contour or line.
struct PointSet {
  enum class Noise { kStated, kAutoConic, kAutoLine };  // Where sigma_px comes from.

  std::vector<CalibratedPoint> points;
  std::size_t num_trusted = 0;  // The first ones: those that a robust fit takes for inliers.
  // So many others there are that the fit itself may have followed outliers.
  bool is_contaminated = false;
  double sigma_px = 1.0;
  Noise noise = Noise::kStated;
  LossType loss = LossType::kTrivial;
  ConicDistanceType distance = ConicDistanceType::kSampson;
  // What the set as a whole counts: below 1 where its points share an error.
  double weight = 1.0;
  // x = scale * (coordinates in `points`) + shift: contours are kept about their middle, where
  // their shape is large against rounding.
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  double scale = 1.0;

  // Sum of p p^T, p = (x, y, 1): all that least squares of a line needs of its points where a pixel
  // is worth the same at each.
  std::optional<Eigen::Matrix3d> scatter;

  // Moves the points' middle to the origin and their mean distance to 1.
  void Normalize();
  // Fills `scatter` where it is exact.
  void Compress();
};

// Image of the plane's circle, in calibrated coordinates.
Eigen::Matrix3d ImageOfPlaneCircle(const Eigen::Matrix3d& R, double facing, double cx, double cy,
                                   double radius);

// Models of a contour in (delta, cx, cy, radius), at Sampson's distance where its image is no
// ellipse, and of a line in (delta, up to three more) whose interpretation plane has the normal
// m(others) in the world frame, `dm` its derivatives. Returns the cost; `model` may be null. Not
// finite where a residual is not.
double EvaluateCircle(const PointSet& set, const SetWeighing& weighing, const Eigen::Matrix3d& R,
                      double facing, double cx, double cy, double radius, QuadraticModel* model);
double EvaluateLine(const PointSet& set, const SetWeighing& weighing, const Eigen::Matrix3d& R,
                    const Eigen::Vector3d& m, const Eigen::Matrix3d& dm, QuadraticModel* model);

// A measured point of the plane in (delta, X, Y).
struct MeasuredPoint {
  CalibratedPoint x;
  double sigma_px = 1.0;
  LossType loss = LossType::kTrivial;
};
double EvaluatePoint(const MeasuredPoint& measured, const SetWeighing& weighing,
                     const Eigen::Matrix3d& R, double facing, double X, double Y,
                     QuadraticModel* model);
// How far its image misses the measurement, pixels (first order); infinity behind the camera.
double PointMissPx(const MeasuredPoint& measured, const Eigen::Matrix3d& R, double facing, double X,
                   double Y);

// Angle between two in-plane directions (without sense) at theta[0], theta[1], in these two.
double EvaluateAngle(double value, double sigma, const double theta[2], QuadraticModel* model);

// Distance between two plane points in (X0, Y0, X1, Y1, scale), scale = plane distances per world
// unit. Nearly exact: the points' own noise is that of their measurements.
double EvaluateLength(double length, const double a[2], const double b[2], double scale,
                      QuadraticModel* model);

// Signed distances of a set's points from the conic or line, pixels.
void ConicDistances(const PointSet& set, const Eigen::Matrix3d& conic, std::vector<double>* out);
void LineDistances(const PointSet& set, const Eigen::Vector3d& line, std::vector<double>* out);

}  // namespace circline

#endif  // CIRCLINE_REFINE_QUADRATIC_MODELS_H_
