#include "circline/refine/refined_solvers.h"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "circline/refine/joint/readings.h"

namespace circline {
namespace {

using SharedSolver = std::shared_ptr<const Solver>;

// A closed form followed by the refinement on its own evidence.
class RefinedSolver : public Solver {
 public:
  RefinedSolver(SharedSolver closed_form, const EstimationOptions& options)
      : closed_form_(std::move(closed_form)), options_(options) {}

  const std::string& name() const override { return closed_form_->name(); }
  SolverStage stage() const override { return SolverStage::kRefined; }
  std::string needs() const override { return closed_form_->needs(); }
  Observations Evidence(const Observations& observations) const override {
    return closed_form_->Evidence(observations);
  }
  PoseEstimate Solve(const Observations& observations) const override {
    PoseEstimate estimate = closed_form_->Solve(observations);
    if (!estimate.status.ok()) return estimate;
    return RefineSeeds(name(), {closed_form_}, Evidence(observations), options_);
  }

 private:
  SharedSolver closed_form_;
  EstimationOptions options_;
};

// All closed forms as seeds, all evidence in one problem.
class JointSolver : public Solver {
 public:
  JointSolver(std::vector<SharedSolver> seeders, const EstimationOptions& options)
      : seeders_(std::move(seeders)), options_(options) {}

  const std::string& name() const override { return name_; }
  SolverStage stage() const override { return SolverStage::kRefined; }
  std::string needs() const override { return "whatever one of the other solvers needs"; }
  Observations Evidence(const Observations& observations) const override { return observations; }
  PoseEstimate Solve(const Observations& observations) const override {
    return RefineSeeds(name_, seeders_, observations, options_);
  }

 private:
  std::string name_ = "joint";
  std::vector<SharedSolver> seeders_;
  EstimationOptions options_;
};

}  // namespace

void AddRefinedSolvers(SolverRegistry* registry, const EstimationOptions& options) {
  const std::vector<SharedSolver> seeders = registry->solvers();
  for (const SharedSolver& solver : seeders) {
    if (solver->stage() == SolverStage::kClosedForm)
      registry->Add(std::make_shared<RefinedSolver>(solver, options));
  }
  registry->Add(std::make_shared<JointSolver>(seeders, options));
}

}  // namespace circline
