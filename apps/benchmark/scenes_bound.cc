#include "apps/benchmark/scenes_bound.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <map>

namespace circline::apps {
namespace {

// Where each unknown stands among the columns of the Jacobian; -1: it is known.
class Layout {
 public:
  Layout(const World& world, const BoundRequest& request) {
    rotation = Reserve(world.RotationIsFree() ? 2 : 3);
    if (request.log_focal_sigma > 0.0) focal = Reserve(1);
    int shared_radius = -1;
    std::map<int, int> rings;
    for (std::size_t i = 0; i < world.circles.size(); ++i) {
      const WorldCircle& circle = world.circles[i];
      const bool used = request.circles.empty() || request.circles[i] != 0;
      center.push_back(-1);
      radius.push_back(-1);
      if (!used) continue;
      const auto ring = rings.find(circle.ring);
      center.back() = circle.ring >= 0 && ring != rings.end() ? ring->second : Reserve(2);
      rings[circle.ring] = center.back();
      if (circle.stated_radius > 0.0) {
        if (distance < 0) distance = Reserve(1);
      } else if (world.equal_radii) {
        if (shared_radius < 0) shared_radius = Reserve(1);
        radius.back() = shared_radius;
      } else {
        radius.back() = Reserve(1);
      }
    }
    const bool has_role = HasRole(world.pencils);
    for (std::size_t i = 0; i < world.pencils.size(); ++i) {
      // Where no pencil has a role the first is the X axis.
      const bool free = world.pencils[i].direction == PencilDirection::kFree;
      angle.push_back(free && (has_role || i > 0) ? Reserve(1) : -1);
      offset.push_back(Reserve(static_cast<int>(world.pencils[i].lines.size())));
    }
  }

  int Reserve(int count) {
    size += count;
    return size - count;
  }

  int size = 0;
  int rotation = -1, focal = -1, distance = -1;
  std::vector<int> center, radius, angle, offset;
};

class Information {
 public:
  Information(const World& world, const Layout& layout)
      : world_(world), layout_(layout), matrix_(Eigen::MatrixXd::Zero(layout.size, layout.size)) {
    const Eigen::Matrix3d& R = world.pose.rotation;
    // The components of delta that are unknown: across the normal first.
    basis_ << R.col(0), R.col(1), R.col(2);
  }

  void AddCircles() {
    std::vector<Sample> samples;
    for (std::size_t i = 0; i < world_.circles.size(); ++i) {
      if (layout_.center[i] < 0) continue;
      const WorldCircle& circle = world_.circles[i];
      SampleCircle(world_, circle, &samples);
      for (const Sample& sample : samples) {
        Eigen::VectorXd g = PoseGradient(sample);
        const Eigen::RowVector3d by_world = sample.by_point * world_.pose.rotation;
        const Eigen::Vector2d arm = sample.on_plane - circle.center;
        g.segment<2>(layout_.center[i]) += by_world.head<2>().transpose();
        if (layout_.radius[i] >= 0) g[layout_.radius[i]] += by_world.head<2>() * arm.normalized();
        matrix_ += g * g.transpose();
      }
      if (circle.has_center) AddCenter(circle, layout_.center[i]);
    }
  }

  void AddPencils() {
    std::vector<Sample> samples;
    for (std::size_t i = 0; i < layout_.offset.size(); ++i) {
      const WorldPencil& pencil = world_.pencils[i];
      const Eigen::Vector2d along = Along(pencil.angle), across = Across(pencil.angle);
      for (std::size_t k = 0; k < pencil.lines.size(); ++k) {
        const int offset = layout_.offset[i] + static_cast<int>(k);
        if (pencil.lines[k].turn != 0.0) {
          matrix_(offset, offset) = 1.0;  // Tells nothing; any value will do.
          continue;
        }
        SampleLine(world_, pencil, pencil.lines[k], &samples);
        for (const Sample& sample : samples) {
          Eigen::VectorXd g = PoseGradient(sample);
          const Eigen::RowVector3d by_world = sample.by_point * world_.pose.rotation;
          g[offset] += by_world.head<2>() * across;
          if (layout_.angle[i] >= 0) {
            g[layout_.angle[i]] += along.dot(sample.on_plane) * (by_world.head<2>() * across)[0];
          }
          matrix_ += g * g.transpose();
        }
      }
    }
  }

  Eigen::MatrixXd& matrix() { return matrix_; }
  const Eigen::Matrix3d& basis() const { return basis_; }

 private:
  void AddCenter(const WorldCircle& circle, int center) {
    std::array<Sample, 2> samples;
    SampleCenter(world_, circle, &samples);
    for (const Sample& sample : samples) {
      Eigen::VectorXd g = PoseGradient(sample);
      g.segment<2>(center) += (sample.by_point * world_.pose.rotation).head<2>().transpose();
      matrix_ += g * g.transpose();
    }
  }

  // R = exp([delta]x) R turns the plane about its origin.
  Eigen::VectorXd PoseGradient(const Sample& sample) const {
    Eigen::VectorXd g = Eigen::VectorXd::Zero(layout_.size);
    const Eigen::Vector3d arm = sample.point - world_.pose.translation;
    const Eigen::RowVector3d by_delta = -sample.by_point * CrossMatrix(arm) * basis_;
    g[layout_.rotation] = by_delta[0];
    g[layout_.rotation + 1] = by_delta[1];
    if (!layout_.offset.empty()) g[layout_.rotation + 2] = by_delta[2];
    if (layout_.distance >= 0) g[layout_.distance] = sample.by_point * world_.pose.translation;
    if (layout_.focal >= 0) {
      const Eigen::Vector2d arm_px =
          sample.pixel - Eigen::Vector2d(world_.camera.cx, world_.camera.cy);
      g[layout_.focal] = sample.normal.dot(arm_px);
    }
    return g;
  }

  const World& world_;
  const Layout& layout_;
  Eigen::Matrix3d basis_;
  Eigen::MatrixXd matrix_;
};

// False where some combination of the unknowns is not determined.
bool Invert(const Eigen::MatrixXd& information, Eigen::MatrixXd* covariance) {
  constexpr double kSingular = 1e-13;
  const Eigen::VectorXd diagonal = information.diagonal();
  if (!(diagonal.minCoeff() > 0.0)) return false;
  const Eigen::VectorXd scale = diagonal.cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
  if (!(eigen.eigenvalues()[0] > kSingular)) return false;
  const Eigen::MatrixXd inverse = eigen.eigenvectors() *
                                  eigen.eigenvalues().cwiseInverse().asDiagonal() *
                                  eigen.eigenvectors().transpose();
  *covariance = scale.asDiagonal() * inverse * scale.asDiagonal();
  return true;
}

}  // namespace

Bound ComputeBound(const World& world, const BoundRequest& request) {
  const Layout layout(world, request);
  Information information(world, layout);
  information.AddCircles();
  information.AddPencils();
  information.matrix() /= request.noise_px * request.noise_px;
  if (layout.focal >= 0) {
    information.matrix()(layout.focal, layout.focal) +=
        1.0 / (request.log_focal_sigma * request.log_focal_sigma);
  }

  Bound bound;
  bound.rotation_is_free = layout.offset.empty();
  Eigen::MatrixXd covariance;
  bound.finite = Invert(information.matrix(), &covariance);
  if (!bound.finite) return bound;
  const int unknown = bound.rotation_is_free ? 2 : 3;
  const Eigen::MatrixXd basis = information.basis().leftCols(unknown);
  bound.covariance = basis * covariance.topLeftCorner(unknown, unknown) * basis.transpose();
  bound.rotation_rad = std::sqrt(bound.covariance.trace());
  const auto deviation = [&](int at) { return at < 0 ? 0.0 : std::sqrt(covariance(at, at)); };
  bound.log_focal = deviation(layout.focal);
  bound.log_distance = deviation(layout.distance);
  return bound;
}

}  // namespace circline::apps
