// A closed form, called by its name, and what most of them are asked about.
#ifndef CIRCLINE_TESTS_ESTIMATORS_CLOSED_FORM_CALL_H_
#define CIRCLINE_TESTS_ESTIMATORS_CLOSED_FORM_CALL_H_

#include <gtest/gtest.h>

#include <string>

#include "circline/estimators/closed_form_solvers.h"
#include "tests/plane_scene.h"

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

inline Observations OneCircle(PlaneScene* scene, double x = 0.5, double y = 0.2) {
  Observations observations = scene->Empty();
  observations.circles = {scene->Circle("c0", x, y, 1.0)};
  return observations;
}

inline PencilObservation AlongX(PlaneScene* scene, int lines = 3, int points = 2) {
  return scene->Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX(), lines, points);
}
inline PencilObservation AlongY(PlaneScene* scene, int lines = 3, int points = 2) {
  return scene->Pencil("L2", PencilDirection::kY, Eigen::Vector3d::UnitY(), lines, points);
}

}  // namespace circline

#endif  // CIRCLINE_TESTS_ESTIMATORS_CLOSED_FORM_CALL_H_
