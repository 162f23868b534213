#include "circline/refine/quadratic_models.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "circline/estimators/geometric_residuals.h"
#include "circline/estimators/line.h"
#include "circline/estimators/pose.h"

namespace circline {
namespace {

// Where a loss bends back, that much of its slope stands for the curvature, so that the model has a
// minimum. With less, a line's two points on either side of the bend throw it far off (0.1: three
// times the iterations on many short lines); with more, the last steps creep.
constexpr double kLeastCurvature = 0.4;

// Sum of rho; Cauchy's is one logarithm of a product instead of many logarithms.
template <LossType kLoss>
class RhoSum {
 public:
  void Add(double s) {
    if constexpr (kLoss == LossType::kCauchy) {
      product_ *= 1.0 + s * (1.0 / (kC * kC));
      if (product_ > 1e200) Flush();
    } else {
      sum_ += LossRho(kLoss, s);
    }
  }
  double Total() {
    if constexpr (kLoss == LossType::kCauchy) Flush();
    return sum_;
  }

 private:
  static constexpr double kC = LossTuningConstant(kLoss);

  void Flush() {
    sum_ += kC * kC * std::log(product_);
    product_ = 1.0;
  }

  double sum_ = 0.0, product_ = 1.0;
};

// Slope and (not negative) curvature by the residual of 1/2 rho(r^2).
struct Weights {
  double slope, curvature;
};

template <LossType kLoss>
Weights LossWeights(double s) {
  const LossSlopes loss = LossSlopesAt(kLoss, s);
  return {loss.first, std::max(loss.first + 2.0 * s * loss.second, kLeastCurvature * loss.first)};
}

// hessian += weight j j^T, its lower half; unrolled by the compiler.
template <int kSize>
void AddOuterProduct(const Eigen::Matrix<double, kSize, 1>& j, double weight,
                     Eigen::Matrix<double, kSize, kSize>* hessian) {
  for (int c = 0; c < kSize; ++c) {
    const double scaled = weight * j[c];
    for (int r = c; r < kSize; ++r) (*hessian)(r, c) += scaled * j[r];
  }
}

// Sums a set's residuals: `distance(point, jacobian)` in pixels, jacobian a vector of kSize, not
// asked for where `hessian` is null. Adds to gradient and hessian (lower half), returns the cost.
template <LossType kLoss, int kSize, typename Distance>
double SumRobust(const PointSet& set, double stretch, const Distance& distance,
                 Eigen::Matrix<double, kSize, 1>* gradient,
                 Eigen::Matrix<double, kSize, kSize>* hessian) {
  const double inverse_sigma = 1.0 / set.sigma_px, inverse_width = inverse_sigma / stretch;
  const double weight = set.weight * inverse_sigma * inverse_sigma;
  RhoSum<kLoss> rho;
  Eigen::Matrix<double, kSize, 1> jacobian;
  for (const CalibratedPoint& p : set.points) {
    const double d = distance(p, hessian != nullptr ? &jacobian : nullptr);
    const double u = d * inverse_width;
    const double s = u * u;
    rho.Add(s);
    if (hessian == nullptr) continue;
    const Weights w = LossWeights<kLoss>(s);
    *gradient += (weight * w.slope * d) * jacobian;
    AddOuterProduct<kSize>(jacobian, weight * w.curvature, hessian);
  }
  return 0.5 * set.weight * stretch * stretch * rho.Total();
}

template <int kSize, typename Distance>
double SumInliers(const PointSet& set, double stretch, const Distance& distance,
                  Eigen::Matrix<double, kSize, 1>* gradient,
                  Eigen::Matrix<double, kSize, kSize>* hessian) {
  const double weight = set.weight / (set.sigma_px * set.sigma_px);
  const double gate = stretch * kInlierSigmas * set.sigma_px;
  double squares = 0.0;
  Eigen::Matrix<double, kSize, 1> jacobian;
  for (const CalibratedPoint& p : set.points) {
    const double d = distance(p, &jacobian);
    if (!(std::abs(d) <= gate)) continue;
    squares += d * d;
    if (hessian == nullptr) continue;
    *gradient += weight * d * jacobian;
    AddOuterProduct<kSize>(jacobian, weight, hessian);
  }
  return 0.5 * weight * squares;
}

template <int kSize, typename Distance>
double SumSet(const PointSet& set, const SetWeighing& weighing, const Distance& distance,
              Eigen::Matrix<double, kSize, 1>* gradient,
              Eigen::Matrix<double, kSize, kSize>* hessian) {
  if (weighing.inliers_only)
    return SumInliers<kSize>(set, weighing.stretch, distance, gradient, hessian);
  const auto sum = [&](auto loss) {
    return SumRobust<decltype(loss)::value, kSize>(set, weighing.stretch, distance, gradient,
                                                   hessian);
  };
  switch (set.loss) {
    case LossType::kTrivial:
      break;
    case LossType::kHuber:
      return sum(std::integral_constant<LossType, LossType::kHuber>());
    case LossType::kSoftLOne:
      return sum(std::integral_constant<LossType, LossType::kSoftLOne>());
    case LossType::kCauchy:
      return sum(std::integral_constant<LossType, LossType::kCauchy>());
    case LossType::kArctan:
      return sum(std::integral_constant<LossType, LossType::kArctan>());
    case LossType::kTukey:
      return sum(std::integral_constant<LossType, LossType::kTukey>());
    case LossType::kGemanMcClure:
      return sum(std::integral_constant<LossType, LossType::kGemanMcClure>());
  }
  return sum(std::integral_constant<LossType, LossType::kTrivial>());
}

// SumRobust of distances to a line without loss, from the points' scatter S alone: with q = l^T S l
// and D = diag(what a pixel is worth, squared), g^2 = l^T D l, they sum to q / g^2.
double SumScatter(const PointSet& set, const Eigen::Vector3d& line, Eigen::Vector3d* gradient,
                  Eigen::Matrix3d* hessian) {
  const CalibratedPoint& p = set.points.front();
  const Eigen::Vector2d g = p.GradientPerPixel(line.head<2>());
  const double weight = set.weight / (set.sigma_px * set.sigma_px * g.squaredNorm());
  const Eigen::Vector3d Sl = *set.scatter * line;
  const double q = line.dot(Sl);
  if (hessian != nullptr) {
    Eigen::Vector3d Dl = Eigen::Vector3d::Zero();  // Over g^2.
    Dl.head<2>() = NormGradient(p, g) / g.squaredNorm();
    *gradient += weight * (Sl - q * Dl);
    *hessian += weight * (*set.scatter - Sl * Dl.transpose() - Dl * Sl.transpose() +
                          q * Dl * Dl.transpose());
  }
  return 0.5 * weight * q;
}

// A calibrated point x meets the plane at y = R^T x; with Q the circle in (X, Y, 1) and (X, Y, 1) ~
// (y1, y2, facing y3), the image is R M R^T, M = D Q D, D = diag(1, 1, facing).
Eigen::Matrix3d PlaneCircle(double facing, double cx, double cy, double radius) {
  Eigen::Matrix3d M;
  M << 1.0, 0.0, -facing * cx, 0.0, 1.0, -facing * cy, -facing * cx, -facing * cy,
      cx * cx + cy * cy - radius * radius;
  return M;
}

// d ConicToVector(A M A^T) / d (body rotation, cx, cy, radius).
Matrix6d CircleJacobian(const Eigen::Matrix3d& A, const Eigen::Matrix3d& M, double facing,
                        double cx, double cy, double radius) {
  Matrix6d jacobian;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Matrix3d WM = CrossMatrix(Eigen::Vector3d::Unit(k)) * M;  // M W = -(W M)^T.
    jacobian.col(k) = ConicToVector(A * (WM + WM.transpose()) * A.transpose());
  }
  const Eigen::Matrix3d zz = A.col(2) * A.col(2).transpose();
  for (int k = 0; k < 2; ++k) {
    const Eigen::Matrix3d kz = A.col(k) * A.col(2).transpose();
    jacobian.col(3 + k) =
        ConicToVector(2.0 * (k == 0 ? cx : cy) * zz - facing * (kz + kz.transpose()));
  }
  jacobian.col(5) = ConicToVector(-2.0 * radius * zz);
  return jacobian;
}

// Matrix that takes the set's own coordinates to calibrated ones.
Eigen::Matrix3d FromSet(const PointSet& set) {
  Eigen::Matrix3d N;
  N << set.scale, 0.0, set.shift.x(), 0.0, set.scale, set.shift.y(), 0.0, 0.0, 1.0;
  return N;
}

double ConicDistanceOnly(const CalibratedPoint& p, const Eigen::Matrix3d& C) {
  const double x = p.x.x(), y = p.x.y();
  const double px = C(0, 0) * x + C(0, 1) * y + C(0, 2);
  const double py = C(0, 1) * x + C(1, 1) * y + C(1, 2);
  const double pz = C(0, 2) * x + C(1, 2) * y + C(2, 2);
  return 0.5 * (x * px + y * py + pz) / p.GradientPerPixel({px, py}).norm();
}

// True if orthogonal distances to the image of a plane's circle are asked for, and defined.
bool IsOrthogonal(const PointSet& set, const Eigen::Matrix3d& conic, double* level) {
  if (set.distance == ConicDistanceType::kSampson) return false;
  *level = EllipseLevel(conic);
  return conic.topLeftCorner<2, 2>().determinant() > 0.0 && *level > 0.0;
}

double SumContour(const PointSet& set, const SetWeighing& weighing, const Eigen::Matrix3d& conic,
                  Vector6d* gradient, Matrix6d* hessian) {
  double level;
  if (IsOrthogonal(set, conic, &level)) {
    const auto distance = [&conic, level](const CalibratedPoint& p, Vector6d* jacobian) {
      return OrthogonalDistance(p, conic, level, jacobian);
    };
    return SumSet<6>(set, weighing, distance, gradient, hessian);
  }
  const auto distance = [&conic](const CalibratedPoint& p, Vector6d* jacobian) {
    return jacobian == nullptr ? ConicDistanceOnly(p, conic) : ConicDistance(p, conic, jacobian);
  };
  return SumSet<6>(set, weighing, distance, gradient, hessian);
}

Eigen::Matrix2d PixelFromX(const CalibratedPoint& p) {
  Eigen::Matrix2d x_from_pixel;
  x_from_pixel << p.x_from_pixel[0], p.x_from_pixel[1], p.x_from_pixel[2], p.x_from_pixel[3];
  return x_from_pixel.inverse();
}

}  // namespace

void PointSet::Normalize() {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const CalibratedPoint& p : points) mean += p.x / static_cast<double>(points.size());
  double spread = 0.0;
  for (const CalibratedPoint& p : points)
    spread += (p.x - mean).norm() / static_cast<double>(points.size());
  if (!(spread > 0.0)) return;
  for (CalibratedPoint& p : points) {
    p.x = (p.x - mean) / spread;
    for (double& v : p.x_from_pixel) v /= spread;
  }
  shift += scale * mean;
  scale *= spread;
}

void PointSet::Compress() {
  constexpr std::size_t kFew = 4;  // Below, the points themselves are as quick.
  if (loss != LossType::kTrivial || points.size() < kFew) return;
  const auto same = [this](const CalibratedPoint& p) {
    return p.x_from_pixel == points.front().x_from_pixel;
  };
  if (!std::all_of(points.begin(), points.end(), same)) return;
  scatter = Eigen::Matrix3d::Zero();
  for (const CalibratedPoint& p : points) *scatter += p.Homogeneous() * p.Homogeneous().transpose();
}

Eigen::Matrix3d ImageOfPlaneCircle(const Eigen::Matrix3d& R, double facing, double cx, double cy,
                                   double radius) {
  return R * PlaneCircle(facing, cx, cy, radius) * R.transpose();
}

double EvaluateCircle(const PointSet& set, const SetWeighing& weighing, const Eigen::Matrix3d& R,
                      double facing, double cx, double cy, double radius, QuadraticModel* model) {
  const Eigen::Matrix3d A = FromSet(set).transpose() * R;
  const Eigen::Matrix3d M = PlaneCircle(facing, cx, cy, radius);
  const Eigen::Matrix3d conic = A * M * A.transpose();
  if (model == nullptr) return SumContour(set, weighing, conic, nullptr, nullptr);
  Vector6d gradient = Vector6d::Zero();
  Matrix6d hessian = Matrix6d::Zero();
  model->cost = SumContour(set, weighing, conic, &gradient, &hessian);
  const Matrix6d J = CircleJacobian(A, M, facing, cx, cy, radius);
  hessian.triangularView<Eigen::StrictlyUpper>() = hessian.transpose();
  model->gradient = J.transpose().lazyProduct(gradient);
  const Matrix6d HJ = hessian.lazyProduct(J);
  model->hessian = J.transpose().lazyProduct(HJ);
  return model->cost;
}

double EvaluateLine(const PointSet& set, const SetWeighing& weighing, const Eigen::Matrix3d& R,
                    const Eigen::Vector3d& m, const Eigen::Matrix3d& dm, QuadraticModel* model) {
  const Eigen::Vector3d line = R * m;
  const auto distance = [&line](const CalibratedPoint& p, Eigen::Vector3d* jacobian) {
    return jacobian == nullptr ? LineDistancePx(p, line) : LineDistance(p, line, jacobian);
  };
  const auto sum = [&](Eigen::Vector3d* gradient, Eigen::Matrix3d* hessian) {
    return set.scatter && !weighing.inliers_only
               ? SumScatter(set, line, gradient, hessian)
               : SumSet<3>(set, weighing, distance, gradient, hessian);
  };
  if (model == nullptr) return sum(nullptr, nullptr);
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  model->cost = sum(&gradient, &hessian);
  Eigen::Matrix<double, 3, 6> J;
  J << -R * CrossMatrix(m), R * dm;
  hessian.triangularView<Eigen::StrictlyUpper>() = hessian.transpose();
  model->gradient = J.transpose().lazyProduct(gradient);
  const Eigen::Matrix<double, 3, 6> HJ = hessian.lazyProduct(J);
  model->hessian = J.transpose().lazyProduct(HJ);
  return model->cost;
}

double PointMissPx(const MeasuredPoint& measured, const Eigen::Matrix3d& R, double facing, double X,
                   double Y) {
  const Eigen::Vector3d p = R * Eigen::Vector3d(X, Y, facing);
  if (!(p.z() > 0.0)) return std::numeric_limits<double>::infinity();
  return (PixelFromX(measured.x) * (p.head<2>() / p.z() - measured.x.x)).norm();
}

double EvaluatePoint(const MeasuredPoint& measured, const SetWeighing& weighing,
                     const Eigen::Matrix3d& R, double facing, double X, double Y,
                     QuadraticModel* model) {
  const Eigen::Vector3d in_world(X, Y, facing);
  const Eigen::Vector3d p = R * in_world;
  if (!(p.z() > 0.0)) return std::numeric_limits<double>::infinity();  // Behind the camera.
  const Eigen::Matrix2d whiten = PixelFromX(measured.x) / measured.sigma_px;
  const Eigen::Vector2d miss = whiten * (p.head<2>() / p.z() - measured.x.x);
  const double stretch2 = weighing.stretch * weighing.stretch;
  const double s = miss.squaredNorm() / stretch2;
  double cost = 0.5 * stretch2 * LossRho(measured.loss, s), slope = 1.0, along = 1.0;
  if (weighing.inliers_only) {
    cost = 0.5 * miss.squaredNorm();
  } else {
    const LossSlopes loss = LossSlopesAt(measured.loss, s);
    slope = loss.first;
    along = std::max(slope + 2.0 * s * loss.second, kLeastCurvature * slope);
  }
  if (model == nullptr) return cost;
  Eigen::Matrix<double, 2, 3> project;
  project << 1.0, 0.0, -p.x() / p.z(), 0.0, 1.0, -p.y() / p.z();
  const Eigen::Matrix<double, 2, 3> by_point = whiten * project / p.z();
  Eigen::Matrix<double, 2, 5> J;
  J << -by_point * R * CrossMatrix(in_world), (by_point * R).leftCols<2>();
  Eigen::Matrix2d W = slope * Eigen::Matrix2d::Identity();
  if (s > 0.0) W += (along - slope) / miss.squaredNorm() * miss * miss.transpose();
  *model = QuadraticModel();
  model->cost = cost;
  model->gradient.head<5>() = slope * J.transpose() * miss;
  model->hessian.topLeftCorner<5, 5>() = J.transpose() * W * J;
  return cost;
}

double EvaluateAngle(double value, double sigma, const double theta[2], QuadraticModel* model) {
  // Directions have no sense: the difference counts modulo 180 degrees, and so does its sign.
  constexpr double kPi = 3.14159265358979323846;
  const double difference = theta[1] - theta[0];
  const double plus = std::remainder(difference - value, kPi),
               minus = std::remainder(difference + value, kPi);
  const double residual = (std::abs(plus) < std::abs(minus) ? plus : minus) / sigma;
  const double cost = 0.5 * residual * residual;
  if (model == nullptr) return cost;
  const Eigen::Vector2d jacobian(-1.0 / sigma, 1.0 / sigma);
  *model = QuadraticModel();
  model->cost = cost;
  model->gradient.head<2>() = residual * jacobian;
  model->hessian.topLeftCorner<2, 2>() = jacobian * jacobian.transpose();
  return cost;
}

double EvaluateLength(double length, const double a[2], const double b[2], double scale,
                      QuadraticModel* model) {
  constexpr double kRelativeSigma = 1e-4;
  const Eigen::Vector2d difference(b[0] - a[0], b[1] - a[1]);
  const double distance = difference.norm();
  if (!(distance > 0.0) || !(scale > 0.0)) return std::numeric_limits<double>::infinity();
  const double residual = std::log(distance / (length * scale)) / kRelativeSigma;
  const double cost = 0.5 * residual * residual;
  if (model == nullptr) return cost;
  const Eigen::Vector2d gradient = difference / (distance * distance * kRelativeSigma);
  Eigen::Matrix<double, 5, 1> jacobian;
  jacobian << -gradient, gradient, -1.0 / (scale * kRelativeSigma);
  *model = QuadraticModel();
  model->cost = cost;
  model->gradient.head<5>() = residual * jacobian;
  model->hessian.topLeftCorner<5, 5>() = jacobian * jacobian.transpose();
  return cost;
}

void ConicDistances(const PointSet& set, const Eigen::Matrix3d& conic, std::vector<double>* out) {
  const Eigen::Matrix3d N = FromSet(set);
  const Eigen::Matrix3d own = N.transpose() * conic * N;
  out->clear();
  double level;
  const bool orthogonal = IsOrthogonal(set, own, &level);
  for (const CalibratedPoint& p : set.points) {
    out->push_back(orthogonal ? OrthogonalDistance(p, own, level, nullptr)
                              : ConicDistanceOnly(p, own));
  }
}

void LineDistances(const PointSet& set, const Eigen::Vector3d& line, std::vector<double>* out) {
  out->clear();
  for (const CalibratedPoint& p : set.points) out->push_back(LineDistancePx(p, line));
}

}  // namespace circline
