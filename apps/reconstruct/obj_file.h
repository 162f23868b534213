// The model as Wavefront OBJ, which every 3-D program reads. Z is up, the unit is the pose's.
#ifndef CIRCLINE_APPS_RECONSTRUCT_OBJ_FILE_H_
#define CIRCLINE_APPS_RECONSTRUCT_OBJ_FILE_H_

#include <string>

#include "apps/reconstruct/model.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// model.obj, model.mtl and a texture for each patch (texture.png for the plane, texture_<name>.png
// for the others). The camera is a pyramid of lines. `camera` states its size.
Status WriteObj(const Model& model, const Camera& camera, const CameraPose& pose,
                const std::string& folder);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_OBJ_FILE_H_
