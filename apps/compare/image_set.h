// The photos of a run, of which there may be very many.
#ifndef CIRCLINE_APPS_COMPARE_IMAGE_SET_H_
#define CIRCLINE_APPS_COMPARE_IMAGE_SET_H_

#include <string>
#include <vector>

#include "apps/common/scene.h"

namespace circline::apps {

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

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_IMAGE_SET_H_
