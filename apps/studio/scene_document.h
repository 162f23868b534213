// Scene files (docs: scene files) as the page makes and the studio keeps them: JSON, image by
// image.
#ifndef CIRCLINE_APPS_STUDIO_SCENE_DOCUMENT_H_
#define CIRCLINE_APPS_STUDIO_SCENE_DOCUMENT_H_

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/common/scene.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/status.h"

namespace circline::apps {

using Json = nlohmann::ordered_json;

// A request that cannot be answered, with the HTTP status that says so.
class RequestError : public std::runtime_error {
 public:
  RequestError(int status, const std::string& sentence)
      : std::runtime_error(sentence), status_(status) {}
  int status() const { return status_; }

 private:
  int status_;
};

// The photo of an image's entry, however that writes the path: "./a.jpg" is "a.jpg".
std::string FileOf(const Json& entry);

// A list of a scene file; none: empty.
const Json& ListOf(const Json& scene, const char* key);

// A document of one image: `entry` (which may lack file and camera) with them. Throws RequestError
// where it is of another file, or has texts that no scene file can have.
Json OneImageDocument(const Json& entry, const std::string& file, const Json& camera);

// Read by the reader of scene files. Throws RequestError with its sentence.
SceneImage ReadDocument(const Json& document, const std::string& folder);

// `scene`, a document or null, with the image of `document` in the place of the one of the same
// file, and without cameras that no image is of. The cameras of the other images stay as they are:
// the document's gets another id where one of theirs has it.
Json WithImage(const Json& scene, const Json& document);

// A scene file as it stands, YAML or JSON; names are texts, also where they are written as numbers.
Status ReadSceneJson(const std::string& path, Json* scene);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_STUDIO_SCENE_DOCUMENT_H_
