// What the page asks for, answered in JSON; knows nothing of HTTP.
#ifndef CIRCLINE_APPS_STUDIO_STUDIO_H_
#define CIRCLINE_APPS_STUDIO_STUDIO_H_

#include <filesystem>
#include <future>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "apps/compare/image_run.h"
#include "apps/compare/options.h"
#include "apps/studio/photo_folder.h"
#include "apps/studio/scene_document.h"

namespace circline::apps {

// A photo as browsers show it.
struct ShownPhoto {
  std::string bytes, type;
  int width = 0, height = 0;  // Of the photo itself; what is shown may be smaller.
};

struct LoadedPhoto {
  std::size_t index = 0;
  std::string path;
  cv::Mat pixels;
};

// One document of a photo, estimated.
struct PhotoRun {
  SceneImage image;  // Of which `run` is.
  ImageRun run;
};

// Many threads may use one. Answers and requests: docs/studio.md. Throws RequestError.
class Studio {
 public:
  static constexpr const char* kSceneFile = "scene.json";
  static constexpr const char* kDraftFile = "scene.draft.json";
  static constexpr const char* kExportFolder = "export";

  // `camera`: of all photos; null where it is guessed, or in the scene file.
  Studio(const CompareOptions& options, const PhotoFolder& folder, const Camera* camera);
  Studio(const Studio&) = delete;
  Studio& operator=(const Studio&) = delete;
  // Reads the scene file and the draft of the folder, where they are. Not ok: a sentence; the
  // studio works without, and writes nothing over what it could not read. A scene file that
  // changes later is read again.
  Status ReadFiles();

  Json Images();
  ShownPhoto Photo(std::size_t n);
  Json Session(std::size_t n);         // What was said of photo n: draft and saved entry.
  Json Detect(const Json& request);    // {image}
  Json Estimate(const Json& request);  // {image, scene, hypothesis, measure}
  Json Save(const Json& request);      // {image, scene}
  Json Draft(const Json& request);     // {image, state}: any object; null drops it.
  Json Export(const Json& request);    // {image, scene, hypothesis, measure, format}

 private:
  std::size_t Index(const Json& request) const;
  // Throws RequestError where the photo cannot be used.
  std::shared_ptr<const LoadedPhoto> LoadPhoto(std::size_t index);
  Json CameraOfPhoto(const LoadedPhoto& photo);
  Json Document(const Json& scene, const LoadedPhoto& photo);
  void FollowScene();  // Where the file is another one than at the last time. Under mutex_.
  Status ReadDraft();
  std::shared_ptr<const PhotoRun> Run(const Json& scene,
                                      const std::shared_ptr<const LoadedPhoto>& photo);

  // Two requests for one document wait for the same run.
  struct KeptRun {
    std::shared_ptr<const LoadedPhoto> photo;
    std::string document;
    std::shared_future<std::shared_ptr<const PhotoRun>> run;
  };

  CompareOptions options_;
  SolverSet solvers_;
  PhotoFolder folder_;
  Json given_camera_;        // Null where none is given.
  std::mutex photos_mutex_;  // Held while one is read: one at a time is in the making.
  std::list<std::shared_ptr<const LoadedPhoto>> photos_;  // The last one first.
  std::mutex runs_mutex_;
  std::list<KeptRun> runs_;                                       // The last one first.
  std::mutex mutex_;                                              // Of what follows.
  Json scene_, draft_;                                            // As in their files.
  std::optional<std::filesystem::file_time_type> scene_written_;  // Of the file that was read.
  std::string scene_error_, draft_error_;  // Why the file that is there could not be read.
  std::map<std::size_t, Json> cameras_;
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_STUDIO_STUDIO_H_
