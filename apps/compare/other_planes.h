// Solvers that are sure of different planes.
#ifndef CIRCLINE_APPS_COMPARE_OTHER_PLANES_H_
#define CIRCLINE_APPS_COMPARE_OTHER_PLANES_H_

#include <vector>

#include "apps/compare/image_run.h"

namespace circline::apps {

// Each solver answers for the evidence that it takes: circles may lie in one plane of a photo, the
// lines in another. Where two answers are both sure and their normals are far apart, each gets a
// note that names the other. Compared are closed forms, and refinements with the same loss; closed
// forms and refinements with the first one.
void NoteOtherPlanes(std::vector<SolverRun>* runs);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_OTHER_PLANES_H_
