#include "apps/common/scene.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "apps/common/camera_file.h"
#include "apps/common/scene_values.h"
#include "apps/common/storage_node.h"
#include "apps/common/text.h"
#include "circline/estimators/basics.h"

namespace circline::apps {
namespace {

using Ids = std::set<std::string>;

constexpr const char* kSymmetries[] = {"none", "D2", "D4", "axis"};

void ReadCircle(const StorageNode& node, Ids* ids, SceneImage* image) {
  node.AllowKeys({"id", "contour", "roi", "center", "radius", "radius_sigma", "plane", "concentric",
                  "radius_group", "sigma_px", "diameters"});
  CircleObservation circle;
  circle.id = node.Require("id").Text();
  if (!ids->insert(circle.id).second) node.Fail("id '" + circle.id + "' is used twice");
  circle.sigma_px = ReadPositive(node.Get("sigma_px"));
  circle.radius = ReadPositive(node.Get("radius"));
  circle.radius_sigma = ReadPositive(node.Get("radius_sigma"));
  if (circle.radius_sigma > 0.0 && !(circle.radius > 0.0))
    node.Get("radius_sigma").Fail("there is no radius that it could be of");
  circle.plane = ReadOptionalText(node.Get("plane"));
  circle.concentric = ReadOptionalText(node.Get("concentric"));
  circle.radius_group = ReadOptionalText(node.Get("radius_group"));
  if (node.Get("center").Exists()) circle.center = ReadPixel(node.Get("center"));
  if (node.Get("diameters").Exists()) circle.diameters = ReadSegments(node.Get("diameters"));
  if (node.Get("contour").Exists()) {
    circle.points = ReadPixels(node.Get("contour"), 5);  // A conic has five parameters.
  } else if (node.Get("roi").Exists()) {
    image->rois.push_back({image->observations.circles.size(), ReadRectangle(node.Get("roi"))});
  } else {
    node.Fail("give 'contour', or 'roi'");
  }
  image->observations.circles.push_back(std::move(circle));
}

void ReadPencil(const StorageNode& node, Ids* ids, Observations* observations) {
  node.AllowKeys({"id", "segments", "direction", "plane", "sigma_px"});
  PencilObservation pencil;
  pencil.id = node.Require("id").Text();
  if (!ids->insert(pencil.id).second) node.Fail("id '" + pencil.id + "' is used twice");
  pencil.direction =
      ReadChoice(node.Get("direction"), {"x", "y", "z", "free"}, PencilDirection::kFree);
  pencil.plane = ReadOptionalText(node.Get("plane"));
  pencil.sigma_px = ReadPositive(node.Get("sigma_px"));
  for (const Segment& segment : ReadSegments(node.Require("segments"))) {
    LineObservation line;
    line.points = {segment[0], segment[1]};
    pencil.lines.push_back(std::move(line));
  }
  observations->pencils.push_back(std::move(pencil));
}

void CheckPlane(const StorageNode& node, const std::string& plane, const Observations& observations,
                bool detect_everything) {
  if (plane.empty() || detect_everything || NamesPlane(observations, plane)) return;
  node.Fail("no circle and no pencil names the plane '" + plane + "'");
}

void ReadFrame(const StorageNode& node, bool detect_everything, Observations* observations) {
  if (!node.Exists()) return;
  node.AllowKeys({"plane", "origin", "x_axis", "y_axis", "origin_is_center"});
  FrameObservation& frame = observations->frame;
  frame.plane = ReadOptionalText(node.Get("plane"));
  CheckPlane(node.Get("plane"), frame.plane, *observations, detect_everything);
  if (node.Get("origin").Exists()) frame.origin = ReadPixel(node.Get("origin"));
  if (node.Get("x_axis").Exists()) frame.x_axis = ReadSegment(node.Get("x_axis"));
  if (node.Get("y_axis").Exists()) frame.y_axis = ReadSegment(node.Get("y_axis"));
  const StorageNode center = node.Get("origin_is_center");
  frame.origin_is_center = ReadOptionalText(center);
  if (center.Exists() && FindCircle(*observations, frame.origin_is_center) < 0) {
    center.Fail("there is no circle '" + frame.origin_is_center + "'");
  }
}

void ReadKnownAngle(const StorageNode& node, const Ids& pencil_ids, Observations* observations) {
  node.AllowKeys({"pencils", "value", "sigma"});
  KnownAngle angle;
  const StorageNode pencils = node.Require("pencils");
  const std::vector<StorageNode> ids = pencils.Items();
  if (ids.size() != 2) {
    pencils.Fail("must name two pencils");
    return;
  }
  for (std::size_t i = 0; i < 2; ++i) {
    angle.pencils[i] = ids[i].Text();
    if (pencil_ids.count(angle.pencils[i]) == 0) {
      ids[i].Fail("there is no pencil '" + angle.pencils[i] + "'");
    }
  }
  if (angle.pencils[0] == angle.pencils[1]) pencils.Fail("names the same pencil twice");
  const StorageNode value = node.Require("value");
  angle.value = value.Number() * kDegree;
  if (std::abs(angle.value) > 2.0 * kPi) value.Fail("must be within 360 degrees");
  const StorageNode sigma = node.Get("sigma");
  if (sigma.Exists()) angle.sigma = sigma.Number() * kDegree;
  if (angle.sigma < 0.0) sigma.Fail("must be 0 or positive");
  observations->known_angles.push_back(angle);
}

void ReadKnown(const StorageNode& node, const Ids& pencil_ids, bool detect_everything,
               Observations* observations) {
  if (!node.Exists()) return;
  node.AllowKeys({"angle_deg", "length"});
  for (const StorageNode& item : node.Get("angle_deg").Items())
    ReadKnownAngle(item, pencil_ids, observations);
  for (const StorageNode& item : node.Get("length").Items()) {
    item.AllowKeys({"points", "plane", "value", "sigma"});
    KnownLength length;
    length.points = ReadSegment(item.Require("points"));
    length.plane = ReadOptionalText(item.Get("plane"));
    CheckPlane(item.Get("plane"), length.plane, *observations, detect_everything);
    length.value = item.Require("value").Number();
    if (!(length.value > 0.0)) item.Get("value").Fail("must be positive");
    length.sigma = ReadPositive(item.Get("sigma"));
    observations->known_lengths.push_back(length);
  }
}

void ReadTruth(const StorageNode& node, SceneImage* image) {
  if (!node.Exists()) return;
  node.AllowKeys({"rotation", "translation", "symmetry", "directions"});
  Truth truth;
  if (node.Get("rotation").Exists()) truth.rotation = ReadRotation(node.Get("rotation"));
  if (node.Get("translation").Exists()) truth.translation = ReadVector3(node.Get("translation"));
  truth.symmetry = ReadChoice(node.Get("symmetry"),
                              {std::begin(kSymmetries), std::end(kSymmetries)}, Symmetry::kNone);
  for (const StorageNode& item : node.Get("directions").Items()) {
    item.AllowKeys({"pencil", "value"});
    TrueDirection direction{item.Require("pencil").Text(), ReadVector3(item.Require("value"))};
    const double norm = direction.direction.norm();
    if (!(norm > 0.0)) item.Get("value").Fail("is not a direction");
    direction.direction /= norm > 0.0 ? norm : 1.0;
    if (!image->detect_everything && FindPencil(image->observations, direction.pencil) < 0) {
      item.Get("pencil").Fail("there is no pencil '" + direction.pencil + "'");
    }
    truth.directions.push_back(direction);
  }
  image->truth = truth;
}

void ReadPoints(const StorageNode& node, SceneImage* image) {
  if (!node.Exists()) return;
  const std::vector<double> v = node.Numbers(0, 5);
  for (std::size_t i = 0; i + 4 < v.size(); i += 5) {
    image->points.push_back({{v[i], v[i + 1]}, {v[i + 2], v[i + 3], v[i + 4]}});
  }
}

struct SceneCamera {
  Camera camera;
  StatedCameraSigma sigma;
};

const SceneCamera* ChooseCamera(const StorageNode& image_node,
                                const std::vector<SceneCamera>& cameras) {
  const StorageNode node = image_node.Get("camera");
  if (!node.Exists()) {
    if (cameras.size() == 1) return &cameras.front();
    image_node.Fail(cameras.empty() ? "there is no camera for it"
                                    : "'camera' is missing, and there are several cameras");
    return nullptr;
  }
  const std::string id = node.Text();
  std::vector<std::string> ids;
  for (const SceneCamera& candidate : cameras) {
    if (candidate.camera.id == id) return &candidate;
    ids.push_back(candidate.camera.id);
  }
  node.Fail("there is no camera '" + id + "'" + DidYouMean(id, ids));
  return nullptr;
}

SceneImage ReadImage(StorageNode node, const std::filesystem::path& folder,
                     const std::vector<SceneCamera>& cameras) {
  SceneImage image;
  const std::string place = node.place();
  if (node.Get("file").Exists()) {
    image.name = node.Get("file").Text();
    node.set_place(place + " (\"" + image.name + "\")");
  }
  node.AllowKeys({"file", "camera", "circles", "pencils", "frame", "known", "truth", "points",
                  "faces", "solids"});
  if (node.Require("file").Exists() && image.name.empty()) node.Get("file").Fail("is empty");
  image.path = (folder / image.name).lexically_normal().string();
  const SceneCamera* camera = ChooseCamera(node, cameras);
  if (camera != nullptr) {
    image.observations.camera = camera->camera;
    image.camera_sigma = camera->sigma;
  }
  Ids circle_ids, pencil_ids;
  for (const StorageNode& item : node.Get("circles").Items()) ReadCircle(item, &circle_ids, &image);
  for (const StorageNode& item : node.Get("pencils").Items())
    ReadPencil(item, &pencil_ids, &image.observations);
  image.detect_everything =
      image.observations.circles.empty() && image.observations.pencils.empty();
  ReadFrame(node.Get("frame"), image.detect_everything, &image.observations);
  ReadKnown(node.Get("known"), pencil_ids, image.detect_everything, &image.observations);
  ReadTruth(node.Get("truth"), &image);
  ReadPoints(node.Get("points"), &image);
  image.solids = ReadSolids(node, image.observations);
  if (node.ok() && !image.detect_everything && image.rois.empty()) {
    const Status status = image.observations.Validate();
    if (!status.ok()) node.Fail(status.message);
  }
  return image;
}

}  // namespace

const char* SymmetryName(Symmetry symmetry) {
  return kSymmetries[static_cast<std::size_t>(symmetry)];
}

bool NamesPlane(const Observations& observations, const std::string& plane) {
  const auto is_in_plane = [&](const auto& feature) { return feature.plane == plane; };
  const auto& circles = observations.circles;
  const auto& pencils = observations.pencils;
  return std::any_of(circles.begin(), circles.end(), is_in_plane) ||
         std::any_of(pencils.begin(), pencils.end(), is_in_plane);
}

Status ReadScene(const std::string& path, const std::vector<Camera>& cameras,
                 std::vector<SceneImage>* images, std::string* rigid) {
  images->clear();
  std::string text;
  const Status status = ReadTextFile(path, &text);
  if (!status.ok()) return status;
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return ParseScene(path, text, folder, cameras, images, rigid);
}

Status ParseScene(const std::string& name, const std::string& text, const std::string& folder,
                  const std::vector<Camera>& cameras, std::vector<SceneImage>* images,
                  std::string* rigid) {
  images->clear();
  StorageNode::Json document;
  Status status = ParseStorage(name, text, &document);
  if (!status.ok()) return status;
  const StorageNode root(&document, "", &status);
  root.AllowKeys({"cameras", "images", "rigid"});
  const StorageNode stated = root.Get("rigid");
  const std::string choice = ReadOptionalText(stated);
  if (stated.Exists() && choice != "auto" && choice != "yes" && choice != "no")
    stated.Fail("must be auto, yes or no");
  if (rigid != nullptr) *rigid = choice;
  std::vector<SceneCamera> all;
  for (const Camera& camera : cameras) all.push_back({camera, {}});
  const std::vector<StorageNode> own = root.Get("cameras").Items();
  if (status.ok() && !cameras.empty() && !own.empty()) {
    return Status::Invalid("--camera goes with --images, or a scene file without cameras; " + name +
                           " has cameras of its own");
  }
  for (const StorageNode& item : own) {
    SceneCamera read;
    read.camera = ReadSceneCamera(item, &read.sigma);
    const std::string& id = read.camera.id;
    const bool twice = std::any_of(all.begin(), all.end(),
                                   [&](const SceneCamera& other) { return other.camera.id == id; });
    if (twice) item.Fail("camera '" + id + "' is there twice");
    all.push_back(std::move(read));
  }
  for (const StorageNode& item : root.Require("images").Items()) {
    if (!status.ok()) break;
    images->push_back(ReadImage(item, folder, all));
  }
  if (status.ok() && images->empty()) root.Get("images").Fail("has no image");
  if (!status.ok()) {
    images->clear();
    return Status::Invalid(name + ": " + status.message);
  }
  return Status::Ok();
}

}  // namespace circline::apps
