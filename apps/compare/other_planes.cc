#include "apps/compare/other_planes.h"

#include <cstddef>
#include <string>

#include "apps/common/pose_error.h"
#include "apps/common/text.h"

namespace circline::apps {
namespace {

constexpr double kSure = 0.9;      // Probability of a first hypothesis.
constexpr double kFarApart = 5.0;  // Degrees between normals; those of sure answers are known to 1.

bool IsSure(const SolverRun& run) {
  return run.HasAnswer() && run.estimate.hypotheses.front().probability >= kSure;
}

double AngleBetweenNormalsDeg(const SolverRun& a, const SolverRun& b) {
  const auto normal = [](const SolverRun& run) -> Eigen::Vector3d {
    return run.estimate.hypotheses.front().cam_from_world.rotation.col(2);
  };
  return AngleWithoutSenseDeg(normal(a), normal(b));
}

// Whether the two runs stand beside each other: not a solver and its own refinement, nor
// refinements with different losses.
bool AreRivals(const SolverRun& a, const SolverRun& b, const LossSetting* first_loss) {
  if (a.solver == b.solver) return false;
  if (a.loss == b.loss) return true;
  return (a.loss == nullptr && b.loss == first_loss) || (b.loss == nullptr && a.loss == first_loss);
}

}  // namespace

void NoteOtherPlanes(std::vector<SolverRun>* runs) {
  const LossSetting* first_loss = nullptr;
  for (const SolverRun& run : *runs) {
    if (first_loss == nullptr) first_loss = run.loss;
  }
  for (SolverRun& run : *runs) {
    if (!IsSure(run)) continue;
    std::vector<std::string> others;  // By solver: of its stages the first that is far off.
    const std::string* last = nullptr;
    for (const SolverRun& other : *runs) {
      if (!AreRivals(run, other, first_loss) || !IsSure(other)) continue;
      const double angle = AngleBetweenNormalsDeg(run, other);
      if (!(angle > kFarApart) || (last != nullptr && *last == other.solver)) continue;
      others.push_back(other.solver + " (" + FormatShort(angle, 2) + " deg away)");
      last = &other.solver;
    }
    if (others.empty()) continue;
    run.estimate.notes.push_back("others are as sure of another plane: " + JoinList(others, ", "));
  }
}

}  // namespace circline::apps
