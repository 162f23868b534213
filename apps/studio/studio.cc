#include "apps/studio/studio.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "apps/common/document.h"
#include "apps/common/output_file.h"
#include "apps/common/photo_file.h"
#include "apps/common/storage_node.h"
#include "apps/compare/encode.h"
#include "apps/studio/answer.h"

namespace circline::apps {
namespace {

// Up to here a photo goes to the page without loss.
constexpr std::size_t kLosslessPixels = 3'000'000;
// Wider ones are shown smaller; what is said of them is in their own pixels all the same.
constexpr int kShownWidth = 6000;
// Of what was said, which is asked again with each measurement, and of everything found.
constexpr std::size_t kKeptRuns = 2, kKeptPhotos = 3;
constexpr std::size_t kMaxDraftBytes = std::size_t{64} << 20;

// The entry of a scene file for that photo, or null.
Json EntryOf(const Json& scene, const std::string& name) {
  for (const Json& image : ListOf(scene, "images")) {
    if (FileOf(image) == name) return image;
  }
  return nullptr;
}

Json SavedCamera(const Json& scene, const std::string& name) {
  const Json entry = EntryOf(scene, name);
  if (!entry.is_object()) return nullptr;
  const Json& cameras = ListOf(scene, "cameras");
  if (!entry.contains("camera")) return cameras.size() == 1 ? cameras[0] : Json();
  for (const Json& camera : cameras) {
    if (camera["id"] == entry["camera"]) return camera;
  }
  return nullptr;
}

Status Write(const PhotoFolder& folder, const std::string& name, const std::string& text,
             std::string* path) {
  const Status status = folder.OwnPath(name, path);
  return status.ok() ? WriteFile(*path, text) : status;
}

}  // namespace

Studio::Studio(const CompareOptions& options, const PhotoFolder& folder, const Camera* camera)
    : options_(options), solvers_(options_), folder_(folder) {
  if (camera != nullptr) given_camera_ = CameraEntry(*camera, {});
}

Status Studio::ReadFiles() {
  const std::lock_guard<std::mutex> lock(mutex_);
  FollowScene();
  const Status draft = ReadDraft();
  return scene_error_.empty() ? draft : Status::Invalid(scene_error_);
}

void Studio::FollowScene() {
  using Time = std::filesystem::file_time_type;
  std::string path;
  Status status = folder_.OwnPath(kSceneFile, &path);
  if (!status.ok()) {
    scene_error_ = status.message;
    scene_written_.reset();
    return;
  }
  std::error_code error;
  const bool is_there = std::filesystem::exists(path, error);
  const Time written = is_there ? std::filesystem::last_write_time(path, error) : Time::min();
  if (scene_written_ == written) return;
  Json scene;
  if (is_there) status = ReadSceneJson(path, &scene);
  scene_error_ = status.message;
  scene_written_ = written;
  if (!status.ok()) return;
  scene_ = std::move(scene);
  cameras_.clear();
}

Status Studio::ReadDraft() {
  std::error_code error;
  std::string path, text;
  draft_ = Json::object();
  Status status = folder_.OwnPath(kDraftFile, &path);
  if (status.ok() && std::filesystem::exists(path, error)) {
    status = ReadTextFile(path, &text);
    Json draft = Json::parse(text, nullptr, false);
    if (status.ok() && !draft.is_object()) status = Status::Invalid(path + ": is no JSON object");
    if (status.ok()) draft_ = std::move(draft);
  }
  draft_error_ = status.message;
  return status;
}

std::size_t Studio::Index(const Json& request) const {
  const auto image = request.find("image");
  std::size_t n = folder_.size();
  if (image != request.end() && image->is_string()) n = folder_.Find(image->get<std::string>());
  if (image != request.end() && image->is_number_integer() && *image >= 0)
    n = image->get<std::size_t>();
  if (n < folder_.size()) return n;
  throw RequestError(404, "there is no such image; /api/images lists them");
}

Json Studio::Images() {
  const std::lock_guard<std::mutex> lock(mutex_);
  FollowScene();
  std::set<std::string> saved;
  for (const Json& image : ListOf(scene_, "images")) saved.insert(FileOf(image));
  Json images = Json::array();
  for (std::size_t n = 0; n < folder_.size(); ++n) {
    const std::string& name = folder_.name(n);
    images.push_back({{"image", n},
                      {"name", TextAsWritten(name)},
                      {"saved", saved.count(name) > 0},
                      {"draft", draft_.contains(TextAsWritten(name))}});
  }
  return {{"folder", TextAsWritten(folder_.path())},
          {"scene", kSceneFile},
          {"problem", scene_error_.empty() ? draft_error_ : scene_error_},
          {"images", images}};
}

std::shared_ptr<const LoadedPhoto> Studio::LoadPhoto(std::size_t index) {
  const std::lock_guard<std::mutex> lock(photos_mutex_);
  const auto known = std::find_if(photos_.begin(), photos_.end(),
                                  [&](const auto& photo) { return photo->index == index; });
  if (known != photos_.end()) {
    photos_.splice(photos_.begin(), photos_, known);
    return photos_.front();
  }
  auto photo = std::make_shared<LoadedPhoto>();
  photo->index = index;
  const Status found = folder_.PhotoPath(index, &photo->path);
  if (!found.ok()) throw RequestError(403, found.message);
  const std::string error = ReadPhoto(photo->path, &photo->pixels);
  if (!error.empty()) throw RequestError(422, folder_.name(index) + ": " + error);
  photos_.push_front(photo);
  if (photos_.size() > kKeptPhotos) photos_.pop_back();
  return photo;
}

ShownPhoto Studio::Photo(std::size_t n) {
  const auto photo = LoadPhoto(Index({{"image", n}}));
  ShownPhoto shown;
  shown.width = photo->pixels.cols;
  shown.height = photo->pixels.rows;
  const bool lossless = photo->pixels.total() <= kLosslessPixels;
  shown.bytes = lossless ? EncodePng(photo->pixels) : EncodeJpeg(photo->pixels, kShownWidth);
  shown.type = lossless ? "image/png" : "image/jpeg";
  return shown;
}

// The one given, else that of the scene file, else a guess.
Json Studio::CameraOfPhoto(const LoadedPhoto& photo) {
  if (!given_camera_.is_null()) return given_camera_;
  const std::lock_guard<std::mutex> lock(mutex_);
  FollowScene();
  const auto known = cameras_.find(photo.index);
  if (known != cameras_.end()) return known->second;
  Json camera = SavedCamera(scene_, folder_.name(photo.index));
  if (camera.is_null()) {
    const int width = photo.pixels.cols, height = photo.pixels.rows;
    GuessedCamera guess = options_.inputs.guess.ForPhoto(
        photo.path, width, height, options_.losses.front().estimation.noise_model.camera);
    guess.camera.id += "_" + std::to_string(width) + "x" + std::to_string(height);
    const CameraSigma& sigma = guess.sigma;
    camera = CameraEntry(
        guess.camera,
        {sigma.log_focal, {}, sigma.principal_point_px, sigma.k1, sigma.doubtful_log_focal});
  }
  cameras_[photo.index] = camera;
  return camera;
}

// What would be saved, and is estimated: so that circline_compare finds the same of the file.
Json Studio::Document(const Json& scene, const LoadedPhoto& photo) {
  const std::string& name = folder_.name(photo.index);
  if (TextAsWritten(name) != name) {
    throw RequestError(422, "the photo's name is not UTF-8: no scene file can hold it");
  }
  return OneImageDocument(scene, name, CameraOfPhoto(photo));
}

Json Studio::Session(std::size_t n) {
  const std::string& name = folder_.name(Index({{"image", n}}));
  const std::lock_guard<std::mutex> lock(mutex_);
  FollowScene();
  const auto draft = draft_.find(TextAsWritten(name));
  return {{"image", n},
          {"name", TextAsWritten(name)},
          {"saved", EntryOf(scene_, name)},
          {"draft", draft != draft_.end() ? *draft : Json()}};
}

std::shared_ptr<const PhotoRun> Studio::Run(const Json& scene,
                                            const std::shared_ptr<const LoadedPhoto>& photo) {
  const Json document = Document(scene, *photo);
  const std::string text = JsonText(document);
  std::shared_future<std::shared_ptr<const PhotoRun>> run;
  {
    const std::lock_guard<std::mutex> lock(runs_mutex_);
    const auto known = std::find_if(runs_.begin(), runs_.end(), [&](const KeptRun& kept) {
      return kept.photo == photo && kept.document == text;
    });
    if (known != runs_.end()) {
      runs_.splice(runs_.begin(), runs_, known);
    } else {
      const auto work = [this, document, photo]() -> std::shared_ptr<const PhotoRun> {
        auto made = std::make_shared<PhotoRun>();
        made->image = ReadDocument(document, folder_.path());
        made->run = RunImage(options_, &solvers_, &made->image, &photo->pixels);
        return made;
      };
      // By the first thread that waits for it.
      runs_.push_front({photo, text, std::async(std::launch::deferred, work).share()});
      if (runs_.size() > kKeptRuns) runs_.pop_back();
    }
    run = runs_.front().run;
  }
  return run.get();
}

Json Studio::Detect(const Json& request) {
  const auto made = Run(Json::object(), LoadPhoto(Index(request)));
  if (!made->run.read_error.empty()) throw RequestError(422, made->run.read_error);
  return DetectionJson(made->run, options_.fit.noise_model);
}

Json Studio::Estimate(const Json& request) {
  const auto photo = LoadPhoto(Index(request));
  return EstimateJson(Run(request.value("scene", Json::object()), photo)->run, request);
}

Json Studio::Save(const Json& request) {
  const auto photo = LoadPhoto(Index(request));
  const Json document = Document(Required(request, "scene"), *photo);
  ReadDocument(document, folder_.path());
  const std::lock_guard<std::mutex> lock(mutex_);
  FollowScene();
  if (!scene_error_.empty()) {
    throw RequestError(409, std::string(kSceneFile) + " is not written over: " + scene_error_);
  }
  Json whole = WithImage(scene_, document);
  std::string path;
  const Status status = Write(folder_, kSceneFile, DocumentText(whole), &path);
  if (!status.ok()) throw RequestError(409, status.message);
  std::error_code error;
  scene_written_ = std::filesystem::last_write_time(path, error);
  scene_ = std::move(whole);
  return {{"file", TextAsWritten(path)}};
}

Json Studio::Draft(const Json& request) {
  const std::string name = TextAsWritten(folder_.name(Index(request)));
  const Json& state = Required(request, "state");
  if (!state.is_object() && !state.is_null()) throw RequestError(400, "'state' must be an object");
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!draft_error_.empty()) {
    throw RequestError(409, std::string(kDraftFile) + " is not written over: " + draft_error_);
  }
  Json draft = draft_;
  draft.erase(name);
  if (state.is_object()) draft[name] = state;
  const std::string text = JsonText(draft) + "\n";
  if (text.size() > kMaxDraftBytes)
    throw RequestError(413, "the draft would exceed 64 MB: save it");
  std::string path;
  const Status status = Write(folder_, kDraftFile, text, &path);
  if (!status.ok()) throw RequestError(409, status.message);
  draft_ = std::move(draft);
  return {{"file", TextAsWritten(path)}};
}

Json Studio::Export(const Json& request) {
  const auto photo = LoadPhoto(Index(request));
  const auto made = Run(Required(request, "scene"), photo);
  const std::string below = std::string(kExportFolder) + "/" + folder_.name(photo->index);
  std::string path;
  Status status = folder_.OwnPath(below, &path);
  if (status.ok()) status = CreateFolder(path);
  for (const std::string& name : ExportedFiles(Required(request, "format").get<std::string>())) {
    std::string unused;
    if (status.ok()) status = folder_.OwnPath(below + "/" + name, &unused);
  }
  if (!status.ok()) throw RequestError(409, status.message);
  return ExportPose(made->run, request, path);
}

}  // namespace circline::apps
