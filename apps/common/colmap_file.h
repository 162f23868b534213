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

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_COLMAP_FILE_H_
