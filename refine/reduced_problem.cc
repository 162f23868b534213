#include "circline/refine/reduced_problem.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "circline/estimators/pose.h"

namespace circline {
namespace {

// The unknowns behind a model's local variables: block and position in it; -1 where a variable is
// none.
struct LocalVariables {
  int size = 0;
  std::array<int, 6> block{}, index{};

  void Add(int of_block, int count) {
    for (int k = 0; k < count; ++k, ++size) {
      block[static_cast<std::size_t>(size)] = of_block;
      index[static_cast<std::size_t>(size)] = k;
    }
  }
};

LocalVariables VariablesOf(const CircleTerm& t) {
  LocalVariables v;
  v.Add(0, 3);
  v.Add(t.center, t.radius < 0 ? 3 : 2);
  if (t.radius >= 0) v.Add(t.radius, 1);
  return v;
}

LocalVariables VariablesOf(const LineTerm& t) {
  LocalVariables v;
  v.Add(0, 3);
  if (t.shared >= 0) v.Add(t.shared, t.kind == LineKind::kInPlane ? 1 : 2);
  if (t.angle >= 0) v.Add(t.angle, 1);
  return v;
}

LocalVariables VariablesOf(const PointTerm& t) {
  LocalVariables v;
  v.Add(0, 3);
  v.Add(t.point, 2);
  return v;
}

LocalVariables VariablesOf(const AngleTerm& t) {
  LocalVariables v;
  v.Add(t.theta[0], 1);
  v.Add(t.theta[1], 1);
  return v;
}

LocalVariables VariablesOf(const LengthTerm& t, int scale) {
  LocalVariables v;
  v.Add(t.a, 2);
  v.Add(t.b, 2);
  v.Add(scale, 1);
  return v;
}

double Evaluate(const JointEvidence& e, const CircleTerm& t, const JointState& state,
                const SetWeighing& weighing, QuadraticModel* model) {
  const double* c = state.At(t.center);
  const double radius = t.radius < 0 ? c[2] : t.factor * state.At(t.radius)[0];
  const double cost = EvaluateCircle(e.sets[static_cast<std::size_t>(t.set)], weighing,
                                     state.rotation, state.facing, c[0], c[1], radius, model);
  if (model != nullptr && t.radius >= 0 && t.factor != 1.0) {
    model->gradient[5] *= t.factor;
    model->hessian.row(5) *= t.factor;
    model->hessian.col(5) *= t.factor;
  }
  return cost;
}

double Evaluate(const JointEvidence& e, const LineTerm& t, const JointState& state,
                const SetWeighing& weighing, QuadraticModel* model) {
  Eigen::Matrix3d dm;
  const Eigen::Vector3d m = LineNormal(t, state, &dm);
  return EvaluateLine(e.sets[static_cast<std::size_t>(t.set)], weighing, state.rotation, m, dm,
                      model);
}

double Evaluate(const PointTerm& t, const JointState& state, const SetWeighing& weighing,
                QuadraticModel* model) {
  const double* xy = state.At(t.point);
  return EvaluatePoint(t.measured, weighing, state.rotation, state.facing, xy[0], xy[1], model);
}

double Evaluate(const AngleTerm& t, const JointState& state, QuadraticModel* model) {
  double theta[2];
  for (int i = 0; i < 2; ++i) theta[i] = t.theta[i] >= 0 ? state.At(t.theta[i])[0] : t.fixed[i];
  return EvaluateAngle(t.value, t.sigma, theta, model);
}

double Evaluate(const LengthTerm& t, int scale, const JointState& state, QuadraticModel* model) {
  return EvaluateLength(t.length, state.At(t.a), state.At(t.b), state.At(scale)[0], model);
}

// Adds one term's model to the whole, its own unknowns eliminated.
class Assembler {
 public:
  Assembler(const JointEvidence& e, const SharedColumns& columns, bool must_be_known,
            ReducedModel* out)
      : e_(e), columns_(columns), must_be_known_(must_be_known), out_(*out) {}

  // False where a cost is not finite or (if it must be) an own unknown is not known. `log_det`
  // receives that of the own unknowns' information.
  bool Add(const LocalVariables& variables, QuadraticModel* model, double* log_det) {
    if (!std::isfinite(model->cost)) return false;
    out_.cost += model->cost;
    OwnUnknowns own;
    for (int k = 0; k < variables.size; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const int block = variables.block[i];
      if (block < 0) continue;
      const auto local = static_cast<std::uint8_t>(k);
      if (e_.parameters[static_cast<std::size_t>(block)].is_private) {
        const auto n = static_cast<std::size_t>(own.size++);
        own.own[n] = local;
        own.own_block[n] = block;
        own.own_index[n] = variables.index[i];
      } else {
        const auto n = static_cast<std::size_t>(own.shared_size++);
        own.shared[n] = local;
        own.shared_column[n] =
            columns_.offsets[static_cast<std::size_t>(block)] + variables.index[i];
      }
    }
    if (own.size > 0 && !Eliminate(&own, model, log_det)) return false;
    for (std::size_t a = 0; a < static_cast<std::size_t>(own.shared_size); ++a) {
      out_.gradient[own.shared_column[a]] += model->gradient[own.shared[a]];
      for (std::size_t b = 0; b < static_cast<std::size_t>(own.shared_size); ++b) {
        out_.hessian(own.shared_column[a], own.shared_column[b]) +=
            model->hessian(own.shared[a], own.shared[b]);
      }
    }
    return true;
  }

 private:
  // Schur's complement, in place, of the own unknowns; where nothing is known of them (all points
  // far out under a redescending loss) they stay where they are.
  bool Eliminate(OwnUnknowns* own, QuadraticModel* model, double* log_det) {
    bool known = false;
    if (own->size == 1) known = EliminateSome<1>(own, model, log_det);
    if (own->size == 2) known = EliminateSome<2>(own, model, log_det);
    if (own->size == 3) known = EliminateSome<3>(own, model, log_det);
    if (!known) return !must_be_known_;
    out_.eliminated.push_back(*own);
    return true;
  }

  template <int kOwn>
  bool EliminateSome(OwnUnknowns* own, QuadraticModel* model, double* log_det) {
    const int s = own->shared_size;
    Eigen::Matrix<double, kOwn, kOwn> H;
    // Cross terms of the own unknowns, then their gradient.
    Eigen::Matrix<double, kOwn, 7> C = Eigen::Matrix<double, kOwn, 7>::Zero();
    for (int a = 0; a < kOwn; ++a) {
      const int ia = own->own[static_cast<std::size_t>(a)];
      for (int b = 0; b < kOwn; ++b)
        H(a, b) = model->hessian(ia, own->own[static_cast<std::size_t>(b)]);
      for (int b = 0; b < s; ++b)
        C(a, b) = model->hessian(ia, own->shared[static_cast<std::size_t>(b)]);
      C(a, s) = model->gradient[ia];
    }
    const Eigen::LLT<Eigen::Matrix<double, kOwn, kOwn>> factor(H);
    if (factor.info() != Eigen::Success) return false;
    const Eigen::Matrix<double, kOwn, 7> solution = factor.solve(C);
    if (!solution.allFinite()) return false;
    for (int a = 0; a < s; ++a) {
      const int ia = own->shared[static_cast<std::size_t>(a)];
      for (int b = 0; b < s; ++b) {
        model->hessian(ia, own->shared[static_cast<std::size_t>(b)]) -=
            C.col(a).dot(solution.col(b));
      }
      model->gradient[ia] -= C.col(a).dot(solution.col(s));
    }
    for (int a = 0; a < kOwn; ++a) {
      own->step[static_cast<std::size_t>(a)] = -solution(a, s);
      out_.own_gain += 0.5 * C(a, s) * solution(a, s);
      for (int b = 0; b < s; ++b) own->gain(a, b) = solution(a, b);
      *log_det += 2.0 * std::log(factor.matrixLLT()(a, a));
    }
    return true;
  }

  const JointEvidence& e_;
  const SharedColumns& columns_;
  bool must_be_known_;
  ReducedModel& out_;
};

}  // namespace

SharedColumns::SharedColumns(const JointEvidence& evidence) {
  offsets.reserve(evidence.parameters.size());
  for (const ParameterInfo& parameter : evidence.parameters) {
    offsets.push_back(parameter.is_private ? -1 : size);
    if (!parameter.is_private) size += parameter.size;
  }
}

Eigen::Vector3d LineNormal(const LineTerm& term, const JointState& state, Eigen::Matrix3d* by_own) {
  Eigen::Matrix3d& dm = *by_own;
  dm.setZero();
  const double facing = state.facing;
  const auto angle = [&](double* c, double* s) {
    const double value = state.At(term.angle)[0];
    *c = std::cos(value);
    *s = std::sin(value);
  };
  double cp, sp;
  switch (term.kind) {
    case LineKind::kFixedDirection: {
      angle(&cp, &sp);
      dm.col(0) = -sp * term.a + cp * term.b;
      return cp * term.a + sp * term.b;
    }
    case LineKind::kInPlane: {
      // Basis across (cos theta, sin theta, 0): the in-plane normal and Z.
      angle(&cp, &sp);
      const double theta = state.At(term.shared)[0];
      const double c = std::cos(theta), s = std::sin(theta);
      dm.col(0) = Eigen::Vector3d(-c * cp, -s * cp, 0.0);
      dm.col(1) = Eigen::Vector3d(s * sp, -c * sp, cp);
      return {-s * cp, c * cp, sp};
    }
    case LineKind::kXAxis:
      dm.col(1) = Eigen::Vector3d(0.0, 0.0, -facing);
      return {0.0, 1.0, -facing * state.At(term.shared)[1]};
    case LineKind::kYAxis:
      dm.col(0) = Eigen::Vector3d(0.0, 0.0, -facing);
      return {1.0, 0.0, -facing * state.At(term.shared)[0]};
    case LineKind::kDiameter:
      break;
  }
  angle(&cp, &sp);
  const double x = state.At(term.shared)[0], y = state.At(term.shared)[1];
  dm.col(0) = Eigen::Vector3d(0.0, 0.0, facing * sp);
  dm.col(1) = Eigen::Vector3d(0.0, 0.0, -facing * cp);
  dm.col(2) = Eigen::Vector3d(-cp, -sp, facing * (cp * x + sp * y));
  return {-sp, cp, facing * (sp * x - cp * y)};
}

double JointCost(const JointEvidence& e, const JointState& state, const SetWeighing& weighing) {
  double cost = 0.0;
  for (std::size_t i = 0; i < e.circles.size(); ++i) {
    if (state.circle_left_out[i] == 0) cost += Evaluate(e, e.circles[i], state, weighing, nullptr);
  }
  for (std::size_t i = 0; i < e.lines.size(); ++i) {
    if (state.line_left_out[i] == 0) cost += Evaluate(e, e.lines[i], state, weighing, nullptr);
  }
  for (std::size_t i = 0; i < e.points.size(); ++i) {
    if (state.point_left_out[i] == 0) cost += Evaluate(e.points[i], state, weighing, nullptr);
  }
  for (const AngleTerm& t : e.angles) cost += Evaluate(t, state, nullptr);
  for (std::size_t i = 0; i < e.lengths.size(); ++i) {
    if (state.length_left_out[i] == 0) cost += Evaluate(e.lengths[i], e.scale, state, nullptr);
  }
  return std::isfinite(cost) ? cost : std::numeric_limits<double>::infinity();
}

bool Linearize(const JointEvidence& e, const JointState& state, const SharedColumns& columns,
               const SetWeighing& weighing, ReducedModel* out) {
  out->cost = out->own_gain = 0.0;
  out->gradient.setZero(columns.size);
  out->hessian.setZero(columns.size, columns.size);
  out->eliminated.clear();
  out->circle_log_det.assign(e.circles.size(), 0.0);
  out->line_log_det.assign(e.lines.size(), 0.0);
  Assembler assembler(e, columns, weighing.inliers_only, out);
  QuadraticModel model;
  double unused = 0.0;
  for (std::size_t i = 0; i < e.circles.size(); ++i) {
    if (state.circle_left_out[i] != 0) continue;
    Evaluate(e, e.circles[i], state, weighing, &model);
    if (!assembler.Add(VariablesOf(e.circles[i]), &model, &out->circle_log_det[i])) return false;
  }
  for (std::size_t i = 0; i < e.lines.size(); ++i) {
    if (state.line_left_out[i] != 0) continue;
    Evaluate(e, e.lines[i], state, weighing, &model);
    if (!assembler.Add(VariablesOf(e.lines[i]), &model, &out->line_log_det[i])) return false;
  }
  for (std::size_t i = 0; i < e.points.size(); ++i) {
    if (state.point_left_out[i] != 0) continue;
    if (!std::isfinite(Evaluate(e.points[i], state, weighing, &model)) ||
        !assembler.Add(VariablesOf(e.points[i]), &model, &unused))
      return false;
  }
  for (const AngleTerm& t : e.angles) {
    Evaluate(t, state, &model);
    if (!assembler.Add(VariablesOf(t), &model, &unused)) return false;
  }
  for (std::size_t i = 0; i < e.lengths.size(); ++i) {
    if (state.length_left_out[i] != 0) continue;
    const LengthTerm& t = e.lengths[i];
    if (!std::isfinite(Evaluate(t, e.scale, state, &model)) ||
        !assembler.Add(VariablesOf(t, e.scale), &model, &unused))
      return false;
  }
  return out->gradient.allFinite() && out->hessian.allFinite();
}

}  // namespace circline
