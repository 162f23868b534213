// Circles and lines for anybody's ceres::Problem: each cost function is one feature of one photo,
// all its points at once. docs/examples/ceres_graph.cc is a pose graph made of these.
//
// Parameter blocks
//   rotation     4  unit quaternion (x, y, z, w) of cam_from_world; ceres::EigenQuaternionManifold
//   translation  3  of cam_from_world, in the world's unit: X_cam = rotation * X_world +
//   translation direction    3  unit vector, world frame, without sense; ceres::SphereManifold<3>
//   camera      12  shifts against the camera that the points were made with: log f, log (fy / fx),
//                   principal point (2, pixels), distortion coefficients (8); zeros are that camera
//   others          as said at each class; no manifold unless one is named
// A block whose pointer is the same in several cost functions is shared: one rotation and
// translation a photo, one circle for all photos that see it, one camera for all that it took.
// Blocks in brackets are optional, by the constructor's arguments, and left out, not null.
//
// Residuals. A feature of many points is one block of few residuals whose squares sum up to the
// robust cost of all points, sum rho((distance / sigma)^2), and whose Jacobian has its gradient and
// its Gauss-Newton Hessian: the square root of that, and a rest without derivative. So the robust
// loss acts on each point, inside (ImagePoints::Options::loss): add these blocks with a null
// LossFunction. The
// reported Jacobian is not the derivative of the reported residuals: ceres::GradientChecker does
// not apply; tests/refine/cost_functions_test.cc compares costs and gradients. Where nothing can be
// evaluated (a point behind the camera), Evaluate returns false and ceres shortens the step.
//
// Thread-safe: Evaluate is const and keeps nothing. The problem takes ownership, as ceres does.
// Needs Ceres 2.1 or later.
#ifndef CIRCLINE_REFINE_COST_FUNCTIONS_H_
#define CIRCLINE_REFINE_COST_FUNCTIONS_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "circline/estimators/conic.h"
#include "circline/refine/image_points.h"

namespace circline {

// A feature whose residuals may be weighed anew: by their losses as ceres calls it, or as inliers
// alone, for covariances.
class FeatureCost : public ceres::CostFunction {
 public:
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const final {
    return EvaluateWith(weighing_, parameters, residuals, jacobians);
  }
  // How Evaluate weighs: by the losses as they are, unless a graduated refinement stretches them.
  void set_weighing(const Weighing& weighing) { weighing_ = weighing; }
  virtual bool EvaluateWith(const Weighing& weighing, const double* const* parameters,
                            double* residuals, double** jacobians) const = 0;

 private:
  Weighing weighing_;
};

// Contour of a circle of the world: rotation, translation, center (3), normal (3, any length but 0:
// ceres::SphereManifold<3>), radius (1), [contour offset (1, pixels of the photo, outwards)],
// [camera].
class CircleContourCost : public FeatureCost {
 public:
  struct Blocks {
    bool offset = false, camera = false;
  };
  CircleContourCost(ImagePoints points, Blocks blocks);
  bool EvaluateWith(const Weighing& weighing, const double* const* parameters, double* residuals,
                    double** jacobians) const override;

 private:
  ImagePoints points_;
  Blocks blocks_;
};

// Contour of a circle of the plane Z = 0: rotation, translation, center (2), radius (1), [tilt and
// height (3)], [contour offset (1)], [camera]. The circle's own plane is Z = 0 but for a tilt (the
// X and Y of its normal, radians) and a height (in radii), which have a Gaussian prior here.
class PlaneCircleContourCost : public FeatureCost {
 public:
  struct Blocks {
    bool tilt_and_height = false, offset = false, camera = false;
    double tilt_sigma = 0.0, height_sigma = 0.0;  // Radians, radii; 0: held at its value.
  };
  PlaneCircleContourCost(ImagePoints points, Blocks blocks);
  bool EvaluateWith(const Weighing& weighing, const double* const* parameters, double* residuals,
                    double** jacobians) const override;

  const ImagePoints& points() const { return points_; }
  Eigen::Matrix3d ImageOf(const double* const* parameters) const;  // Calibrated coordinates.
  double OffsetPx(const double* const* parameters) const;
  const double* CameraShifts(const double* const* parameters) const;

 private:
  ImagePoints points_;
  Blocks blocks_;
};

// Lines of one direction: rotation, direction, [camera]. Where each line lies beside its direction
// is nobody else's business: it is found inside, from the line's own points (one or two steps of
// Newton's method), and costs no unknown.
class ParallelLinesCost : public FeatureCost {
 public:
  struct Line {
    ImagePoints points;
    Eigen::Vector3d fit;  // Line through them, calibrated coordinates (FitLine), to start from.
  };
  struct Options {
    // Standard deviation of a line's own direction about the common one, radians; 0 = exact.
    double direction_sigma = 0.0;
    bool camera = false;
  };
  ParallelLinesCost(std::vector<Line> lines, Options options);
  bool EvaluateWith(const Weighing& weighing, const double* const* parameters, double* residuals,
                    double** jacobians) const override;

  // Leaves a line out, or takes it in again.
  void SetActive(std::size_t line, bool active) { active_[line] = active ? 1 : 0; }

  // One line under a direction of the camera frame: where it then lies, its robust cost with the
  // prior of its deviation, and what it says: the cost left by its own unknowns is, to second
  // order, g + h v . d delta about d, v the unit vector across d.
  struct Placed {
    Eigen::Vector3d line, across;
    double twice_cost = 0.0, g = 0.0, h = 0.0;
    // The same for the camera's shifts, beside the direction: (across, camera).
    CurveModel::Vector gradient;
    CurveModel::Matrix hessian;
  };
  bool Place(std::size_t line, const Eigen::Vector3d& direction, const double* camera,
             const Weighing& weighing, bool camera_variable, Placed* placed,
             bool with_model = true) const;
  const std::vector<Line>& lines() const { return lines_; }

 private:
  bool Eliminate(const CurveModel& model, const Eigen::Matrix3d& J, double e, int n,
                 Placed* placed) const;

  std::vector<Line> lines_;
  std::vector<Eigen::Matrix3d> information_;  // By line, about its own fit.
  std::vector<std::uint8_t> active_;
  Options options_;
};

// Line of the plane Z = 0: rotation, translation, point (2, a point of the line), angle (1, of its
// direction from X towards Y, radians), [camera]. A drawn axis has its point at the origin and its
// angle held; a diameter shares the circle's centre.
class PlaneLineCost : public FeatureCost {
 public:
  explicit PlaneLineCost(ImagePoints points, bool camera = false);
  bool EvaluateWith(const Weighing& weighing, const double* const* parameters, double* residuals,
                    double** jacobians) const override;

  const ImagePoints& points() const { return points_; }
  static Eigen::Vector3d ImageOf(const double* const* parameters);

 private:
  ImagePoints points_;
  bool has_camera_;
};

// Image of a point of the plane Z = 0: rotation, translation, point (2), [camera]. The residual is
// the reprojection error, its length under the loss.
class PlanePointCost : public FeatureCost {
 public:
  PlanePointCost(const Camera& camera, const Eigen::Vector2d& pixel, double sigma_px, LossType loss,
                 bool camera_block = false);
  bool EvaluateWith(const Weighing& weighing, const double* const* parameters, double* residuals,
                    double** jacobians) const override;

  double sigma_px() const { return sigma_px_; }
  // How far its image misses the measurement, pixels; infinity where it has none.
  double MissPx(const double* const* parameters) const;

 private:
  Camera camera_;
  Eigen::Vector2d pixel_;
  double sigma_px_;
  LossType loss_;
  bool has_camera_;
};

// --- What is known beside the pixels. One residual a degree of freedom, in standard deviations.
// ---

// Angle between two directions (3, 3), radians; they have no sense: it or its supplement.
ceres::CostFunction* NewAngleCost(double angle, double sigma);
// Distance between two points (2, 2) of a plane; sigma relative.
ceres::CostFunction* NewLengthCost(double length, double sigma);
// A positive number (1), a radius: its logarithm; sigma relative.
ceres::CostFunction* NewLogPrior(double value, double sigma);
// `size` numbers about zero; where a sigma is 0 that number has no residual: hold it.
ceres::CostFunction* NewGaussianPrior(const std::vector<double>& sigmas);
// A direction (3) about `axis` (unit), each of two components, radians; and one about a plane of
// this unit normal.
ceres::CostFunction* NewDirectionPrior(const Eigen::Vector3d& axis, double sigma);
ceres::CostFunction* NewInPlanePrior(const Eigen::Vector3d& normal, double sigma);
// Gaussian prior of a pose: rotation, translation about those of `mean`, covariance of [delta,
// delta_t] as PoseHypothesis::covariance (rotation = exp([delta]x) * mean). Null where the
// covariance is not positive definite.
ceres::CostFunction* NewPosePrior(const Eigen::Matrix3d& rotation,
                                  const Eigen::Vector3d& translation, const Matrix6d& covariance);
// A direction of the world seen in the camera (gravity from an IMU): rotation; both unit, sigma
// radians.
ceres::CostFunction* NewDirectionMeasurement(const Eigen::Vector3d& in_world,
                                             const Eigen::Vector3d& in_camera, double sigma);

}  // namespace circline

#endif  // CIRCLINE_REFINE_COST_FUNCTIONS_H_
