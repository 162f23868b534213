#include "circline/estimators/solver_registry.h"

#include <utility>

namespace circline {

const char* SolverStageName(SolverStage stage) {
  return stage == SolverStage::kClosedForm ? "closed_form" : "refined";
}

void SolverRegistry::Add(std::shared_ptr<const Solver> solver) {
  for (std::shared_ptr<const Solver>& existing : solvers_) {
    if (existing->name() == solver->name() && existing->stage() == solver->stage()) {
      existing = std::move(solver);
      return;
    }
  }
  solvers_.push_back(std::move(solver));
}

const Solver* SolverRegistry::Find(const std::string& name, SolverStage stage) const {
  for (const std::shared_ptr<const Solver>& solver : solvers_) {
    if (solver->name() == name && solver->stage() == stage) return solver.get();
  }
  return nullptr;
}

}  // namespace circline
