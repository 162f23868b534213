// Cameras from files: OpenCV calibration files (YAML, JSON, XML) and COLMAP's cameras.txt.
#ifndef CIRCLINE_APPS_COMMON_CAMERA_FILE_H_
#define CIRCLINE_APPS_COMMON_CAMERA_FILE_H_

#include <string>
#include <vector>

#include "apps/common/storage_node.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// Every camera of the file; which kind of file it is shows in its content. COLMAP's pixel centres
// lie at half integers, ours at integers: the principal point moves by half a pixel. An OpenCV file
// gives one camera, with the id "camera"; `fisheye_model: 1` there means the fisheye model. Not ok:
// one line that names the file and what is wrong in it.
Status ReadCameraFile(const std::string& path, std::vector<Camera>* cameras);

// A camera of a scene file: id, model, width, height, camera_matrix, distortion.
Camera ReadSceneCamera(const StorageNode& node);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_CAMERA_FILE_H_
