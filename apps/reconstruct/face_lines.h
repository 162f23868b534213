// Lines on the faces of a box that are parallel to its edges.
#ifndef CIRCLINE_APPS_RECONSTRUCT_FACE_LINES_H_
#define CIRCLINE_APPS_RECONSTRUCT_FACE_LINES_H_

#include <vector>

#include "apps/reconstruct/fit_box.h"
#include "circline/ransac/detection/detect_lines.h"

namespace circline::apps {

// Of the photo's lines those within a visible face of the box, where `fit` has it, and nearly along
// one of its axes: printed borders and pictures are. They tell the box's directions better than its
// worn edges do.
std::vector<FaceLine> FaceLines(const std::vector<DetectedLine>& lines, const BoxFit& fit);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_FACE_LINES_H_
