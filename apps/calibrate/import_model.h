// Cameras and poses of a COLMAP model, and what circles add to it: scale, upright axes, planes.
#ifndef CIRCLINE_APPS_CALIBRATE_IMPORT_MODEL_H_
#define CIRCLINE_APPS_CALIBRATE_IMPORT_MODEL_H_

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/common/scene.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/status.h"
#include "circline/refine/adjust_photos.h"

namespace circline::apps {

using GivenPoses = std::map<std::size_t, CameraPose>;  // By SceneImage::index.

// Gives the photos the model's cameras, known as `sigma` has it, and looks up their poses. A photo
// is the image of the model whose name its path ends with. `notes`: photos that the model does not
// have.
Status ImportModel(const std::string& folder, const CameraSigma& sigma,
                   std::vector<SceneImage>* images, GivenPoses* poses,
                   std::vector<std::string>* notes);

// A plane with circles, in the world.
struct WorldPlane {
  std::string id;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::UnitZ();
  std::vector<AdjustedCircle> circles;
};

// The planes of the photos' circles, the world's own first: each one's circles are adjusted on
// their own, to the same given poses. `notes`: planes that come to nothing, and why.
std::vector<WorldPlane> PlanesOf(const std::vector<Observations>& photos,
                                 const AdjustOptions& options, const AdjustedPhotos& adjusted,
                                 std::vector<std::string>* notes);

// `landmarks.json`: circles, directions, planes and the similarity; `transform.txt`: the same as a
// matrix of 4 x 4, for `colmap model_transformer --transform_path`, which moves a whole model.
Status WriteLandmarks(const AdjustedPhotos& adjusted, const std::vector<WorldPlane>& planes,
                      const std::string& folder);

// For the eye.
std::string LandmarkTable(const AdjustedPhotos& adjusted, const std::vector<WorldPlane>& planes);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_CALIBRATE_IMPORT_MODEL_H_
