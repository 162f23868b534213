// COLMAP's cameras. Its pixel centres lie at half integers, ours at integers: principal points move
// by half a pixel.
#ifndef CIRCLINE_APPS_COMMON_COLMAP_CAMERA_H_
#define CIRCLINE_APPS_COMMON_COLMAP_CAMERA_H_

#include <cstddef>
#include <string>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// Of a camera model by its name, SIMPLE_RADIAL say. Not ok: it is none that we have.
Status NumColmapParameters(const std::string& name, std::size_t* number);
// Model and numbers of a camera, its id and size apart. Not ok: what is wrong with them.
Status SetColmapCamera(const std::string& name, const std::vector<double>& parameters,
                       Camera* camera);

// The content of a cameras.txt. Not ok: one line that names `path` and the line.
Status ParseColmapCameras(const std::string& path, const std::string& text,
                          std::vector<Camera>* cameras);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_COLMAP_CAMERA_H_
