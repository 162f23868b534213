// Planks under a plate: what pencils of unknown planes tell of the two poses of a circle.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/directions.h"
#include "circline/estimators/pencil_lean.h"
#include "circline/refine/joint_result.h"

namespace circline {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Of the pencils beside a circle (planks under a plate, shelves beside a clock) half are taken to
// run along one of three directions at right angles, of which two lie in the circle's plane and one
// is its normal; the others run any way. Not tuned.
constexpr double kInPlane = 1.0 / 3.0, kAlongNormal = 1.0 / 6.0;

// A pencil that is taken for one of a plane.
struct RelatedPencil {
  VanishingPointFit fit;  // Its covariance with what the walls that carry its lines may lean by.
  // Of that covariance: what is not exact beside the points is known no better than as many lines
  // tell, and the direction's error has Student's distribution.
  double freedom;

  RelatedPencil(const PencilObservation& pencil, const NoiseModel& noise) : fit(*pencil.fit) {
    constexpr double kUnknowns = 2.0;  // Of a direction.
    constexpr double kExact = 1e6;     // As good as a Gaussian.
    const double lean = kLeaning * noise.pencil_axis_rad;
    fit.covariance += lean * lean * LeanShape(pencil);
    freedom =
        lean > 0.0 ? std::max(1.0, static_cast<double>(pencil.lines.size()) - kUnknowns) : kExact;
  }
};

// A direction as a hypothesis sees it.
struct SeenDirection {
  Vector3d direction;  // Unit, camera frame.
  Matrix3d covariance;
  Vector3d by_focal;  // Its derivative by the focal scale.
  double freedom;     // As the pencil's.

  SeenDirection(const RelatedPencil& pencil, const PoseHypothesis& h, const Camera& given)
      : freedom(pencil.freedom) {
    const VanishingPointFit& fit = pencil.fit;
    const Matrix3d change = ChangeOfCamera(given, CameraOf(h, given));
    const Vector3d moved = change * fit.direction;
    direction = moved.normalized();
    const Matrix3d across = Matrix3d::Identity() - direction * direction.transpose(),
                   by_fit = across * change / moved.norm();
    covariance = by_fit * fit.covariance * by_fit.transpose();
    by_focal = direction.z() / h.focal_scale * across.col(2);
  }
};

// Covariance of by_turn * delta + by_focal * scale: the rotation's error and the focal scale's.
template <int N>
Eigen::Matrix<double, N, N> CovarianceOf(const PoseHypothesis& h,
                                         const Eigen::Matrix<double, N, 3>& by_turn,
                                         const Eigen::Matrix<double, N, 1>& by_focal) {
  Eigen::Matrix4d joint = Eigen::Matrix4d::Zero();
  joint.topLeftCorner<3, 3>() = h.Covariance().topLeftCorner<3, 3>();
  joint.topRightCorner<3, 1>() = Eigen::Map<const Vector3d>(h.focal_covariance.data());
  joint.bottomLeftCorner<1, 3>() = joint.topRightCorner<3, 1>().transpose();
  joint(3, 3) = h.focal_sigma * h.focal_sigma;
  Eigen::Matrix<double, N, 4> by_both;
  by_both << by_turn, by_focal;
  return by_both * joint * by_both.transpose();
}

// How much likelier the direction is of lines in the plane than of those that run any way, whose
// sine against the plane is uniform from -1 to 1.
double RatioInPlane(const PoseHypothesis& h, const SeenDirection& seen) {
  const Vector3d normal = h.cam_from_world.rotation.col(2);
  const double sine = normal.dot(seen.direction);
  const Eigen::Matrix<double, 1, 3> by_turn = normal.cross(seen.direction).transpose();
  const Eigen::Matrix<double, 1, 1> by_focal(normal.dot(seen.by_focal));
  const double variance =
      normal.dot(seen.covariance * normal) + CovarianceOf<1>(h, by_turn, by_focal).value();
  const double nu = seen.freedom;
  const double peak = std::exp(std::lgamma(0.5 * nu + 0.5) - std::lgamma(0.5 * nu)) /
                      std::sqrt(nu * kPi * variance);
  return 2.0 * peak * std::pow(1.0 + sine * sine / (nu * variance), -0.5 * (nu + 1.0));
}

// The same of lines along the normal: what runs any way is uniform on a hemisphere, 2 pi.
double RatioAlongNormal(const PoseHypothesis& h, const SeenDirection& seen) {
  const Vector3d& towards = h.cam_from_world.rotation.col(2);
  const Vector3d normal = towards.dot(seen.direction) < 0.0 ? Vector3d(-towards) : towards;
  const Eigen::Matrix<double, 3, 2> across = BasisAcross(seen.direction);
  const Vector2d miss = across.transpose() * normal;
  const Eigen::Matrix<double, 2, 3> by_turn = -across.transpose() * CrossMatrix(normal);
  const Vector2d by_focal = -across.transpose() * seen.by_focal;
  const Matrix2d covariance =
      across.transpose() * seen.covariance * across + CovarianceOf<2>(h, by_turn, by_focal);
  const double nu = seen.freedom, squares = miss.dot(covariance.inverse() * miss);
  return std::pow(1.0 + squares / nu, -0.5 * (nu + 2.0)) / std::sqrt(covariance.determinant());
}

double RatioBeside(const PoseHypothesis& h, const SeenDirection& seen) {
  return 1.0 - kInPlane - kAlongNormal + kInPlane * RatioInPlane(h, seen) +
         kAlongNormal * RatioAlongNormal(h, seen);
}

// Whether the circles alone tell the plane, and every hypothesis knows how well.
bool AreOfCirclesAlone(const std::vector<Refined>& all) {
  return std::all_of(all.begin(), all.end(), [](const Refined& r) {
    return r.hypothesis.RotationIsFree() && std::isfinite(r.hypothesis.SigmaNormal());
  });
}

}  // namespace

void WeighByPencils(const JointProblem& problem, std::vector<Refined>* all) {
  if (!AreOfCirclesAlone(*all)) return;
  for (const PencilObservation& pencil : problem.observations().pencils) {
    const bool is_free = pencil.direction == PencilDirection::kFree && pencil.plane.empty();
    if (!is_free || !pencil.fit) continue;
    const RelatedPencil related(pencil, problem.options().noise_model);
    std::vector<double> ratios;
    for (const Refined& r : *all) {
      const SeenDirection seen(related, r.hypothesis, problem.observations().camera);
      ratios.push_back(RatioBeside(r.hypothesis, seen));
    }
    const auto is_number = [](double ratio) { return std::isfinite(ratio); };
    if (!std::all_of(ratios.begin(), ratios.end(), is_number)) continue;  // Beyond all sigmas.
    const double best = *std::max_element(ratios.begin(), ratios.end());
    constexpr double kTold = 2.0;  // Odds of planes that are worth a note.
    for (std::size_t i = 0; i < all->size(); ++i) {
      Refined& refined = (*all)[i];
      refined.hypothesis.cost += std::log(best / ratios[i]);
      if (ratios[i] > kTold * *std::min_element(ratios.begin(), ratios.end()))
        refined.notes.push_back("pencil '" + pencil.id +
                                "': runs in the plane of the circles, or along its normal, rather "
                                "than of another pose's");
    }
  }
}

}  // namespace circline
