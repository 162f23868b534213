// The photos of a run, of which there may be very many.
#ifndef CIRCLINE_APPS_COMPARE_IMAGE_SET_H_
#define CIRCLINE_APPS_COMPARE_IMAGE_SET_H_

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/common/scene.h"

namespace circline::apps {

// Holds of a photo of which nothing is annotated little more than its name.
class ImageSet {
 public:
  ImageSet() = default;
  // Takes every num_shards-th image from shard_index on; index and stem are those in the whole
  // list.
  ImageSet(std::vector<SceneImage> images, int shard_index, int num_shards);
  // Photos of which the same is known, `like`.
  ImageSet(const std::vector<std::string>& paths, const SceneImage& like, int shard_index,
           int num_shards);

  std::size_t size() const { return entries_.size(); }
  SceneImage At(std::size_t i) const;
  const std::string& name(std::size_t i) const { return entries_[i].name; }
  const std::string& path(std::size_t i) const {
    return entries_[i].path.empty() ? entries_[i].name : entries_[i].path;
  }
  // Of the scene file: auto, yes or no; empty where nothing says it.
  const std::string& rigid() const { return rigid_; }
  void set_rigid(const std::string& rigid) { rigid_ = rigid; }
  std::size_t index(std::size_t i) const { return entries_[i].index; }

 private:
  struct Entry {
    std::string name, path, stem;  // The path is empty where it is the name.
    std::size_t index = 0, like = 0;
    std::unique_ptr<Truth> truth;
    std::unique_ptr<SceneImage> annotated;  // Whole, where the scene file says more of the photo.
  };

  std::size_t LikeAny(const SceneImage& image);  // Of likes_, where it comes to stand if need be.

  std::vector<Entry> entries_;
  std::vector<SceneImage> likes_;  // Without a name.
  std::string rigid_;
  std::size_t set_size_ = 0;
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_IMAGE_SET_H_
