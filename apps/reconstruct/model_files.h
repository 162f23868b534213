// The model as files of 3-D programs.
#ifndef CIRCLINE_APPS_RECONSTRUCT_MODEL_FILES_H_
#define CIRCLINE_APPS_RECONSTRUCT_MODEL_FILES_H_

#include <string>

#include "apps/reconstruct/model.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// Wavefront OBJ, which every 3-D program reads: model.obj, model.mtl and a texture for each patch
// (texture.png for the plane, texture_<name>.png for the others). Z is up, the unit is the pose's.
// The camera is a pyramid of lines. `camera` states its size.
Status WriteObj(const Model& model, const Camera& camera, const CameraPose& pose,
                const std::string& folder);

// Binary glTF 2.0, which browsers and Blender open: one mesh for each patch, with its texture
// inside the file, and the camera. Y is up, as glTF has it. Textures are shown as they are, without
// light; what is transparent in them is cut out. `camera` states its size.
Status WriteGlb(const Model& model, const Camera& camera, const CameraPose& pose,
                const std::string& path);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_MODEL_FILES_H_
