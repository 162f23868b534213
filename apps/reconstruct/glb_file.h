// The model as binary glTF 2.0, which browsers and Blender open.
#ifndef CIRCLINE_APPS_RECONSTRUCT_GLB_FILE_H_
#define CIRCLINE_APPS_RECONSTRUCT_GLB_FILE_H_

#include <string>

#include "apps/reconstruct/model.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// One mesh for each patch, with its texture inside the file, and the camera. Y is up, as glTF has
// it. Textures are shown as they are, without light; what is transparent in them is cut out.
// `camera` states its size.
Status WriteGlb(const Model& model, const Camera& camera, const CameraPose& pose,
                const std::string& path);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_GLB_FILE_H_
