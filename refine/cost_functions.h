// Ceres cost functions of the joint problem. Internal: not installed.
//
// All share the first parameter block: the rotation as w in R = R0 exp([w]x), R0 being the seed's.
// A chart instead of a manifold: refinements turn by degrees, far from its singularity at 180
// degrees.
#ifndef CIRCLINE_REFINE_COST_FUNCTIONS_H_
#define CIRCLINE_REFINE_COST_FUNCTIONS_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/robust_loss.h"

namespace circline {

// What the residuals of a circle or line have in common. A robust loss is applied stretched: its
// tuning constant times `*stretch`, which graduated refinement lowers from large to 1.
struct PointSet {
  std::vector<CalibratedPoint> points;
  double sigma_px = 1.0;
  LossType loss = LossType::kTrivial;
};

// R = R0 exp([w]x) and d(body rotation)/dw: exp([w + dw]x) = exp([w]x) exp([right_jacobian dw]x).
struct RotationChart {
  Eigen::Matrix3d rotation, right_jacobian;
  RotationChart(const Eigen::Matrix3d& base, const double* w);
};

// Points of a circle's contour. Blocks: w[3], (cx, cy, radius)[3]; or with `split` w[3], center[2],
// radius[1], where other residuals share the centre or the scale: the radius is then `factor` times
// the last block. Lengths in units of the plane's distance.
class CircleCost : public ceres::CostFunction {
 public:
  CircleCost(const PointSet* set, const double* stretch, const Eigen::Matrix3d& base, double facing,
             bool split, double factor);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;
  // The image of the circle, calibrated.
  Eigen::Matrix3d Conic(double const* const* parameters) const;

 private:
  const PointSet* set_;
  const double* stretch_;
  Eigen::Matrix3d base_;
  double facing_;
  bool split_;
  double factor_;
};

// Points of a line. The interpretation plane's normal in the world frame is a function of one or
// two more blocks; which, `Kind` says.
class LineCost : public ceres::CostFunction {
 public:
  enum class Kind {
    kFixedDirection,  // w[3], phi[1]: along a world axis.
    kInPlane,         // w[3], theta[1], phi[1]: direction (cos theta, sin theta, 0).
    kXAxis,           // w[3], origin[2]: the line Y = origin.y of the plane.
    kYAxis,           // w[3], origin[2]: the line X = origin.x.
    kDiameter,        // w[3], center[2], psi[1]: through the centre at angle psi.
  };
  // `direction`: unit, for kFixedDirection only.
  LineCost(Kind kind, const PointSet* set, const double* stretch, const Eigen::Matrix3d& base,
           double facing, const Eigen::Vector3d& direction = Eigen::Vector3d::Zero());
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;
  // The image of the line, calibrated, unit.
  Eigen::Vector3d Line(double const* const* parameters) const;

 private:
  // Normal of the interpretation plane in the world frame, unit up to the axes' offsets, and (if
  // not null) its derivatives by the parameters of the blocks after the rotation, in order.
  Eigen::Vector3d WorldNormal(double const* const* parameters, Eigen::Matrix3d* derivatives) const;

  Kind kind_;
  const PointSet* set_;
  const double* stretch_;
  Eigen::Matrix3d base_;
  double facing_;
  Eigen::Vector3d direction_;
};

// Unit vectors a, b that span the normals of planes containing `direction`: normal = cos(phi) a +
// sin(phi) b.
void PencilBasis(const Eigen::Vector3d& direction, Eigen::Vector3d* a, Eigen::Vector3d* b);

// Image of a plane point, its distance under a robust loss. Blocks: w[3], point[2].
class PointCost : public ceres::CostFunction {
 public:
  PointCost(const CalibratedPoint& measured, double sigma_px, LossType loss, const double* stretch,
            const Eigen::Matrix3d& base, double facing);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Eigen::Vector2d x_;
  Eigen::Matrix2d whitener_;  // Pixels per calibrated unit over sigma.
  LossType loss_;
  const double* stretch_;
  Eigen::Matrix3d base_;
  double facing_;
};

// Angle between two in-plane directions (without sense). Blocks: theta[1] of the first, if free,
// and theta[1] of the second, if free; fixed ones are given as numbers.
class AngleCost : public ceres::CostFunction {
 public:
  // `fixed[i]` is the direction's angle from X where it is no parameter, NaN where it is.
  AngleCost(double value, double sigma, const double fixed[2]);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  double value_, sigma_, fixed_[2];
};

// Distance between two plane points in world units. Blocks: a[2], b[2], scale[1]: plane distances
// per world unit. Nearly exact: the points' own noise is in their PointCosts.
class LengthCost : public ceres::CostFunction {
 public:
  explicit LengthCost(double length);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  double length_;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_COST_FUNCTIONS_H_
