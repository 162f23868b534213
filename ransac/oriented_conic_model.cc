#include "circline/ransac/oriented_conic_model.h"

#include <array>
#include <cmath>
#include <utility>

#include "circline/estimators/basics.h"

namespace circline {
namespace {

// Sides shorter than this, in standard deviations of a point, have no direction to speak of.
constexpr double kMinSide = 4.0;

// Squared standard deviations by which the product of ratios may miss one: 99.8 %.
constexpr double kMaxMiss2 = 9.2;

struct Side {
  Eigen::Vector2d normal;  // Not of unit length: the side's length.
  double offset;           // normal . x + offset = 0 on the side.
};

// Adds k times the product of two lines to a conic.
void AddLinePair(double k, const Side& l, const Side& m, ConicModel::Value* conic) {
  const double px = l.normal.x(), py = l.normal.y(), qx = m.normal.x(), qy = m.normal.y();
  (*conic)[0] += k * px * qx;
  (*conic)[1] += 0.5 * k * (px * qy + py * qx);
  (*conic)[2] += k * py * qy;
  (*conic)[3] += 0.5 * k * (px * m.offset + qx * l.offset);
  (*conic)[4] += 0.5 * k * (py * m.offset + qy * l.offset);
  (*conic)[5] += k * l.offset * m.offset;
}

}  // namespace

OrientedConicModel::OrientedConicModel(ConicModel model) : ConicModel(std::move(model)) {
  tangents_.resize(normals_.size(), Eigen::Vector2d::Zero());
  for (std::size_t i = 0; i < tangents_.size(); ++i) {
    const Eigen::Vector2d& normal = normals_[i];
    if (normal.isZero(0.0)) continue;
    const std::array<double, 4>& j = points_[i].x_from_pixel;
    tangents_[i] = Eigen::Vector2d(-j[0] * normal.y() + j[1] * normal.x(),
                                   -j[2] * normal.y() + j[3] * normal.x())
                       .normalized();
  }
}

bool OrientedConicModel::Fit(const int* sample, Value* value) const {
  std::array<const Eigen::Vector2d*, 3> x;
  for (std::size_t i = 0; i < 3; ++i) x[i] = &Position(sample[i]);
  const double sigma = sigma_px_ * pixel_;
  std::array<Side, 3> sides;
  std::array<double, 3> inverse_length2;
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector2d& from = *x[(i + 1) % 3];
    const Eigen::Vector2d along = *x[(i + 2) % 3] - from;
    const double length2 = along.squaredNorm();
    if (!(length2 > kMinSide * kMinSide * sigma * sigma)) return false;
    inverse_length2[i] = 1.0 / length2;
    sides[i].normal = {-along.y(), along.x()};
    sides[i].offset = -sides[i].normal.dot(from);
  }
  // ratios[i] = k_(i + 1) / k_(i + 2), with the variance of its logarithm: the tangent turns by
  // sigma_rad, and the sides as their ends move.
  const double area = Cross(sides[0].normal, sides[1].normal);  // Twice that of the triangle.
  std::array<double, 3> ratios, variances;
  double product = 1.0, variance = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    const Eigen::Vector2d& tangent = tangents_[static_cast<std::size_t>(sample[i])];
    const double along_j = tangent.dot(sides[j].normal), along_k = tangent.dot(sides[k].normal);
    const double both = along_j * along_k;
    if (both == 0.0) return false;
    ratios[i] = -along_j / along_k;
    const double slope = area / both;
    variances[i] =
        slope * slope *
        (sigma_rad_ * sigma_rad_ + sigma * sigma * (inverse_length2[j] + inverse_length2[k]));
    variance += variances[i];
    product *= ratios[i];
  }
  if (!(product > 0.0)) return false;
  const double miss = std::log(product);
  if (!(miss * miss < kMaxMiss2 * variance)) return false;
  const double share = -miss / variance;
  const double k1 = ratios[0] * std::exp(share * variances[0]);  // With k2 = 1.
  const double k0 = 1.0 / (ratios[1] * std::exp(share * variances[1]));
  value->fill(0.0);
  AddLinePair(k0, sides[1], sides[2], value);
  AddLinePair(k1, sides[2], sides[0], value);
  AddLinePair(1.0, sides[0], sides[1], value);
  return Normalize(value);
}

}  // namespace circline
