// COLMAP's models: cameras, and where photos were taken. Its pixel centres lie at half integers,
// ours at integers: principal points move by half a pixel.
#ifndef CIRCLINE_APPS_COMMON_COLMAP_FILE_H_
#define CIRCLINE_APPS_COMMON_COLMAP_FILE_H_

#include <cstddef>
#include <string>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/pose.h"
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

struct ColmapImage {
  std::string name;        // As COLMAP has it: below its folder of images.
  std::size_t camera = 0;  // Index.
  CameraPose cam_from_world;
};

struct ColmapModel {
  std::vector<Camera> cameras;  // Id: COLMAP's number.
  std::vector<ColmapImage> images;
};

// Reads cameras.bin and images.bin of a folder, else cameras.txt and images.txt; its points are
// passed over.
Status ReadColmapModel(const std::string& folder, ColmapModel* model);

// The files that make up the model in that folder, its points among them.
std::vector<std::string> FilesOfColmapModel(const std::string& folder);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_COLMAP_FILE_H_
