// What contour points say about their conic, summed up: moments, and the closed forms that need no
// more of the points. Internal: not installed.
#ifndef CIRCLINE_ESTIMATORS_CONIC_MOMENTS_H_
#define CIRCLINE_ESTIMATORS_CONIC_MOMENTS_H_

#include <Eigen/Core>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/export.h"

namespace CIRCLINE_EXPORT circline {

// Similarity x = scale x' + center under which the points have mean 0 and mean square radius 2: the
// normal matrices of conics need it.
struct Normalization {
  double center_x = 0.0, center_y = 0.0, scale = 1.0;

  // Matrix that takes homogeneous x to x', and its inverse.
  Eigen::Matrix3d Matrix() const {
    Eigen::Matrix3d T;
    T << 1.0 / scale, 0.0, -center_x / scale, 0.0, 1.0 / scale, -center_y / scale, 0.0, 0.0, 1.0;
    return T;
  }
  Eigen::Matrix3d Inverse() const {
    Eigen::Matrix3d T;
    T << scale, 0.0, center_x, 0.0, scale, center_y, 0.0, 0.0, 1.0;
    return T;
  }
};

// Weighted sums of the monomials x^p y^q up to fourth degree, by name: all that the scatter of a
// conic's monomials is made of, 15 additions a point where the 6x6 matrix takes 36.
struct Moments {
  double one = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, xxx = 0, xxy = 0, xyy = 0, yyy = 0,
         xxxx = 0, xxxy = 0, xxyy = 0, xyyy = 0, yyyy = 0;

  void Add(double px, double py, double w) {
    const double wx = w * px, wy = w * py;
    const double wxx = wx * px, wxy = wx * py, wyy = wy * py;
    const double pxx = px * px, pxy = px * py, pyy = py * py;
    one += w;
    x += wx;
    y += wy;
    xx += wxx;
    xy += wxy;
    yy += wyy;
    xxx += wxx * px;
    xxy += wxx * py;
    xyy += wyy * px;
    yyy += wyy * py;
    xxxx += wxx * pxx;
    xxxy += wxx * pxy;
    xxyy += wxx * pyy;
    xyyy += wyy * pxy;
    yyyy += wyy * pyy;
  }

  // Means of the same points divided by `scale`.
  Moments Mean(double scale) const {
    const double c0 = 1.0 / one, s = 1.0 / scale;
    const double c1 = c0 * s, c2 = c1 * s, c3 = c2 * s, c4 = c3 * s;
    return {1.0,      c1 * x,   c1 * y,    c2 * xx,   c2 * xy,   c2 * yy,   c3 * xxx, c3 * xxy,
            c3 * xyy, c3 * yyy, c4 * xxxx, c4 * xxxy, c4 * xxyy, c4 * xyyy, c4 * yyyy};
  }

  // Sum of w m m^T, m the gradient of x^T C x with respect to ConicToVector(C): (x^2, y^2, 1,
  // sqrt2 xy, sqrt2 x, sqrt2 y).
  Matrix6d Scatter() const {
    Matrix6d M;
    M.row(0) << xxxx, xxyy, xx, kSqrt2 * xxxy, kSqrt2 * xxx, kSqrt2 * xxy;
    M.row(1) << xxyy, yyyy, yy, kSqrt2 * xyyy, kSqrt2 * xyy, kSqrt2 * yyy;
    M.row(2) << xx, yy, one, kSqrt2 * xy, kSqrt2 * x, kSqrt2 * y;
    M.row(3) << M(0, 3), M(1, 3), M(2, 3), 2.0 * xxyy, 2.0 * xxy, 2.0 * xyy;
    M.row(4) << M(0, 4), M(1, 4), M(2, 4), M(3, 4), 2.0 * xx, 2.0 * xy;
    M.row(5) << M(0, 5), M(1, 5), M(2, 5), M(3, 5), M(4, 5), 2.0 * yy;
    return M;
  }

  // Kanatani and Rangarajan's constraint matrix without its O(1/n) terms, of means: the mean of the
  // squared derivatives of m, plus mean(m) e^T + e mean(m)^T, e the expectation of the monomials'
  // second-order error (1 for x^2 and y^2).
  Matrix6d HyperConstraint() const {
    Matrix6d N;
    N.row(0) << 6.0 * xx, xx + yy, 1.0, 3.0 * kSqrt2 * xy, 3.0 * kSqrt2 * x, kSqrt2 * y;
    N.row(1) << xx + yy, 6.0 * yy, 1.0, 3.0 * kSqrt2 * xy, kSqrt2 * x, 3.0 * kSqrt2 * y;
    N.row(2) << 1.0, 1.0, 0.0, 0.0, 0.0, 0.0;
    N.row(3) << N(0, 3), N(1, 3), 0.0, 2.0 * (xx + yy), 2.0 * y, 2.0 * x;
    N.row(4) << N(0, 4), N(1, 4), 0.0, 2.0 * y, 2.0, 0.0;
    N.row(5) << N(0, 5), N(1, 5), 0.0, 2.0 * x, 0.0, 2.0;
    return N;
  }
};

// Mean and mean radius of the points, and the means of their normalised monomials. False where they
// do not spread, or a number is not finite.
bool NormalizePoints(const std::vector<CalibratedPoint>& points, const std::vector<double>* weights,
                     Normalization* normalization, Moments* means);

// Direct fits from the means of normalised points, all in normalised coordinates. Hyper-accurate
// least squares: a conic of any kind, of unit norm.
Eigen::Matrix3d FitAnyConic(const Moments& means);
// The same, and where that is not an ellipse, the one of Halir and Flusser.
bool FitEllipse(const Moments& means, Eigen::Matrix3d* conic);
// The circle of least squares of x^2 + y^2 + .. (Kasa 1976).
bool FitCircle(const Moments& means, Eigen::Matrix3d* conic);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_CONIC_MOMENTS_H_
