// What each closed form takes of the evidence and how it is evaluated. Internal: not installed.
#ifndef CIRCLINE_ESTIMATORS_CLOSED_FORM_RECIPES_H_
#define CIRCLINE_ESTIMATORS_CLOSED_FORM_RECIPES_H_

#include <functional>
#include <string>
#include <vector>

#include "circline/estimators/closed_form_poses.h"

namespace circline {

using Evaluate = std::function<std::vector<Candidate>(const Inputs&)>;

struct Recipe {
  std::string name, needs;
  // Keeps of the (fitted, resolved) observations what is used; a refusal says what was missing.
  std::function<Status(const Observations&, Observations*)> select;
  // Reads the kept evidence.
  std::function<Status(const Observations&, double sigma_px, Inputs*)> gather;
  Evaluate evaluate;
  std::string decided_by;  // What tells several hypotheses apart.
};

// A circle's centre, where its diameters cross: in calibrated coordinates that is to chords what a
// vanishing point is to a pencil's lines.
Status GatherDiameters(const Camera& camera, const CircleObservation& circle, double sigma_px,
                       Measured* center);

std::vector<Recipe> PencilRecipes();
std::vector<Recipe> CircleRecipes();

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_CLOSED_FORM_RECIPES_H_
