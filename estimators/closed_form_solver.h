// One closed form as a registered solver: a recipe, completed by ranking and propagated covariance.
// Internal: not installed.
#ifndef CIRCLINE_ESTIMATORS_CLOSED_FORM_SOLVER_H_
#define CIRCLINE_ESTIMATORS_CLOSED_FORM_SOLVER_H_

#include <string>
#include <utility>
#include <vector>

#include "circline/estimators/closed_form_recipes.h"
#include "circline/estimators/closed_form_solvers.h"

namespace circline {

class ClosedFormSolver : public Solver {
 public:
  ClosedFormSolver(Recipe recipe, const ClosedFormOptions& options)
      : recipe_(std::move(recipe)), options_(options) {}

  const std::string& name() const override { return recipe_.name; }
  SolverStage stage() const override { return SolverStage::kClosedForm; }
  std::string needs() const override { return recipe_.needs; }
  Observations Evidence(const Observations& observations) const override;
  PoseEstimate Solve(const Observations& observations) const override;
  PoseEstimate Seeds(const Observations& resolved) const override;

 private:
  // Fitted and with a world frame; `problems`: see FitDirect.
  Observations Resolved(const Observations& observations,
                        std::vector<std::string>* problems = nullptr) const;
  // The recipe's inputs with the errors of the noise model; that of a line against its pencil's
  // direction goes into the covariances of the evidence's lines.
  Status Gather(Observations* evidence, Inputs* inputs) const;

  Recipe recipe_;
  ClosedFormOptions options_;
};

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_CLOSED_FORM_SOLVER_H_
