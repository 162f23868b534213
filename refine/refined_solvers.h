// Refined counterparts of the closed forms, and "joint", as registered solvers.
#ifndef CIRCLINE_REFINE_REFINED_SOLVERS_H_
#define CIRCLINE_REFINE_REFINED_SOLVERS_H_

#include "circline/estimators/export.h"
#include "circline/estimators/solver_registry.h"
#include "circline/refine/estimate_pose.h"

namespace CIRCLINE_EXPORT circline {

// For every closed form that the registry has: a solver of the same name and stage kRefined, seeded
// by it and refined on its own evidence. And "joint": seeded by all of them, refined on all
// evidence.
void AddRefinedSolvers(SolverRegistry* registry, const EstimationOptions& options = {});

}  // namespace circline

#endif  // CIRCLINE_REFINE_REFINED_SOLVERS_H_
