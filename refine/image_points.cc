#include "circline/refine/image_points.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <type_traits>

#include "circline/estimators/geometric_residuals.h"
#include "circline/estimators/line.h"
#include "circline/refine/point_sums.h"

namespace circline {

void ImagePoints::Reset(const Camera& camera, const std::vector<Eigen::Vector2d>& pixels,
                        const std::vector<std::uint8_t>& inliers, const Options& options) {
  camera_ = camera;
  camera_.id.clear();  // Cameras are copied when they are shifted: a long name would allocate.
  options_ = options;
  normalization_.setIdentity();
  lens_.clear();
  points_.clear();
  pixels_.clear();
  normalized_.clear();
  seen_.clear();
  if (camera.model == CameraModel::kPinhole) options_.num_distortion = 0;
  for (int k = 0; k < options_.num_distortion; ++k) lens_.emplace_back(camera, k);
  points_.reserve(pixels.size());
  pixels_.reserve(pixels.size());
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  CalibratedPoint p;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!inliers.empty() && (i >= inliers.size() || inliers[i] == 0)) continue;
    if (!PixelToCalibrated(camera, pixels[i], &p)) continue;
    points_.push_back(p);
    pixels_.push_back(pixels[i]);
    mean += p.x;
  }
  if (points_.empty()) return;
  normalized_.reserve(points_.size());
  mean /= static_cast<double>(points_.size());
  double spread = 0.0;
  for (const CalibratedPoint& q : points_) spread += (q.x - mean).norm();
  spread /= static_cast<double>(points_.size());
  if (!(spread > 0.0)) spread = 1.0;
  normalization_ << spread, 0.0, mean.x(), 0.0, spread, mean.y(), 0.0, 0.0, 1.0;
  for (const CalibratedPoint& q : points_) normalized_.push_back(Normalize(q));
}

void ImagePoints::RemoveCurvatureBias(const Eigen::Matrix3d& conic, double sigma_px) {
  seen_.clear();
  for (std::size_t i = 0; i < size(); ++i) {
    CalibratedPoint& p = points_[i];
    // The curve's foot of the point, by Newton's method along the gradient.
    constexpr int kSteps = 2;
    Eigen::Vector2d gradient;
    Eigen::Vector3d foot = p.Homogeneous();
    for (int step = 0; step < kSteps; ++step) {
      gradient = 2.0 * (conic * foot).head<2>();
      foot.head<2>() -= foot.dot(conic * foot) / gradient.squaredNorm() * gradient;
    }
    const Eigen::Vector2d on_photo = p.GradientPerPixel(2.0 * (conic * foot).head<2>()),
                          normal = on_photo.normalized();
    const Eigen::Vector2d along = NormGradient(p, {-normal.y(), normal.x()});
    const double curvature = 2.0 * along.dot(conic.topLeftCorner<2, 2>() * along) / on_photo.norm();
    // The expansion holds where the noise is below the radius of curvature.
    const double bend = std::min(1.0, curvature * sigma_px);
    const Eigen::Vector2d back = -0.5 * sigma_px * bend * normal;
    if (!back.allFinite()) continue;
    pixels_[i] += back;
    p.x += NormGradient(p, back);
    normalized_[i] = Normalize(p);
  }
}

CalibratedPoint ImagePoints::Normalize(CalibratedPoint p) const {
  const double inverse = 1.0 / normalization_(0, 0);
  p.x = inverse * (p.x - normalization_.topRightCorner<2, 1>());
  for (double& v : p.x_from_pixel) v *= inverse;
  return p;
}

// The points as the camera with some shifts has them.
class ImagePoints::View {
 public:
  View(const ImagePoints& points, const double* shifts) : points_(points) {
    is_shifted_ = shifts != nullptr &&
                  std::any_of(shifts, shifts + kCameraSize, [](double v) { return v != 0.0; });
    if (!is_shifted_) {
      seen_ = points.points_.data();
    } else if (!points.seen_.empty() && std::equal(shifts, shifts + kCameraSize, points.seen_by_)) {
      seen_ = points.seen_.data();
    }
    if (is_shifted_) shifted_ = ShiftedCamera(points.camera_, shifts);
  }

  CalibratedPoint At(std::size_t i) const {
    return seen_ != nullptr
               ? seen_[i]
               : SeenThrough(*shifted_, points_.camera_, points_.pixels_[i], points_.points_[i]);
  }
  // Of At(i).
  CalibratedPoint Normalized(std::size_t i, const CalibratedPoint& seen) const {
    return is_shifted_ ? points_.Normalize(seen) : points_.normalized_[i];
  }

  // Distance r to a curve that stays while the camera shifts: the same as if the pixel moved the
  // other way (`by_pixel`, d r / d pixel), but for the size of a pixel, by which r itself changes,
  // along the normal `across`: with the shift, and where a lens is bent with the pixel's place,
  // too.
  template <typename Row>
  void FillCameraColumns(std::size_t i, const CalibratedPoint& p, double r,
                         Eigen::Vector2d by_pixel, const Eigen::Vector2d& across, Row* row,
                         int first) const {
    const Camera& camera = is_shifted_ ? *shifted_ : points_.camera_;
    if (camera.model != CameraModel::kPinhole) by_pixel += Bounded(r * Bend(camera, p, across));
    const Eigen::Vector2d offset = points_.pixels_[i] - Eigen::Vector2d(camera.cx, camera.cy);
    row->tail(row->size() - first).setZero();
    (*row)[first] = r - by_pixel.dot(offset);
    (*row)[first + 1] = r * across.y() * across.y() - by_pixel.y() * offset.y();
    (*row)[first + 2] = -by_pixel.x();
    (*row)[first + 3] = -by_pixel.y();
    Eigen::Matrix2d pixel_from_x;
    for (int k = 0; k < points_.options_.num_distortion; ++k) {
      const Eigen::Vector2d pixel =
          points_.lens_[static_cast<std::size_t>(k)].At(camera, p.x, &pixel_from_x);
      (*row)[first + 4 + k] =
          r * across.dot(pixel_from_x * NormGradient(p, across)) - by_pixel.dot(pixel);
    }
  }

 private:
  // The expansion holds where the lens hardly changes within the distance. Just before a lens turns
  // back it does, and a point there would seem to know the camera exactly.
  static Eigen::Vector2d Bounded(const Eigen::Vector2d& change) {
    constexpr double kMost = 0.3;  // Relative to a pixel's size.
    const double size = change.norm();
    return size > kMost ? kMost / size * change : change;
  }

  // By how much a length along `across` grows, in pixels, where its place in the photo moves on by
  // one along either axis.
  static Eigen::Vector2d Bend(const Camera& camera, const CalibratedPoint& p,
                              const Eigen::Vector2d& across) {
    constexpr double kStep = 1e-6;
    const Eigen::Vector2d along = NormGradient(p, across);
    const auto length_at = [&](const Eigen::Vector2d& x) {
      Eigen::Vector2d pixel;
      std::array<double, 4> J;
      DistortWithJacobian(camera, x, &pixel, &J);
      return across.x() * (J[0] * along.x() + J[1] * along.y()) +
             across.y() * (J[2] * along.x() + J[3] * along.y());
    };
    const double here = length_at(p.x);
    const Eigen::Vector2d by_x =
        Eigen::Vector2d(length_at(p.x + kStep * Eigen::Vector2d::UnitX()) - here,
                        length_at(p.x + kStep * Eigen::Vector2d::UnitY()) - here) /
        kStep;
    return p.GradientPerPixel(by_x);
  }

  const ImagePoints& points_;
  bool is_shifted_ = false;
  std::optional<Camera> shifted_;
  const CalibratedPoint* seen_ = nullptr;  // Null: undistorted one by one.
};

void ImagePoints::SeeThrough(const double* camera) {
  if (!seen_.empty() && std::equal(camera, camera + kCameraSize, seen_by_)) return;
  seen_.clear();
  const View view(*this, camera);
  std::copy(camera, camera + kCameraSize, seen_by_);
  for (std::size_t i = 0; i < size(); ++i) seen_.push_back(view.At(i));
}

Eigen::Vector3d ImagePoints::Middle(const double* camera) const {
  const View view(*this, camera);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < size(); ++i) middle += view.At(i).Homogeneous();
  return middle / middle.z();
}

namespace {

// A contour that lies outwards by so much is moved back, not its distance from the conic lowered by
// as much: a distance to first order is right near the conic only. Returns the unit step, pixels.
Eigen::Vector2d MoveInwards(const Eigen::Matrix3d& conic, double pixels, CalibratedPoint* p) {
  const Eigen::Vector2d inwards =
      -p->GradientPerPixel((conic * p->Homogeneous()).head<2>()).normalized();
  p->x += pixels * NormGradient(*p, inwards);
  return inwards;
}

}  // namespace

// The distance is wanted orthogonally, and defined. The smallest radius of curvature of an ellipse
// of semi-axes a >= b is b^2 / a.
bool ImagePoints::IsOrthogonal(const Eigen::Matrix3d& conic, double* level) const {
  if (options_.distance == ConicDistanceType::kSampson || points_.empty()) return false;
  *level = EllipseLevel(conic);
  if (!(conic.topLeftCorner<2, 2>().determinant() > 0.0 && *level > 0.0)) return false;
  if (options_.distance == ConicDistanceType::kOrthogonal) return true;
  constexpr double kSmallRadii = 20.0;  // Standard deviations of a point.
  const double trace = conic(0, 0) + conic(1, 1);
  const double root = std::hypot(conic(0, 0) - conic(1, 1), 2.0 * conic(0, 1));
  const double b2 = 2.0 * *level / (trace + root), a2 = 2.0 * *level / (trace - root);
  const std::array<double, 4>& J = points_.front().x_from_pixel;
  const double per_pixel = std::sqrt(std::abs(J[0] * J[3] - J[1] * J[2])) / normalization_(0, 0);
  return b2 / std::sqrt(a2) < kSmallRadii * options_.sigma_px * per_pixel;
}

// A point's distance from a conic, and where `row` is not null its derivatives.
class ImagePoints::ToConic {
 public:
  ToConic(const ImagePoints& points, const Eigen::Matrix3d& conic, double offset_px,
          const double* camera, bool offset_is_variable)
      : view_(points, camera),
        C_(points.Normalized(conic)),
        offset_px_(offset_px),
        offset_is_variable_(offset_is_variable),
        is_orthogonal_(points.IsOrthogonal(C_, &level_)) {}

  template <typename Row>
  double operator()(std::size_t i, Row* row) const {
    const Eigen::Matrix3d& C = C_;
    const CalibratedPoint seen = view_.At(i);
    CalibratedPoint p = view_.Normalized(i, seen);
    Eigen::Vector2d inwards = Eigen::Vector2d::Zero();
    if (offset_px_ != 0.0 || (row != nullptr && offset_is_variable_))
      inwards = MoveInwards(C, offset_px_, &p);
    if (row == nullptr) {
      return is_orthogonal_ ? OrthogonalDistance(p, C, level_, nullptr)
                            : 0.5 * p.Homogeneous().dot(C * p.Homogeneous()) /
                                  p.GradientPerPixel((C * p.Homogeneous()).head<2>()).norm();
    }
    Vector6d by_conic;
    Eigen::Vector2d normal = Eigen::Vector2d::Zero(), *wanted = nullptr;
    if constexpr (Row::RowsAtCompileTime > 6) wanted = &normal;
    const double d = is_orthogonal_ ? OrthogonalDistance(p, C, level_, &by_conic, wanted)
                                    : ConicDistance(p, C, &by_conic);
    row->template head<6>() = by_conic;
    if constexpr (Row::RowsAtCompileTime > 6) {
      Eigen::Vector2d by_pixel = normal;
      if (!is_orthogonal_) {  // Sampson's denominator moves with the point, too.
        const Eigen::Vector2d g = (C * p.Homogeneous()).head<2>(), G = p.GradientPerPixel(g);
        normal = G.normalized();
        const Eigen::Vector2d by_x =
            (g - d * C.topLeftCorner<2, 2>() * NormGradient(p, normal)) / G.norm();
        by_pixel = p.GradientPerPixel(by_x);
      }
      if (offset_is_variable_) (*row)[6] = by_pixel.dot(inwards);
      if constexpr (Row::RowsAtCompileTime > 7)
        view_.FillCameraColumns(i, seen, d, by_pixel, normal, row, offset_is_variable_ ? 7 : 6);
    }
    return d;
  }

 private:
  View view_;
  Eigen::Matrix3d C_;
  double offset_px_, level_ = 0.0;
  bool offset_is_variable_, is_orthogonal_;
};

double ImagePoints::SumConic(const Eigen::Matrix3d& conic, double offset_px, const double* camera,
                             const Weighing& weighing, const Variables& variables,
                             CurveModel* model) const {
  const ToConic distance(*this, conic, offset_px, camera, variables.offset);
  if (model == nullptr || (!variables.offset && !variables.camera))
    return SumPoints<6>(size(), options_, weighing, distance, model);
  if (!variables.camera) return SumPoints<7>(size(), options_, weighing, distance, model);
  return variables.offset ? SumWithCamera<7>(size(), options_, weighing, distance, model)
                          : SumWithCamera<6>(size(), options_, weighing, distance, model);
}

double ImagePoints::SumLine(const Eigen::Vector3d& line, const double* camera,
                            const Weighing& weighing, bool camera_variable,
                            CurveModel* model) const {
  const View view(*this, camera);
  const auto distance = [&](std::size_t i, auto* row) {
    const CalibratedPoint p = view.At(i);
    if (row == nullptr) return LineDistancePx(p, line);
    Eigen::Vector3d by_line;
    const double d = LineDistance(p, line, &by_line);
    row->template head<3>() = by_line;
    if constexpr (std::remove_pointer_t<decltype(row)>::RowsAtCompileTime > 3) {
      const Eigen::Vector2d normal = p.GradientPerPixel(line.head<2>()).normalized();
      view.FillCameraColumns(i, p, d, normal, normal, row, 3);
    }
    return d;
  };
  if (model == nullptr || !camera_variable)
    return SumPoints<3>(size(), options_, weighing, distance, model);
  return SumWithCamera<3>(size(), options_, weighing, distance, model);
}

void ImagePoints::ConicDistances(const Eigen::Matrix3d& conic, double offset_px,
                                 const double* camera, std::vector<double>* distances) const {
  const ToConic distance(*this, conic, offset_px, camera, false);
  distances->clear();
  for (std::size_t i = 0; i < size(); ++i)
    distances->push_back(distance(i, static_cast<Vector6d*>(nullptr)));
}

void ImagePoints::LineDistances(const Eigen::Vector3d& line, const double* camera,
                                std::vector<double>* distances) const {
  const View view(*this, camera);
  distances->clear();
  for (std::size_t i = 0; i < size(); ++i) distances->push_back(LineDistancePx(view.At(i), line));
}

}  // namespace circline
