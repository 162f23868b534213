// The ellipse of least orthogonal distances to contour points. Internal: not installed.
#ifndef CIRCLINE_ESTIMATORS_CONIC_DISTANCE_H_
#define CIRCLINE_ESTIMATORS_CONIC_DISTANCE_H_

#include <Eigen/Core>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/conic_moments.h"

namespace circline {

// Points that count, normalised, column by column: what is read and written once a pass.
class PointDistances {
 public:
  // `memory` (optional) is used as long as this lives, and is kept for others.
  PointDistances(const std::vector<CalibratedPoint>& points, const std::vector<double>* weights,
                 const Normalization& normalization, std::vector<double>* memory);
  PointDistances(const PointDistances&) = delete;
  PointDistances& operator=(const PointDistances&) = delete;

  // Sums over the points at signed distances r to an ellipse (pixels, negative inside), weights w.
  struct NormalEquations {
    Matrix6d information;  // Sum w j j^T, j = d r / d ConicToVector(conic).
    Vector6d gradient;     // Sum w r j.
    double cost, weight;   // Sum w r^2, sum w.
  };
  NormalEquations Linearize(const Eigen::Matrix3d& conic);

 private:
  static constexpr int kLanes = 4;
  using Lanes = Eigen::Array<double, kLanes, 1>;

  enum Column {
    kX,
    kY,
    kJ00,
    kJ01,
    kJ10,
    kJ11,
    kWeight,
    kFootX,
    kFootY,
    kScatter,
    kGradient,
    kEnd
  };

  auto At(Column column, Eigen::Index i) { return data_.col(column).segment<kLanes>(i); }
  double FindFeet(Eigen::Index i, const Eigen::Matrix3d& conic, double level);

  std::vector<double> own_memory_;
  Eigen::Map<Eigen::Array<double, Eigen::Dynamic, kEnd>> data_;
  Eigen::Index size_ = 0;
};

struct Minimum {
  Eigen::Matrix3d conic = Eigen::Matrix3d::Zero();  // Normalised coordinates.
  PointDistances::NormalEquations equations;
  int iterations = 0;
};

// Levenberg-Marquardt from `initial`, an ellipse; never leaves the ellipses. False where the
// distances are not finite.
bool MinimizeDistances(const Eigen::Matrix3d& initial, PointDistances* contour, Minimum* minimum);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_CONIC_DISTANCE_H_
