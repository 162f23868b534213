// A closed form, called by its name.
#ifndef CIRCLINE_TESTS_ESTIMATORS_CLOSED_FORM_CALL_H_
#define CIRCLINE_TESTS_ESTIMATORS_CLOSED_FORM_CALL_H_

#include <gtest/gtest.h>

#include <string>

#include "circline/estimators/closed_form_solvers.h"

namespace circline {

inline PoseEstimate SolveClosedForm(const std::string& name, const Observations& observations,
                                    const NoiseModel& noise = NoiseModel::Exact(),
                                    double sigma_px = 1.0) {
  SolverRegistry registry;
  ClosedFormOptions options;
  options.sigma_px = sigma_px;
  options.noise_model = noise;
  AddClosedFormSolvers(&registry, options);
  const Solver* solver = registry.Find(name, SolverStage::kClosedForm);
  EXPECT_NE(solver, nullptr) << name;
  return solver->Solve(observations);
}

}  // namespace circline

#endif  // CIRCLINE_TESTS_ESTIMATORS_CLOSED_FORM_CALL_H_
