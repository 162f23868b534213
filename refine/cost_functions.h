// Circles and lines for anybody's ceres::Problem: each cost function is one feature of one photo,
// all its points at once. docs/examples/ceres_graph.cc is a pose graph made of these; EstimatePose
// is built of nothing else.
//
// Parameter blocks
//   rotation     4  unit quaternion (x, y, z, w) of cam_from_world; ceres::EigenQuaternionManifold
//   translation  3  of cam_from_world, in the world's unit: X_cam = R X_world + t
//   direction    3  unit vector, world frame, without sense; ceres::SphereManifold<3>
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
// LossFunction. The reported Jacobian is not the derivative of the reported residuals:
// ceres::GradientChecker does not apply; tests/refine/cost_functions_test.cc compares costs and
// gradients. Where nothing can be evaluated (a point behind the camera), Evaluate returns false and
// ceres shortens the step.
//
// Thread-safe: Evaluate is const and keeps nothing. The problem takes ownership, as ceres does.
// Needs Ceres 2.1 or later.
#ifndef CIRCLINE_REFINE_COST_FUNCTIONS_H_
#define CIRCLINE_REFINE_COST_FUNCTIONS_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <array>
#include <vector>

#include "circline/estimators/conic.h"
#include "circline/estimators/export.h"
#include "circline/refine/image_points.h"

namespace CIRCLINE_EXPORT circline {

// A feature of a photo. Its residuals may be weighed anew: by their losses as ceres calls it, or as
// inliers alone, for covariances.
class FeatureCost : public ceres::CostFunction {
 public:
  // As ceres calls it.
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const final {
    return EvaluateWith(weighing_, parameters, residuals, jacobians);
  }
  // How Evaluate weighs: by the losses as they are, unless a graduated refinement stretches them.
  void set_weighing(const Weighing& weighing) { weighing_ = weighing; }
  // The same, weighed otherwise.
  virtual bool EvaluateWith(const Weighing& weighing, const double* const* parameters,
                            double* residuals, double** jacobians) const = 0;

  // Points of a contour or a line, and their signed distances from its image, pixels; null and
  // nothing for a single point.
  virtual const ImagePoints* points() const { return nullptr; }
  virtual void Distances(const double* const* /*parameters*/,
                         std::vector<double>* distances) const {
    distances->clear();
  }
  // As ImagePoints::SeeThrough: for evaluations to come with these camera shifts.
  virtual void SeeThrough(const double* /*camera*/) {}

 private:
  Weighing weighing_;
};

// Points about a curve, the image of a contour or a line: what these cost functions share.
class CurveCost : public FeatureCost {
 public:
  const ImagePoints* points() const override { return &points_; }
  void SeeThrough(const double* camera) override { points_.SeeThrough(camera); }

 protected:
  // `curve_rank`: degrees of freedom of the curve, 5 of a conic, 2 of a line. The blocks are those
  // of these sizes, then the contour's offset and the camera's shifts, where there are any; the
  // last `num_priors` residuals are not of the points.
  CurveCost(ImagePoints points, int curve_rank, const std::vector<int>& sizes, bool has_offset,
            bool has_camera, int num_priors);
  // Takes other points and gives back its own. Not in a problem.
  void ExchangePoints(ImagePoints* points);

  // The contour's offset, pixels of the photo, outwards; 0 where there is no block of it.
  double Offset(const double* const* parameters) const {
    return offset_block_ >= 0 ? parameters[offset_block_][0] : 0.0;
  }
  // The camera's kCameraSize shifts; null where there is no block of them.
  const double* CameraShifts(const double* const* parameters) const {
    return camera_block_ >= 0 ? parameters[camera_block_] : nullptr;
  }
  // Derivatives of the points' residuals by a curve: ConicToVector of its Normalized(), or a line.
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor,
                             CurveModel::kMaxSize, 6>;
  // A conic (3 x 3) or a line (3 x 1), calibrated.
  using Curve = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3>;
  // Writes the points' residuals about a curve, and their derivatives by the optional blocks; `U`
  // receives those by the curve, where any are asked for. False where a point has no finite cost.
  bool SumAbout(const Eigen::Ref<const Curve>& curve, const Weighing& weighing,
                const double* const* parameters, double* residuals, double** jacobians,
                Rows* U) const;
  // The points' share of the residuals; those of priors come behind.
  int num_curve_residuals() const { return num_residuals() - num_priors_; }

 private:
  int Rank(bool camera_is_variable) const;

  ImagePoints points_;
  int curve_rank_, num_priors_;
  int offset_block_ = -1, camera_block_ = -1;  // -1: there is none.
};

// Contour of a circle of the world: rotation, translation, center (3), normal (3, any length but 0:
// ceres::SphereManifold<3>), radius (1), [contour offset (1, pixels of the photo, outwards)],
// [camera].
class CircleContourCost : public CurveCost {
 public:
  // Which of the blocks in brackets there are.
  struct Blocks {
    bool offset = false, camera = false;  // The contour's offset; the camera's shifts.
  };
  // Of the points of its contour.
  CircleContourCost(ImagePoints points, Blocks blocks);
  bool EvaluateWith(const Weighing& weighing, const double* const* parameters, double* residuals,
                    double** jacobians) const override;
  void Distances(const double* const* parameters, std::vector<double>* distances) const override;
};

// Contour of a circle of the plane Z = 0: rotation, translation, center (2), radius (1), [tilt and
// height (3)], [shape (2)], [contour offset (1)], [camera]. The circle's own plane is Z = 0 but for
// a tilt (the X and Y of its normal, radians) and a height (in radii); and it is round but for a
// shape (a, b): at the angle phi from X towards Y its radius is r (1 + a cos 2 phi + b sin 2 phi),
// to first order. Both are for priors to hold small: of their own (NewGaussianPrior), which a
// circle that several photos see has once; or, of tilt and height, here, which costs less time.
class PlaneCircleContourCost : public CurveCost {
 public:
  // Which of the blocks in brackets there are, and the prior.
  struct Blocks {
    bool tilt_and_height = false, shape = false, offset = false, camera = false;  // In this order.
    std::array<double, 3> tilt_sigmas = {0.0, 0.0, 0.0};  // Radians, radii; 0: no prior here.
  };
  // Of the points of its contour.
  PlaneCircleContourCost(ImagePoints points, Blocks blocks);
  // Takes other points and gives back its own: from frame to frame, without new memory. Not in a
  // problem.
  void Exchange(ImagePoints* points) { ExchangePoints(points); }
  bool EvaluateWith(const Weighing& weighing, const double* const* parameters, double* residuals,
                    double** jacobians) const override;
  void Distances(const double* const* parameters, std::vector<double>* distances) const override;

 private:
  int ShapeBlock() const { return blocks_.tilt_and_height ? 5 : 4; }
  static int NumPriors(const Blocks& blocks) {
    return blocks.tilt_and_height && blocks.tilt_sigmas[0] > 0.0 ? 3 : 0;
  }

  Blocks blocks_;
};

// Line of a direction: rotation, direction, line (1 or 2), [camera]. `line`: where it lies across
// the direction, an angle about it, radians, from where it is nearest to `fit`; and, unless
// direction_sigma is 0, by how much its own direction deviates from the common one, radians, which
// has a prior here of that standard deviation; most lines are more exact.
class DirectionLineCost : public CurveCost {
 public:
  // What else is unknown of the line.
  struct Options {
    double direction_sigma = 0.0;  // Of a line's own direction, radians; 0 = exact.
    bool camera = false;           // Whether there is a block of the camera.
  };
  // `fit`: any line near, calibrated coordinates of the camera of the points (FitLine); where the
  // camera is a block, its shifts move it as they move what is seen there.
  DirectionLineCost(ImagePoints points, const Eigen::Vector3d& fit, Options options);
  // As PlaneCircleContourCost's.
  void Exchange(ImagePoints* points, const Eigen::Vector3d& fit);
  // As FeatureCost says.
  bool EvaluateWith(const Weighing& weighing, const double* const* parameters, double* residuals,
                    double** jacobians) const override;
  void Distances(const double* const* parameters, std::vector<double>* distances) const override;

  // The block `line` that its points ask for, where all else is as in `parameters`: to start from.
  // False where the points run straight across the direction.
  bool Start(const double* const* parameters, double* line) const;

 private:
  struct Placed;
  bool Place(const double* const* parameters, const double* camera, Placed* placed) const;

  Eigen::Vector3d fit_;  // Unit.
  Options options_;
};

// Line of the plane Z = 0: rotation, translation, point (2, a point of the line), angle (1, of its
// direction from X towards Y, radians), [camera]. A drawn axis has its point at the origin and its
// angle held; a diameter shares the circle's centre.
class PlaneLineCost : public CurveCost {
 public:
  // Of the points along it.
  explicit PlaneLineCost(ImagePoints points, bool camera = false);
  bool EvaluateWith(const Weighing& weighing, const double* const* parameters, double* residuals,
                    double** jacobians) const override;
  void Distances(const double* const* parameters, std::vector<double>* distances) const override;
};

// Image of a point of the plane Z = 0: rotation, translation, point (2), [camera]. The residual is
// the reprojection error, its length under the loss.
class PlanePointCost : public FeatureCost {
 public:
  // Seen at `pixel`, of which each coordinate has this standard deviation.
  PlanePointCost(const Camera& camera, const Eigen::Vector2d& pixel, double sigma_px, LossType loss,
                 bool camera_block = false);
  // Seen elsewhere: from frame to frame.
  void Reset(const Camera& camera, const Eigen::Vector2d& pixel, double sigma_px);
  bool EvaluateWith(const Weighing& weighing, const double* const* parameters, double* residuals,
                    double** jacobians) const override;

  double sigma_px() const { return sigma_px_; }  // Of each coordinate, pixels.
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
// As many numbers about `mean` (empty: zeros); where a sigma is 0 that number has no residual: hold
// it.
ceres::CostFunction* NewGaussianPrior(const std::vector<double>& sigmas,
                                      const std::vector<double>& mean = {});
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
