#include "apps/calibrate/import_model.h"

#include <Eigen/Geometry>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "apps/common/colmap_file.h"
#include "apps/common/document.h"
#include "apps/common/output_file.h"
#include "apps/common/text.h"

namespace circline::apps {
namespace {

using Json = nlohmann::ordered_json;

// The image with whose whole name the path ends, the longest one. Null: none.
const ColmapImage* Find(const ColmapModel& model, const std::string& path) {
  const std::string whole = "/" + std::filesystem::path(path).lexically_normal().generic_string();
  const ColmapImage* best = nullptr;
  for (const ColmapImage& image : model.images) {
    const std::string name = "/" + image.name;
    const bool ends_so = whole.size() >= name.size() &&
                         whole.compare(whole.size() - name.size(), name.size(), name) == 0;
    if (ends_so && (best == nullptr || image.name.size() > best->name.size())) best = &image;
  }
  return best;
}

Eigen::Affine3d ModelFromWorld(const GivenFrame& given) {
  return Eigen::Translation3d(given.translation) * given.rotation * Eigen::Scaling(given.scale);
}

}  // namespace

Status ImportModel(const std::string& folder, const CameraSigma& sigma,
                   std::vector<SceneImage>* images, GivenPoses* poses,
                   std::vector<std::string>* notes) {
  ColmapModel model;
  Status status = ReadColmapModel(folder, &model);
  if (!status.ok()) return status;
  std::map<const ColmapImage*, std::string> taken;
  std::vector<SceneImage> posed;
  for (SceneImage& image : *images) {
    const ColmapImage* of = Find(model, image.path);
    if (of == nullptr) {
      notes->push_back(image.name + ": the model has no pose of it");
      continue;
    }
    const auto [other, is_new] = taken.insert({of, image.path});
    if (!is_new) {
      return Status::Invalid(folder + ": " + other->second + " and " + image.path +
                             " are both its image " + of->name);
    }
    image.observations.camera = model.cameras[of->camera];
    image.camera_sigma = {sigma.log_focal, sigma.log_aspect, sigma.principal_point_px, sigma.k1,
                          std::nullopt};
    image.guessed_sigma.reset();
    (*poses)[image.index] = of->cam_from_world;
    posed.push_back(std::move(image));
  }
  if (posed.empty()) {
    return Status::Invalid(folder + ": no photo is one of its " +
                           std::to_string(model.images.size()) + " images, of which one is " +
                           model.images.front().name);
  }
  *images = std::move(posed);
  return Status::Ok();
}

std::vector<WorldPlane> PlanesOf(const std::vector<Observations>& photos,
                                 const AdjustOptions& options, const AdjustedPhotos& adjusted,
                                 std::vector<std::string>* notes) {
  std::set<std::string> others;
  for (const Observations& photo : photos) {
    const std::string own = ResolveWorld(photo).frame.plane;
    for (const CircleObservation& circle : photo.circles) {
      if (!circle.plane.empty() && circle.plane != own) others.insert(circle.plane);
    }
  }
  std::vector<WorldPlane> planes(1);
  planes.front().id = ResolveWorld(photos.front()).frame.plane;
  planes.front().circles = adjusted.circles;
  const Eigen::Affine3d world_from_model = ModelFromWorld(*adjusted.given).inverse();
  std::vector<Observations> seen = photos;
  for (const std::string& id : others) {
    for (Observations& photo : seen) {
      photo.frame = {};
      photo.frame.plane = id;
    }
    const AdjustedPhotos own = AdjustPhotos(seen, options);
    if (!own.status.ok()) {
      notes->push_back("plane '" + id + "': left out: " + own.status.message);
      continue;
    }
    const Eigen::Affine3d world_from_other = world_from_model * ModelFromWorld(*own.given);
    const double scale = own.given->scale / adjusted.given->scale;
    const Eigen::Matrix3d R = world_from_other.linear() / scale;
    WorldPlane plane;
    plane.id = id;
    plane.origin = world_from_other.translation();
    plane.normal = R.col(2);
    for (AdjustedCircle circle : own.circles) {
      circle.center = world_from_other * circle.center;
      circle.normal = R * circle.normal;
      circle.radius *= scale;
      plane.circles.push_back(std::move(circle));
    }
    planes.push_back(std::move(plane));
  }
  return planes;
}

Status WriteLandmarks(const AdjustedPhotos& adjusted, const std::vector<WorldPlane>& planes,
                      const std::string& folder) {
  const Eigen::Affine3d world_from_model = ModelFromWorld(*adjusted.given).inverse();
  const double scale = 1.0 / adjusted.given->scale;
  Json json = {{"metric", adjusted.metric},
               {"world_from_model",
                {{"scale", scale},
                 {"scale_sigma", adjusted.metric ? scale * adjusted.given->log_scale_sigma : 0.0},
                 {"rotation", JsonNumbers(adjusted.given->rotation.transpose())},
                 {"translation", JsonNumbers(world_from_model.translation())}}},
               {"planes", Json::array()},
               {"directions", Json::array()}};
  for (const WorldPlane& plane : planes) {
    Json circles = Json::array();
    for (const AdjustedCircle& circle : plane.circles) {
      circles.push_back({{"id", circle.id},
                         {"center", JsonNumbers(circle.center)},
                         {"normal", JsonNumbers(circle.normal)},
                         {"radius", circle.radius}});
    }
    json["planes"].push_back({{"id", plane.id},
                              {"origin", JsonNumbers(plane.origin)},
                              {"normal", JsonNumbers(plane.normal)},
                              {"circles", circles}});
  }
  for (const AdjustedDirection& direction : adjusted.directions)
    json["directions"].push_back(
        {{"id", direction.id}, {"direction", JsonNumbers(direction.direction)}});
  const Status status = WriteFile(folder + "/landmarks.json", DocumentText(json));
  if (!status.ok()) return status;
  std::ostringstream text;
  text << world_from_model.matrix().format({17, Eigen::DontAlignCols}) << "\n";
  return WriteFile(folder + "/transform.txt", text.str());
}

std::string LandmarkTable(const AdjustedPhotos& adjusted, const std::vector<WorldPlane>& planes) {
  std::ostringstream out;
  const double scale = 1.0 / adjusted.given->scale;
  if (adjusted.metric) {
    out << "one unit of the model is " << FormatShort(scale, 5) << " +- "
        << FormatShort(scale * adjusted.given->log_scale_sigma, 2)
        << " in the unit of the known radius\n";
  } else {
    out << "no radius is known: the scale is the model's own up to " << FormatShort(scale, 5)
        << "\n";
  }
  for (const WorldPlane& plane : planes) {
    out << "plane '" << plane.id << "': " << plane.circles.size()
        << (plane.circles.size() == 1 ? " circle" : " circles") << ", normal "
        << FormatFixed(plane.normal.x(), 4) << " " << FormatFixed(plane.normal.y(), 4) << " "
        << FormatFixed(plane.normal.z(), 4) << "\n";
  }
  if (!adjusted.directions.empty())
    out << adjusted.directions.size() << " directions of parallel lines\n";
  return out.str();
}

}  // namespace circline::apps
