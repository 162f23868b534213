#include "apps/compare/image_set.h"

#include <utility>

#include "apps/common/output_file.h"

namespace circline::apps {

ImageSet::ImageSet(std::vector<SceneImage> images, int shard_index, int num_shards,
                   std::string rigid)
    : rigid_(std::move(rigid)), set_size_(images.size()) {
  std::vector<std::string> paths;
  for (const SceneImage& image : images) paths.push_back(image.path);
  const std::vector<std::string> stems = UniqueStems(paths);
  const auto step = static_cast<std::size_t>(num_shards);
  for (auto i = static_cast<std::size_t>(shard_index); i < images.size(); i += step) {
    entries_.push_back({images[i].name, images[i].path, stems[i], i});
    known_.push_back(std::move(images[i]));
  }
}

ImageSet::ImageSet(const std::vector<std::string>& paths, SceneImage like, int shard_index,
                   int num_shards)
    : known_({std::move(like)}), set_size_(paths.size()) {
  const std::vector<std::string> stems = UniqueStems(paths);
  const auto step = static_cast<std::size_t>(num_shards);
  for (auto i = static_cast<std::size_t>(shard_index); i < paths.size(); i += step)
    entries_.push_back({paths[i], paths[i], stems[i], i});
}

SceneImage ImageSet::At(std::size_t i) const {
  SceneImage image = known_.size() == 1 ? known_.front() : known_[i];
  image.name = entries_[i].name;
  image.path = entries_[i].path;
  image.stem = entries_[i].stem;
  image.index = entries_[i].index;
  image.set_size = set_size_;
  return image;
}

}  // namespace circline::apps
