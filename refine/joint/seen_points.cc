#include "circline/refine/joint/seen_points.h"

#include <ceres/cost_function.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "circline/refine/block_chain.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using CameraJacobian = Eigen::Matrix<double, 3, 4>;  // By the shifts that are not of the lens.

// A camera as its shifts have it, without its lens.
class Pinhole {
 public:
  Pinhole(const Camera& camera, const double* shifts)
      : camera_(camera),
        shifts_(shifts),
        shrink_(std::exp(-shifts[0]), std::exp(-shifts[0] - shifts[1])),
        focal_(camera.fx, camera.fy) {}

  Vector2d Image(const Vector3d& point) const {
    return (point.head<2>() / point.z()).cwiseQuotient(shrink_) +
           Vector2d(shifts_[2], shifts_[3]).cwiseQuotient(focal_);
  }
  Vector3d Ray(const double* image) const {
    return ShiftedPoint(camera_, shifts_, Vector2d(image[0], image[1]));
  }
  Eigen::Matrix<double, 3, 2> RayByImage() const {
    Eigen::Matrix<double, 3, 2> J = Eigen::Matrix<double, 3, 2>::Zero();
    J.topRows<2>() = shrink_.asDiagonal();
    return J;
  }
  CameraJacobian RayByCamera(const Vector3d& ray) const {
    CameraJacobian J = CameraJacobian::Zero();
    J.block<2, 1>(0, 0) = -ray.head<2>();
    J(1, 1) = -ray.y();
    J.block<2, 2>(0, 2) = -shrink_.cwiseQuotient(focal_).asDiagonal().toDenseMatrix();
    return J;
  }

 private:
  const Camera& camera_;
  const double* shifts_;
  Vector2d shrink_, focal_;
};

// A translation of this image and length.
struct SeenOrigin {
  Vector3d t;
  Matrix3d by_seen;  // Image and length.
  CameraJacobian by_camera;

  SeenOrigin(const Pinhole& pinhole, const double* seen) {
    const Vector3d ray = pinhole.Ray(seen);
    const double norm = ray.norm();
    const Vector3d unit = ray / norm;
    const Matrix3d by_ray = seen[2] / norm * (Matrix3d::Identity() - unit * unit.transpose());
    t = seen[2] * unit;
    by_seen << by_ray * pinhole.RayByImage(), unit;
    by_camera = by_ray * pinhole.RayByCamera(ray);
  }
};

// A point of the plane Z = 0 with this image. Where its ray r meets the plane, of normal n,
// d r = R c + t, so that n . (d r) = n . t and
//   dc = R^T (I - r n^T / (n . r)) (d dr - dt), and what a turn does, w = (c, 0) its arm.
struct SeenCenter {
  double depth;
  Vector2d center;
  Eigen::Matrix<double, 2, 3> by_turn, by_translation;
  Eigen::Matrix2d by_image;
  Eigen::Matrix<double, 2, 4> by_camera;

  SeenCenter(const Pinhole& pinhole, const Matrix3d& R, const Vector3d& t, const double* image) {
    const Vector3d ray = pinhole.Ray(image), n = R.col(2);
    const double slope = n.dot(ray);
    depth = n.dot(t) / slope;
    const Vector3d w = R.transpose() * (depth * ray - t), along = R.transpose() * ray / slope;
    center = w.head<2>();
    by_turn = (CrossMatrix(w) - along * Vector3d::UnitZ().cross(w).transpose()).topRows<2>();
    by_translation = -(R.transpose() - along * n.transpose()).topRows<2>();
    const Eigen::Matrix<double, 2, 3> by_ray = -depth * by_translation;
    by_image = by_ray * pinhole.RayByImage();
    by_camera = by_ray * pinhole.RayByCamera(ray);
  }
};

// A cost function of rotation, translation, perhaps centre and others, perhaps camera, as one of
// what is seen of them. Its camera is the last block.
class SeenCost : public ceres::CostFunction {
 public:
  SeenCost(const ceres::CostFunction& cost, bool has_camera, bool origin_is_seen,
           bool center_is_seen, const Camera& camera)
      : cost_(cost),
        origin_is_seen_(origin_is_seen),
        center_is_seen_(center_is_seen),
        has_camera_(has_camera),
        camera_(camera) {
    *mutable_parameter_block_sizes() = cost.parameter_block_sizes();
    if (!has_camera) mutable_parameter_block_sizes()->push_back(kCameraSize);
    set_num_residuals(cost.num_residuals());
  }

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    const std::size_t num_blocks = parameter_block_sizes().size(), last = num_blocks - 1;
    const Pinhole pinhole(camera_, parameters[last]);
    std::array<const double*, kMostBlocks + 1> places;
    std::copy_n(parameters, num_blocks, places.begin());
    std::optional<SeenOrigin> origin;
    if (origin_is_seen_) places[1] = origin.emplace(pinhole, parameters[1]).t.data();
    std::optional<SeenCenter> center;
    if (center_is_seen_) {
      center.emplace(pinhole, RotationFromBlock(parameters[0]), Vector3d(places[1]), parameters[2]);
      if (!(center->depth > 0.0) || !center->center.allFinite()) return false;
      places[2] = center->center.data();
    }
    if (!cost_.Evaluate(places.data(), residuals, jacobians)) return false;
    if (jacobians == nullptr) return true;
    if (!has_camera_ && jacobians[last] != nullptr)
      std::fill_n(jacobians[last], num_residuals() * kCameraSize, 0.0);
    if (center) {
      const Jacobian<2> by_center = Block<2>(jacobians[2]);
      Add(by_center * (center->by_turn * DeltaFromQuaternion(parameters[0])), jacobians[0], 4);
      Add(by_center * center->by_translation, jacobians[1], 3);
      Add(by_center * center->by_camera, jacobians[last], kCameraSize);
      Block<2>(jacobians[2]) = by_center * center->by_image;
    }
    if (origin) {
      const Jacobian<3> by_translation = Block<3>(jacobians[1]);
      Add(by_translation * origin->by_camera, jacobians[last], kCameraSize);
      Block<3>(jacobians[1]) = by_translation * origin->by_seen;
    }
    return true;
  }

 private:
  template <int columns>
  using Jacobian =
      Eigen::Matrix<double, Eigen::Dynamic, columns, Eigen::RowMajor, CurveModel::kMaxSize + 6>;

  template <int columns>
  Eigen::Map<Jacobian<columns>> Block(double* jacobian) const {
    return {jacobian, num_residuals(), columns};
  }
  // To the first columns of a block of this size.
  template <typename Derived>
  void Add(const Eigen::MatrixBase<Derived>& J, double* jacobian, int size) const {
    if (jacobian == nullptr) return;
    Eigen::Map<RowMajor>(jacobian, num_residuals(), size).leftCols(J.cols()) += J;
  }

  const ceres::CostFunction& cost_;
  bool origin_is_seen_, center_is_seen_, has_camera_;
  const Camera& camera_;
};

Pinhole PinholeAt(const JointProblem& problem, const State& state) {
  return {problem.observations().camera, problem.At(JointProblem::kCamera, state)};
}

}  // namespace

SeenPoints::SeenPoints(const JointProblem& problem, State* state)
    : problem_(problem), state_(state) {
  const Pinhole pinhole = PinholeAt(problem, *state);
  const CameraPose pose = problem.PoseAt(*state);
  for (const JointProblem::CircleBlocks& c : problem.circles()) {
    if (problem.block(c.center).is_constant || !state->Has(c.feature) ||
        std::count(centers_.begin(), centers_.end(), c.center) > 0)
      continue;
    double* center = problem.At(c.center, state);
    const Vector3d point = pose.rotation * Vector3d(center[0], center[1], 0.0) + pose.translation;
    if (!(point.z() > 0.0)) continue;
    centers_.push_back(c.center);
    const Vector2d image = pinhole.Image(point);
    std::copy_n(image.data(), 2, center);
  }
  // Not where its direction is a convention.
  const Block& translation = problem.block(JointProblem::kTranslation);
  origin_is_seen_ = translation.tangent_size() >= 2 && pose.translation.z() > 0.0;
  if (!origin_is_seen_) return;
  if (translation.tangent_size() == 2)
    of_given_length_ = std::make_unique<ceres::SubsetManifold>(3, std::vector<int>{2});
  Eigen::Map<Vector3d> seen(problem.At(JointProblem::kTranslation, state));
  seen << pinhole.Image(pose.translation), pose.translation.norm();
}

int SeenPoints::Fill(ceres::Problem* problem) {
  std::vector<const Term*> terms = problem_.ActiveTerms(*state_);
  seen_.reserve(terms.size());
  for (const Term*& term : terms) {
    const std::vector<int>& blocks = term->blocks;
    const bool has_origin =
        origin_is_seen_ && blocks.size() > 1 && blocks[1] == JointProblem::kTranslation;
    const bool has_center =
        blocks.size() > 2 && std::count(centers_.begin(), centers_.end(), blocks[2]) > 0;
    if (!has_origin && !has_center) continue;
    const bool has_camera = blocks.back() == JointProblem::kCamera;
    Term& seen = seen_.emplace_back();
    seen.cost = std::make_unique<SeenCost>(*term->cost, has_camera, has_origin, has_center,
                                           problem_.observations().camera);
    seen.blocks = blocks;
    if (!has_camera) seen.blocks.push_back(JointProblem::kCamera);
    term = &seen;
  }
  const int unknowns = problem_.Fill(terms, state_->x.data(), problem);
  double* t = problem_.At(JointProblem::kTranslation, state_);
  if (origin_is_seen_ && problem->HasParameterBlock(t))
    problem->SetManifold(t, of_given_length_.get());
  return unknowns;
}

SeenPoints::~SeenPoints() {
  const Pinhole pinhole = PinholeAt(problem_, *state_);
  if (origin_is_seen_) {
    double* seen = problem_.At(JointProblem::kTranslation, state_);
    const Vector3d t = SeenOrigin(pinhole, seen).t;
    std::copy_n(t.data(), 3, seen);
  }
  const CameraPose pose = problem_.PoseAt(*state_);
  for (const int block : centers_) {
    double* seen = problem_.At(block, state_);
    const Vector2d center = SeenCenter(pinhole, pose.rotation, pose.translation, seen).center;
    std::copy_n(center.data(), 2, seen);
  }
}

}  // namespace circline
