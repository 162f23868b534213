// What the page shows of an estimate, and what it exports of it.
#ifndef CIRCLINE_APPS_STUDIO_ANSWER_H_
#define CIRCLINE_APPS_STUDIO_ANSWER_H_

#include <string>
#include <vector>

#include "apps/compare/image_run.h"
#include "apps/studio/scene_document.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/pose.h"

namespace circline::apps {

// The line of observations.jsonl, with `contours`: of each ellipse its inlier edge points, 1/1000
// px, as a scene file takes them, and `contour_sigma_px`.
Json DetectionJson(const ImageRun& run, const NoiseModel& noise);

// {status, message, notes, hypotheses: [lines of results.jsonl], drawings, measurements}: of each
// hypothesis' drawing the `grid`, `horizon`, `origin`, `axes`, `box`: curves in pixels, null where
// they cannot be seen; `circles`: id, center_px, and center, normal and radius in the camera frame.
// The request's `measure`: a list of {kind: length | height | angle, points, sigma_px}, measured in
// its `hypothesis`.
Json EstimateJson(const ImageRun& run, const Json& request);

// What a request must have.
const Json& Required(const Json& request, const char* key);

// One measurement; null with the reason in `error` where it cannot be had.
Json Measured(const Json& asked, const PoseHypothesis& hypothesis, const Camera& camera);

// Names of what a format writes: gltf, colmap, tum, csv. Throws RequestError where there is no such
// format.
std::vector<std::string> ExportedFiles(const std::string& format);

// Of {format, hypothesis, measure} writes the hypothesis' camera or the measurements into a folder.
// {files, note}. Throws RequestError.
Json ExportPose(const ImageRun& run, const Json& request, const std::string& folder);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_STUDIO_ANSWER_H_
