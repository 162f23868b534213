// The pose and what was measured, in files of other programs.
#ifndef CIRCLINE_APPS_STUDIO_EXPORT_POSE_H_
#define CIRCLINE_APPS_STUDIO_EXPORT_POSE_H_

#include <string>
#include <vector>

#include "apps/compare/image_run.h"
#include "apps/studio/scene_document.h"

namespace circline::apps {

// Names of what a format writes: gltf, colmap, tum, csv. Throws RequestError where there is no such
// format.
std::vector<std::string> ExportedFiles(const std::string& format);

// Of {format, hypothesis, measure} writes the hypothesis' camera or the measurements into a folder.
// {files, note}. Throws RequestError.
Json ExportPose(const ImageRun& run, const Json& request, const std::string& folder);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_STUDIO_EXPORT_POSE_H_
