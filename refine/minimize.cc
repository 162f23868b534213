#include "circline/refine/minimize.h"

#include <ceres/tiny_solver.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "circline/estimators/pose.h"

namespace circline {
namespace {

// The problem in the form that ceres::TinySolver wants: as many residuals as shared unknowns, and
// one more that makes up the cost. Its unknowns are w in rotation = base exp([w]x), w without the
// spin where nothing fixes that, then the other shared ones.
class SolverFunction {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = Eigen::Dynamic };

  SolverFunction(const JointEvidence& e, double stretch, JointState* state)
      : e_(e),
        columns_(e),
        weighing_{stretch, false},
        rotation_unknowns_(e.x_is_fixed ? 3 : 2),
        base_(state->rotation),
        state_(*state),
        trial_(Start()) {}

  int NumParameters() const { return columns_.size - 3 + rotation_unknowns_; }
  int NumResiduals() const { return NumParameters() + 1; }

  Eigen::VectorXd Start() const {
    Eigen::VectorXd x = Eigen::VectorXd::Zero(NumParameters());
    VisitShared([&](int column, double* value) { x[column] = *value; });
    return x;
  }

  // Without Jacobian: a trial. With: at the place of the last trial, or the start.
  bool operator()(const double* x, double* residuals, double* jacobian) const {
    const int n = NumParameters();
    Eigen::Map<Eigen::VectorXd> f(residuals, n + 1);
    const Eigen::Map<const Eigen::VectorXd> place(x, n);
    if (jacobian == nullptr) {
      MoveTo(place);
      f.setZero();
      f[n] = std::sqrt(2.0 * JointCost(e_, state_, weighing_));
      return true;
    }
    linearized_at_ = place;
    accepted_ = state_;
    own_damping_ = 1.0;
    if (!Linearize(e_, state_, columns_, weighing_, &model_)) {
      failed_ = true;
      f.setConstant(std::numeric_limits<double>::quiet_NaN());
      return false;
    }
    Factor(f, Eigen::Map<Eigen::MatrixXd>(jacobian, n + 1, n));
    return true;
  }

  // Leaves the state where the solver ended. False if it could not be linearised on the way.
  bool Finish(const Eigen::VectorXd& x) const {
    if (x != trial_) state_ = accepted_;
    return !failed_;
  }

 private:
  template <typename Visit>
  void VisitShared(const Visit& visit) const {
    for (std::size_t i = 1; i < e_.parameters.size(); ++i) {
      if (columns_.offsets[i] < 0) continue;
      const int column = columns_.offsets[i] - 3 + rotation_unknowns_;
      for (int k = 0; k < e_.parameters[i].size; ++k)
        visit(column + k, &state_.values[i][static_cast<std::size_t>(k)]);
    }
  }

  Eigen::Vector3d RotationPart(const Eigen::VectorXd& x) const {
    Eigen::Vector3d w = Eigen::Vector3d::Zero();
    w.head(rotation_unknowns_) = x.head(rotation_unknowns_);
    return w;
  }

  void MoveTo(const Eigen::VectorXd& x) const {
    trial_ = x;
    state_.rotation = base_ * ExpRotation(RotationPart(x));
    VisitShared([&](int column, double* value) { *value = x[column]; });
    Eigen::VectorXd change(columns_.size);
    change.head<3>() = LogRotation(accepted_.rotation.transpose() * state_.rotation);
    change.tail(columns_.size - 3) =
        (x - linearized_at_).tail(NumParameters() - rotation_unknowns_);
    for (const OwnUnknowns& own : model_.eliminated) {
      for (std::size_t a = 0; a < static_cast<std::size_t>(own.size); ++a) {
        double step = own_damping_ * own.step[a];
        for (std::size_t b = 0; b < static_cast<std::size_t>(own.shared_size); ++b) {
          step -= own.gain(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) *
                  change[own.shared_column[b]];
        }
        const auto block = static_cast<std::size_t>(own.own_block[a]);
        const auto index = static_cast<std::size_t>(own.own_index[a]);
        state_.values[block][index] = accepted_.values[block][index] + step;
      }
    }
    own_damping_ *= 0.5;  // Should this trial be refused, the next goes a shorter way.
  }

  // J with J^T J = the model's Hessian, and f with J^T f = its gradient, |f|^2 = 2 cost.
  void Factor(Eigen::Map<Eigen::VectorXd> f, Eigen::Map<Eigen::MatrixXd> J) const {
    const int n = NumParameters(), others = columns_.size - 3;
    Eigen::MatrixXd by_x = Eigen::MatrixXd::Zero(columns_.size, n);
    by_x.topLeftCorner(3, rotation_unknowns_) =
        RightJacobian(RotationPart(linearized_at_)).leftCols(rotation_unknowns_);
    by_x.bottomRightCorner(others, others).setIdentity();
    const Eigen::LDLT<Eigen::MatrixXd> ldlt(by_x.transpose() * model_.hessian * by_x);
    Eigen::VectorXd g = ldlt.transpositionsP() * (by_x.transpose() * model_.gradient);
    ldlt.matrixL().solveInPlace(g);
    Eigen::MatrixXd P = Eigen::MatrixXd::Identity(n, n);
    P = ldlt.transpositionsP() * P;
    J.topRows(n).noalias() = ldlt.matrixU() * P;
    const double largest = ldlt.vectorD().cwiseAbs().maxCoeff();
    for (int i = 0; i < n; ++i) {
      constexpr double kRounding = 1e-15;
      const double d = ldlt.vectorD()[i];
      const double root = d > kRounding * largest ? std::sqrt(d) : 0.0;
      J.row(i) *= root;
      f[i] = root > 0.0 ? g[i] / root : 0.0;
    }
    // Losses that bend back may promise more than there is: then the model is too flat.
    const double promised = f.head(n).squaredNorm(), twice_cost = 2.0 * model_.cost;
    if (promised > twice_cost && promised > 0.0) {
      const double steepen = std::sqrt(promised / twice_cost);
      J.topRows(n) *= steepen;
      f.head(n) /= steepen;
    }
    J.row(n).setZero();
    f[n] = std::sqrt(std::max(0.0, twice_cost - f.head(n).squaredNorm()));
  }

  // exp([w + dw]x) = exp([w]x) exp([J dw]x) to first order.
  static Eigen::Matrix3d RightJacobian(const Eigen::Vector3d& w) {
    const double s = w.squaredNorm(), angle = std::sqrt(s);
    const Eigen::Matrix3d W = CrossMatrix(w);
    const double b = angle < 1e-4 ? 0.5 - s / 24.0 : (1.0 - std::cos(angle)) / s;
    const double c = angle < 1e-4 ? 1.0 / 6.0 - s / 120.0 : (angle - std::sin(angle)) / (s * angle);
    return Eigen::Matrix3d::Identity() - b * W + c * W * W;
  }

  const JointEvidence& e_;
  SharedColumns columns_;
  SetWeighing weighing_;
  int rotation_unknowns_;
  Eigen::Matrix3d base_;
  // The solver takes its function as const; what it remembers between calls is not.
  JointState& state_;
  mutable JointState accepted_;
  mutable ReducedModel model_;
  mutable Eigen::VectorXd linearized_at_, trial_;
  mutable double own_damping_ = 1.0;
  mutable bool failed_ = false;
};

}  // namespace

Status Minimize(const JointEvidence& e, double stretch, int max_iterations, double tolerance,
                JointState* state) {
  const SolverFunction function(e, stretch, state);
  ceres::TinySolver<SolverFunction> solver;
  solver.options.max_num_iterations = max_iterations + 1;  // It counts the start as one.
  solver.options.function_tolerance = 2.0 * tolerance;     // It compares twice the cost.
  solver.options.gradient_tolerance = 0.0;
  solver.options.parameter_tolerance = 1e-14;
  solver.options.cost_threshold = 0.0;
  Eigen::VectorXd x = function.Start();
  solver.Solve(function, &x);
  if (!function.Finish(x)) return Status::Failed("the evidence cannot be evaluated at the seed");
  const Eigen::Quaterniond q(state->rotation);  // Rounding of many products, off.
  state->rotation = q.normalized().toRotationMatrix();
  return Status::Ok();
}

}  // namespace circline
