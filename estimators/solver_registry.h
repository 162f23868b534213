// Solvers by name. A registry is a value: make one, add what you like, hand it to EstimatePose or
// to a comparison. There is no global one.
#ifndef CIRCLINE_ESTIMATORS_SOLVER_REGISTRY_H_
#define CIRCLINE_ESTIMATORS_SOLVER_REGISTRY_H_

#include <memory>
#include <string>
#include <vector>

#include "circline/estimators/export.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"

namespace CIRCLINE_EXPORT circline {

// A formula as it is, or refined on its own evidence.
enum class SolverStage { kClosedForm, kRefined };
const char* SolverStageName(SolverStage stage);  // "closed_form", "refined".

// Options are captured when a solver is made; Solve is const and may run in many threads at once.
class Solver {
 public:
  virtual ~Solver() = default;
  virtual const std::string& name() const = 0;  // "circle_center", ...
  virtual SolverStage stage() const = 0;        // Of the name there may be one of each.
  virtual std::string needs() const = 0;        // In words: "a circle and the image of its centre".
  // All hypotheses, best first, or a status that says what was missing or degenerate.
  virtual PoseEstimate Solve(const Observations& observations) const = 0;
  // Where a refinement may start: poses of the plane of `resolved` (fitted, and ResolveWorld'ed),
  // which need neither rank nor covariance.
  virtual PoseEstimate Seeds(const Observations& resolved) const {
    PoseEstimate estimate = Solve(resolved);
    if (estimate.status.ok() && Evidence(resolved).frame.plane != resolved.frame.plane)
      estimate.status = Status::Refused("nothing ties its evidence to the world's plane");
    return estimate;
  }
  // The part of the observations that Solve uses, so that a refinement can be given the same.
  virtual Observations Evidence(const Observations& observations) const = 0;
};

// Solvers by name and stage; a value, not a global.
class SolverRegistry {
 public:
  // Replaces a solver of the same name and stage.
  void Add(std::shared_ptr<const Solver> solver);
  // Null if there is none.
  const Solver* Find(const std::string& name, SolverStage stage) const;
  // All, in the order in which they were added.
  const std::vector<std::shared_ptr<const Solver>>& solvers() const { return solvers_; }

 private:
  std::vector<std::shared_ptr<const Solver>> solvers_;
};

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_SOLVER_REGISTRY_H_
