// A closed form that circline does not have: a circle and one pencil of parallel lines of its
// plane. Of the circle's two poses (proposition 3) the one whose plane holds the pencil's
// direction.
#ifndef CIRCLE_PENCIL_H_
#define CIRCLE_PENCIL_H_

#include <string>

#include "circline/estimators/closed_form_solvers.h"
#include "circline/estimators/solver_registry.h"

class CirclePencilSolver : public circline::Solver {
 public:
  explicit CirclePencilSolver(const circline::ClosedFormOptions& options) : options_(options) {}

  const std::string& name() const override { return name_; }
  circline::SolverStage stage() const override { return circline::SolverStage::kClosedForm; }
  std::string needs() const override { return "a circle and a pencil of its plane"; }
  circline::Observations Evidence(const circline::Observations& observations) const override;
  circline::PoseEstimate Solve(const circline::Observations& observations) const override;

 private:
  std::string name_ = "circle_pencil";
  circline::ClosedFormOptions options_;
};

void AddCirclePencilSolver(const circline::ClosedFormOptions& options,
                           circline::SolverRegistry* registry);

#endif  // CIRCLE_PENCIL_H_
