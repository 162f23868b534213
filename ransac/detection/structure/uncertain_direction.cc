#include "circline/ransac/detection/structure/uncertain_direction.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "circline/estimators/basics.h"
#include "circline/estimators/circle_planes.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/directions.h"
#include "circline/estimators/pose.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Errors of a direction or a normal that no covariance of edge points knows: calibration, surfaces
// that are not quite plane, prints that are not quite round. Standard deviation, degrees.
constexpr double kModelSigmaDeg = 0.5;
// Agreement is believed up to this many standard deviations.
constexpr double kMaxSigmas = 3.0;
// So many houses have walls at right angles; the others at any angle.
constexpr double kRightAngleShare = 0.5;
// Rows and columns of a sheet of circles are made at right angles; paper that bends shows them at
// others. A lattice this near to a rectangular one is rectangular.
constexpr double kRectangularDeg = 4.0;
// Two pencils span a plane if they are this far from parallel: what nature has of lines is more
// nearly parallel. With 15 degrees not one of 80 photographs of things had another plane.
constexpr double kMinSpanDeg = 30.0;

double DegreesFromRightAngle(const UncertainDirection& a, const UncertainDirection& b) {
  return std::asin(std::min(1.0, std::abs(a.direction.dot(b.direction)))) / kDegree;
}

// Of the angle between two directions at about right angles, squared radians.
double VarianceOfAngle(const UncertainDirection& a, const UncertainDirection& b) {
  return std::max(0.0, a.direction.dot(b.covariance * a.direction) +
                           b.direction.dot(a.covariance * b.direction));
}

}  // namespace

bool AreAlike(const Vector3d& a, const Vector3d& b) {
  constexpr double kDistinctSine = 0.0523;
  return a.cross(b).norm() < kDistinctSine;
}

UncertainDirection Refocus(const UncertainDirection& direction, double log_focal) {
  const double s = std::exp(-log_focal);
  const Matrix3d scale = Vector3d(s, s, 1.0).asDiagonal();
  const Vector3d moved = scale * direction.direction;
  UncertainDirection out;
  out.direction = moved.normalized();
  const Matrix3d J =
      (Matrix3d::Identity() - out.direction * out.direction.transpose()) * scale / moved.norm();
  out.covariance = J * direction.covariance * J.transpose();
  return out;
}

bool InPlane(const UncertainDirection& direction, const UncertainDirection& normal,
             double max_deg) {
  const double sigma_deg = std::sqrt(VarianceOfAngle(direction, normal)) / kDegree;
  return DegreesFromRightAngle(direction, normal) <=
         std::min(max_deg, kMaxSigmas * std::hypot(sigma_deg, kModelSigmaDeg));
}

// A shift of the principal point by m, and a focal length larger by a share s, move a direction d
// by -d_z m and by -s d_z e_z, both across it.
RightAngle::RightAngle(const UncertainDirection& a, const UncertainDirection& b,
                       const CameraError& camera) {
  const Vector3d &p = a.direction, &q = b.direction;
  angle_ = std::asin(std::clamp(p.dot(q), -1.0, 1.0));
  const Eigen::Vector2d by_middle = -(q.z() * p.head<2>() + p.z() * q.head<2>());
  const double by_focal = -2.0 * p.z() * q.z(), lean = kRightAngleSigmaDeg * kDegree;
  variance_ = VarianceOfAngle(a, b) + lean * lean +
              camera.middle_rad * camera.middle_rad * by_middle.squaredNorm() +
              camera.log_focal * camera.log_focal * by_focal * by_focal;
  // The angle between two directions without relation, from 90 degrees, has the density cos (per
  // radian, Archimedes).
  constexpr double kTwiceGaussian = 0.7978845608028654;  // 2 / sqrt(2 pi): no sense of sign.
  log_peak_ = std::log(kRightAngleShare / (1.0 - kRightAngleShare) * kTwiceGaussian /
                       (std::sqrt(variance_) * std::cos(angle_)));
}

bool Rectangular(const UncertainDirection& a, const UncertainDirection& b) {
  return DegreesFromRightAngle(a, b) <= kRectangularDeg;
}

// First-order propagation through the normalised cross product.
bool SpannedNormal(const UncertainDirection& a, const UncertainDirection& b,
                   UncertainDirection* normal) {
  const Vector3d cross = a.direction.cross(b.direction);
  const double sine = cross.norm();
  if (sine < std::sin(kMinSpanDeg * kDegree)) return false;
  normal->direction = cross / sine;
  const Matrix3d tangent =
      (Matrix3d::Identity() - normal->direction * normal->direction.transpose()) / sine;
  const Matrix3d ja = tangent * -CrossMatrix(b.direction), jb = tangent * CrossMatrix(a.direction);
  normal->covariance = ja * a.covariance * ja.transpose() + jb * b.covariance * jb.transpose();
  return true;
}

double PrecisionShare(const UncertainDirection& direction) {
  const double model = kModelSigmaDeg * kDegree;
  return model / std::sqrt(model * model + direction.covariance.trace());
}

double LikelihoodRatio(const UncertainDirection& normal, const Vector3d& plane) {
  constexpr double kNearby = 0.5;  // Cosine of an angle that no standard deviation spans.
  const double cosine = normal.direction.dot(plane);
  if (std::abs(cosine) < kNearby) return 0.0;
  const Eigen::Matrix<double, 3, 2> across = BasisAcross(plane);
  const double model = kModelSigmaDeg * kDegree;
  const Eigen::Matrix2d covariance =
      across.transpose() * normal.covariance * across + model * model * Eigen::Matrix2d::Identity();
  const Eigen::Vector2d residual = across.transpose() * normal.direction;
  // Of a hemisphere, 2 pi: the Gaussian's own factor.
  return std::exp(-0.5 * residual.dot(covariance.inverse() * residual)) /
         std::sqrt(covariance.determinant());
}

// The product of the two eigenvalues that are not zero is (trace(C)^2 - trace(C^2)) / 2.
double ShareOfHemisphere(const UncertainDirection& direction) {
  const Matrix3d& C = direction.covariance;
  const double product = 0.5 * (C.trace() * C.trace() - (C * C).trace());
  return std::sqrt(std::max(0.0, product));
}

double LogOddsOfMixture(const std::vector<double>& ratios) {
  constexpr int kShares = 32;  // That the integral over the share is summed at.
  std::array<double, kShares> log_odds{};
  for (std::size_t k = 0; k < kShares; ++k) {
    const double share = (static_cast<double>(k) + 0.5) / kShares;
    for (const double ratio : ratios) log_odds[k] += std::log(1.0 - share + share * ratio);
  }
  const double most = *std::max_element(log_odds.begin(), log_odds.end());
  double sum = 0.0;
  for (const double l : log_odds) sum += std::exp(l - most);
  return most + std::log(sum / kShares);
}

CircleEquations::CircleEquations(const ConicFit& fit, const Vector3d& normal)
    : basis(BasisAcross(normal)) {
  const Vector3d u = basis.col(0), v = basis.col(1);
  const Vector3d Cu = fit.conic * u, Cv = fit.conic * v;
  value << u.dot(Cu) - v.dot(Cv), 2.0 * u.dot(Cv);
  // A step (a, b) of the normal takes u to u - a n and v to v - b n.
  const double a = 2.0 * normal.dot(Cu), b = 2.0 * normal.dot(Cv);
  by_normal << -a, b, -b, -a;
  Eigen::Matrix<double, 2, 6> by_conic;
  by_conic.row(0) = ConicToVector(u * u.transpose() - v * v.transpose()).transpose();
  by_conic.row(1) = ConicToVector(u * v.transpose() + v * u.transpose()).transpose();
  const double model = kModelSigmaDeg * kDegree;
  covariance = by_conic * fit.Covariance() * by_conic.transpose() +
               model * model * by_normal * by_normal.transpose();
}

double CircleEquations::Chi2(const UncertainDirection& normal) const {
  const Eigen::Matrix2d J =
      by_normal * basis.transpose() * normal.covariance * basis * by_normal.transpose();
  return value.dot((covariance + J).inverse() * value);
}

bool CanLieIn(const ConicFit& fit, const UncertainDirection& normal) {
  return CircleEquations(fit, normal.direction).Chi2(normal) <= kMaxSigmas * kMaxSigmas;
}

UncertainDirection NormalOfCircles(const UncertainDirection& about, double sigma_deg,
                                   const std::vector<const ConicFit*>& circles) {
  constexpr int kSteps = 3;
  UncertainDirection normal = about;
  for (int step = 0; step < kSteps; ++step) {
    const double weight = std::pow(sigma_deg * kDegree, -2.0);
    Eigen::Matrix2d information = weight * Eigen::Matrix2d::Identity();
    const Eigen::Matrix<double, 3, 2> basis = BasisAcross(normal.direction);
    Eigen::Vector2d gradient = weight * basis.transpose() * (normal.direction - about.direction);
    for (const ConicFit* circle : circles) {
      const CircleEquations equations(*circle, normal.direction);
      const Eigen::Matrix2d JW = equations.by_normal.transpose() * equations.covariance.inverse();
      information += JW * equations.by_normal;
      gradient += JW * equations.value;
    }
    const Eigen::Matrix2d covariance = information.inverse();
    normal.direction = (normal.direction - basis * (covariance * gradient)).normalized();
    normal.covariance = basis * covariance * basis.transpose();
  }
  return normal;
}

int CircleNormals(const ConicFit& fit, std::array<UncertainDirection, 2>* normals) {
  std::array<CirclePlane, 2> planes;
  const int count = CirclePlanes(fit, &planes);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
    (*normals)[i] = {planes[i].pose.normal, planes[i].covariance};
  return count;
}

}  // namespace circline
