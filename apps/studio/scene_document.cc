#include "apps/studio/scene_document.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "apps/common/camera_file.h"
#include "apps/common/document.h"
#include "apps/common/storage_node.h"

namespace circline::apps {
namespace {

// The file is for OpenCV's reader, too, which knows few escapes of texts.
void CheckText(const std::string& text) {
  const auto is_odd = [](char c) {
    return c == '"' || c == '\\' || static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
  };
  if (std::any_of(text.begin(), text.end(), is_odd))
    throw RequestError(400, "a text has a quotation mark, a backslash or a control character");
}

// The same as OpenCV's reader takes it: integers of 32 bits, and nothing that is null.
Json Checked(const Json& value) {
  if (value.is_string()) CheckText(value.get_ref<const std::string&>());
  if (value.is_number_integer() && std::abs(value.get<double>()) >= 1e9) return value.get<double>();
  if (!value.is_structured()) return value;
  Json checked = value.is_object() ? Json::object() : Json::array();
  for (const auto& [key, item] : value.items()) {
    if (value.is_array()) {
      checked.push_back(Checked(item));
    } else if (!item.is_null()) {
      CheckText(key);
      checked[key] = Checked(item);
    }
  }
  return checked;
}

// Keys of names, which may be whole numbers in a file ("id: 0"), and are texts all the same.
bool IsNameKey(const std::string& key) {
  static const auto* const keys = new std::set<std::string>{
      "id",      "camera", "plane", "concentric", "radius_group", "origin_is_center",
      "pencils", "pencil", "base",  "rim",        "file"};
  return keys->count(key) > 0;
}

// `key`: that of the value, or of the list that it is in.
void WriteNamesAsText(Json* value, const std::string& key) {
  if (value->is_number_integer() && IsNameKey(key)) *value = value->dump();
  if (!value->is_structured()) return;
  for (const auto& [own, item] : value->items())
    WriteNamesAsText(&item, value->is_object() ? own : key);
}

bool IsSameButId(const Json& a, const Json& b) {
  nlohmann::json first = a, second = b;  // In which the order of keys does not count.
  first.erase("id");
  second.erase("id");
  return first == second;
}

// The camera's own id, or one with a number, where `cameras` has another one under it that images
// are of (`used`): all OpenCV calibrations have one id, and so have guesses for one size of photo.
std::string FreeCameraId(const Json& camera, const Json& cameras,
                         const std::set<std::string>& used) {
  const std::string stem = camera["id"];
  for (int i = 1;; ++i) {
    const std::string id = i == 1 ? stem : stem + "_" + std::to_string(i);
    const bool is_taken =
        used.count(id) > 0 && std::any_of(cameras.begin(), cameras.end(), [&](const Json& other) {
          return other["id"] == id && !IsSameButId(other, camera);
        });
    if (!is_taken) return id;
  }
}

}  // namespace

std::string FileOf(const Json& entry) {
  return std::filesystem::path(entry.value("file", "")).lexically_normal().string();
}

const Json& ListOf(const Json& scene, const char* key) {
  static const auto* const empty = new Json(Json::array());
  return scene.is_object() && scene.contains(key) ? scene[key] : *empty;
}

Json OneImageDocument(const Json& entry, const std::string& file, const Json& camera) {
  if (!entry.is_object())
    throw RequestError(400, "'scene' must be an image's entry of a scene file");
  Json image = {{"file", file}, {"camera", camera.at("id")}};
  CheckText(file);
  const Json checked = Checked(entry);
  for (const auto& [key, value] : checked.items()) {
    if (key == "file" && value != image["file"])
      throw RequestError(400, "the scene is of another file than " + file);
    if (key != "file" && key != "camera") image[key] = value;
  }
  return {{"cameras", Json::array({camera})}, {"images", Json::array({image})}};
}

SceneImage ReadDocument(const Json& document, const std::string& folder) {
  std::vector<SceneImage> images;
  const Status status = ParseScene("scene", JsonText(document), folder, {}, &images);
  if (!status.ok()) throw RequestError(400, status.message);
  return images.front();
}

Json WithImage(const Json& scene, const Json& document) {
  Json image = document["images"][0], camera = document["cameras"][0];
  Json images = ListOf(scene, "images");
  const Json before = ListOf(scene, "cameras");
  std::set<std::string> used;
  auto place = images.end();
  for (auto other = images.begin(); other != images.end(); ++other) {
    // It may go without where there is one camera, which there may be no longer.
    if (!other->contains("camera") && before.size() == 1) (*other)["camera"] = before[0]["id"];
    if (place == images.end() && FileOf(*other) == FileOf(image))
      place = other;
    else
      used.insert(other->value("camera", ""));
  }
  camera["id"] = image["camera"] = FreeCameraId(camera, before, used);
  if (place != images.end())
    *place = image;
  else
    images.push_back(image);
  Json cameras = Json::array({camera});
  for (const Json& other : before) {
    if (other["id"] != camera["id"] && used.count(other["id"]) > 0) cameras.push_back(other);
  }
  Json whole = scene.is_object() ? scene : Json::object();
  whole["cameras"] = cameras;
  whole["images"] = images;
  return whole;
}

Status ReadSceneJson(const std::string& path, Json* scene) {
  std::vector<SceneImage> images;
  Status status = ReadScene(path, {}, &images);
  if (status.ok()) status = ReadStorage(path, scene);
  if (status.ok()) WriteNamesAsText(scene, "");
  return status;
}

}  // namespace circline::apps
