#include "circline/estimators/closed_form_errors.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "circline/estimators/directions.h"
#include "circline/estimators/line_pose.h"

namespace circline {
namespace {

// c^T C^+ c, of a covariance of any rank; infinite where C is.
double SquaredDistance(const Eigen::VectorXd& c, const Eigen::MatrixXd& C) {
  if (!C.allFinite()) return std::numeric_limits<double>::infinity();
  return c.dot(C.completeOrthogonalDecomposition().solve(c));
}

// Adds an error of a unit vector, or of a line's normal: its covariance across the vector, over the
// variance `sigma_rad` squared.
void AddAngularError(double sigma_rad, const Eigen::Matrix3d& shape, Measured* m) {
  if (!m->present() || sigma_rad == 0.0) return;
  const Eigen::Vector3d v = m->value;
  const Eigen::Matrix<double, 3, 2> across = BasisAcross(v.normalized());
  const Eigen::Matrix2d root =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(across.transpose() * shape * across)
          .operatorSqrt();
  const Eigen::Index old = m->columns.cols();
  m->columns.conservativeResize(3, old + 2);
  m->columns.rightCols<2>() = sigma_rad * v.norm() * across * root;
}

// After the change of calibrated coordinates x' = A x.
void ChangeCoordinates(const Eigen::Matrix3d& A, const MovedInput& input) {
  Eigen::Map<Eigen::Vector3d> vector(input.value);
  Eigen::Map<Vector6d> conic(input.value);
  switch (input.kind) {
    case InputKind::kPoint:
      vector = (A * vector).eval();
      return;
    case InputKind::kLine:
      vector = (A.inverse().transpose() * vector).eval();
      return;
    case InputKind::kConic:
      conic = ConicToVector(TransformConic(VectorToConic(conic), A.inverse()));
      return;
    case InputKind::kNumber:
      return;
  }
}

// The errors of focal length, aspect and principal point.
void AddCameraErrors(const CameraSigma& sigma, const Camera& camera,
                     std::vector<Perturbation>* all) {
  const auto add = [all](double deviation, double x_scale, double y_scale, double x, double y) {
    if (deviation == 0.0) return;
    all->push_back([=](double part, const std::vector<MovedInput>& moved) {
      const double s = part * deviation;
      Eigen::Matrix3d A = Eigen::Matrix3d::Identity();
      A(0, 0) = std::exp(s * x_scale);
      A(1, 1) = std::exp(s * y_scale);
      A(0, 2) = s * x;
      A(1, 2) = s * y;
      for (const MovedInput& input : moved) ChangeCoordinates(A, input);
    });
  };
  add(sigma.log_focal, 1.0, 1.0, 0.0, 0.0);
  add(sigma.log_aspect, 0.0, 1.0, 0.0, 0.0);
  add(sigma.principal_point_px, 0.0, 0.0, 1.0 / camera.fx, 0.0);
  add(sigma.principal_point_px, 0.0, 0.0, 0.0, 1.0 / camera.fy);
}

// Both semi-axes longer by so much: of the curve at a distance from an ellipse, the ellipse nearest
// to it. The same conic where that is none.
Eigen::Matrix3d GrownEllipse(const Eigen::Matrix3d& conic, double by) {
  Ellipse ellipse;
  if (!ConicToEllipse(conic, &ellipse) || !(ellipse.b + by > 0.0)) return conic;
  ellipse.a += by;
  ellipse.b += by;
  return EllipseToConic(ellipse);
}

// The image of an oval instead of a circle, seen from afar: what perspective makes of it is of
// second order. A share of the radius, of one of two components: longer along the axes of the
// ellipse, or between them.
Eigen::Matrix3d OvalEllipse(const Eigen::Matrix3d& conic, bool along_axes, double share) {
  Ellipse e;
  if (!ConicToEllipse(conic, &e)) return conic;
  // The circle is u^T u = 1, u = T x, the oval u^T (I - 2 S) u = 1.
  Eigen::Matrix3d oval = Eigen::Vector3d(1.0, 1.0, -1.0).asDiagonal();
  if (along_axes) oval.diagonal().head<2>() += 2.0 * share * Eigen::Vector2d(-1.0, 1.0);
  if (!along_axes) oval(0, 1) = oval(1, 0) = -2.0 * share;
  Eigen::Matrix3d T = Eigen::Matrix3d::Identity();
  T.topLeftCorner<2, 2>() = Eigen::Vector2d(1.0 / e.a, 1.0 / e.b).asDiagonal() *
                            Eigen::Rotation2Dd(-e.angle).toRotationMatrix();
  T.topRightCorner<2, 1>() = -T.topLeftCorner<2, 2>() * e.center;
  const Eigen::Matrix3d out = T.transpose() * oval * T;
  return out / out.norm();
}

const Eigen::Matrix3d& RotationOf(const Candidate& candidate) { return candidate.pose.rotation; }
const Eigen::Matrix3d& RotationOf(const Eigen::Matrix3d& rotation) { return rotation; }

// The one of one or more whose rotation is nearest to the reference's.
template <typename Range>
auto Nearest(const Range& range, const Candidate& reference) {
  const auto angle = [&](const auto& x) {
    return RotationAngle(RotationOf(x), reference.pose.rotation);
  };
  return *std::min_element(range.begin(), range.end(),
                           [&](const auto& a, const auto& b) { return angle(a) < angle(b); });
}

// Half the difference of two perturbed candidates, in rows [delta, delta_t, contradiction].
Eigen::VectorXd HalfDifference(const Candidate& plus, const Candidate& minus,
                               const Candidate& reference) {
  // A perturbation may tip the convention that settles the senses of the axes; that is no error.
  const Eigen::Matrix3d high = Nearest(SignChoices(plus.pose.rotation), reference),
                        low = Nearest(SignChoices(minus.pose.rotation), reference);
  Eigen::VectorXd half(6 + reference.contradiction.size());
  half.head<3>() = 0.5 * LogRotation(high * low.transpose());
  half.segment<3>(3) = 0.5 * (plus.pose.translation - minus.pose.translation);
  half.tail(half.size() - 6) = 0.5 * (plus.contradiction - minus.contradiction);
  return half;
}

// Statistical linearisation: every error, one standard deviation up and down, through the closed
// form itself; a part of that where it would lead to no pose (beyond the ellipses). Returns for
// each candidate columns of [delta, delta_t, contradiction].
std::vector<Eigen::MatrixXd> Sensitivities(const std::vector<Candidate>& candidates,
                                           const PerturbedCandidates& perturbed,
                                           std::size_t num_errors) {
  constexpr double kShrink = 0.1, kSmallestPart = 1e-4;
  const auto num_columns = static_cast<Eigen::Index>(num_errors);
  std::vector<Eigen::MatrixXd> matrices;
  for (const Candidate& c : candidates)
    matrices.emplace_back(Eigen::MatrixXd::Zero(6 + c.contradiction.size(), num_columns));
  for (std::size_t error = 0; error < num_errors; ++error) {
    for (double part = 1.0; part > kSmallestPart; part *= kShrink) {
      const std::vector<Candidate> plus = perturbed(error, part);
      const std::vector<Candidate> minus = perturbed(error, -part);
      if (plus.empty() || minus.empty()) continue;
      for (std::size_t i = 0; i < candidates.size(); ++i) {
        const Candidate& c = candidates[i];
        matrices[i].col(static_cast<Eigen::Index>(error)) =
            HalfDifference(Nearest(plus, c), Nearest(minus, c), c) / part;
      }
      break;
    }
  }
  return matrices;
}

// Fills covariance, rank and cost, of the candidate's sensitivity `S`.
void FillUncertainty(const Eigen::MatrixXd& S, const Candidate& candidate, PoseHypothesis* h) {
  Eigen::Matrix<double, 6, Eigen::Dynamic> root = S.topRows<6>();
  const auto leave_out = [&root](const Vector6d& free) {
    root -= free * (free.transpose() * root);
  };
  for (const std::array<double, 6>& direction : h->free_directions)
    leave_out(Eigen::Map<const Vector6d>(direction.data()));
  Vector6d length = Vector6d::Zero();
  length.tail<3>() = h->cam_from_world.translation;
  if (!h->metric) leave_out(length);
  SetCovariance(root * root.transpose(), h, h->metric ? 6 : 5);
  if (candidate.contradiction.size() > 0) {
    const Eigen::MatrixXd tail = S.bottomRows(candidate.contradiction.size());
    h->cost = 0.5 * SquaredDistance(candidate.contradiction, tail * tail.transpose());
    if (!std::isfinite(h->cost)) h->cost = 0.5 * std::numeric_limits<double>::max();
  }
}

}  // namespace

void AddModelErrors(const NoiseModel& noise, Inputs* inputs) {
  for (std::size_t k = 0; k < inputs->directions.size(); ++k)
    AddAngularError(noise.pencil_axis_rad, inputs->lean_shapes[k], &inputs->directions[k]);
  // A line that an axis is drawn on is that axis.
  const Eigen::Matrix3d alike = Eigen::Matrix3d::Identity();
  if (!inputs->x_sense) AddAngularError(noise.pencil_axis_rad, alike, &inputs->x_line);
  if (!inputs->y_sense) AddAngularError(noise.pencil_axis_rad, alike, &inputs->y_line);
  const double tilt_variance = noise.circle_tilt_rad * noise.circle_tilt_rad;
  for (MeasuredCircle& circle : inputs->circles) {
    circle.tilt.columns = noise.circle_tilt_rad * Eigen::Matrix2d::Identity();
    circle.normal_weight = 1.0 / (1.0 / circle.normal_weight + 2.0 * tilt_variance);
  }
  if (inputs->radius_sigma == 0.0) inputs->radius_sigma = noise.radius;
  if (inputs->length_sigma == 0.0) inputs->length_sigma = noise.length;
}

std::vector<Perturbation> Perturbations(const std::vector<MovedInput>& inputs,
                                        const NoiseModel& noise, const Camera& camera) {
  std::vector<Perturbation> all;
  std::set<int> contrasts;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    for (Eigen::Index k = 0; k < inputs[i].columns.cols(); ++k) {
      const Eigen::VectorXd column = inputs[i].columns.col(k);
      if (column.isZero(0.0)) continue;
      all.push_back([i, column](double part, const std::vector<MovedInput>& moved) {
        Eigen::Map<Eigen::VectorXd>(moved[i].value, column.size()) += part * column;
      });
    }
    if (inputs[i].kind != InputKind::kConic) continue;
    contrasts.insert(inputs[i].contrast);
    const double shape = noise.circle_shape * inputs[i].irregularity;
    for (const bool along_axes : {true, false}) {
      if (shape == 0.0) continue;
      all.push_back([=](double part, const std::vector<MovedInput>& moved) {
        Eigen::Map<Vector6d> conic(moved[i].value);
        conic = ConicToVector(OvalEllipse(VectorToConic(conic), along_axes, part * shape));
      });
    }
  }
  AddCameraErrors(noise.SigmaOf(camera), camera, &all);
  const double offset = noise.contour_offset_px / std::sqrt(camera.fx * camera.fy);
  for (const int contrast : contrasts) {
    if (offset == 0.0) continue;
    all.push_back([=](double part, const std::vector<MovedInput>& moved) {
      for (const MovedInput& input : moved) {
        if (input.kind != InputKind::kConic || input.contrast != contrast) continue;
        Eigen::Map<Vector6d> conic(input.value);
        conic = ConicToVector(GrownEllipse(VectorToConic(conic), part * offset));
      }
    });
  }
  return all;
}

PoseHypothesis WithoutUncertainty(const Candidate& candidate, bool metric, bool spin_is_free) {
  PoseHypothesis h;
  h.cam_from_world = candidate.pose;
  h.metric = metric;
  if (!spin_is_free) return h;
  std::array<double, 6> spin{};
  Eigen::Map<Vector6d>(spin.data()).head<3>() = candidate.pose.rotation.col(2);
  h.free_directions.push_back(spin);
  return h;
}

std::vector<PoseHypothesis> WithUncertainty(const std::vector<Candidate>& candidates,
                                            const PerturbedCandidates& perturbed,
                                            std::size_t num_errors, bool metric,
                                            bool spin_is_free) {
  const std::vector<Eigen::MatrixXd> sensitivities =
      Sensitivities(candidates, perturbed, num_errors);
  std::vector<PoseHypothesis> hypotheses;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    hypotheses.push_back(WithoutUncertainty(candidates[i], metric, spin_is_free));
    FillUncertainty(sensitivities[i], candidates[i], &hypotheses.back());
  }
  return hypotheses;
}

}  // namespace circline
