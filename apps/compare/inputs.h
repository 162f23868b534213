// Where the photos of a run come from.
#ifndef CIRCLINE_APPS_COMPARE_INPUTS_H_
#define CIRCLINE_APPS_COMPARE_INPUTS_H_

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "apps/common/scene.h"
#include "apps/compare/camera_guess.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// The photos of a run, of which there may be very many.
class ImageSet {
 public:
  ImageSet() = default;
  // Takes every num_shards-th image from shard_index on; index and stem are those in the whole
  // list. `rigid`: of the scene file.
  ImageSet(std::vector<SceneImage> images, int shard_index, int num_shards, std::string rigid = "");
  // Photos of which the same is known, `like`: each takes little more memory than its name.
  ImageSet(const std::vector<std::string>& paths, SceneImage like, int shard_index, int num_shards);

  std::size_t size() const { return entries_.size(); }
  SceneImage At(std::size_t i) const;
  const std::string& name(std::size_t i) const { return entries_[i].name; }
  const std::string& path(std::size_t i) const { return entries_[i].path; }
  std::size_t index(std::size_t i) const { return entries_[i].index; }
  // Of the scene file: auto, yes or no; empty where nothing says it.
  const std::string& rigid() const { return rigid_; }

 private:
  struct Entry {
    std::string name, path, stem;
    std::size_t index = 0;
  };

  std::vector<Entry> entries_;
  std::vector<SceneImage> known_;  // What is known of each, or one for all.
  std::string rigid_;
  std::size_t set_size_ = 0;
};

struct InputOptions {
  CameraGuess guess;
  std::optional<std::array<int, 4>> roi;  // x, y, width, height.
  double circle_radius = 0.0;             // 0 = not given.
  int shard_index = 0, num_shards = 1;
  std::vector<std::string> merge;  // Folders of shards; not empty: there are no photos.
};

// From the flags; not ok: one line that names the flag. Nothing is read from disk.
Status InputsFromFlags(InputOptions* options);

// The images of --scene or --images, those of this shard only. Cameras that are only guessed have
// no focal length yet: that takes the size of the photo. Not ok: one line that names the flag or
// file.
Status ImagesFromFlags(const InputOptions& options, ImageSet* images);

// Not ok: one line that names a photo, or a file of a flag, which the run would write over.
// `written`: as WrittenFiles takes them.
Status CheckInputsKept(const ImageSet& images, const std::string& output,
                       const std::vector<std::string>& written);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_INPUTS_H_
