#include "apps/studio/photo_cache.h"

#include <algorithm>

#include "apps/common/photo_file.h"
#include "apps/studio/scene_document.h"

namespace circline::apps {

std::shared_ptr<const LoadedPhoto> PhotoCache::Get(std::size_t index) {
  constexpr std::size_t kKept = 3;
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto known = std::find_if(photos_.begin(), photos_.end(),
                                  [&](const auto& photo) { return photo->index == index; });
  if (known != photos_.end()) {
    photos_.splice(photos_.begin(), photos_, known);
    return photos_.front();
  }
  auto photo = std::make_shared<LoadedPhoto>();
  photo->index = index;
  const Status found = folder_->PhotoPath(index, &photo->path);
  if (!found.ok()) throw RequestError(403, found.message);
  const std::string error = ReadPhoto(photo->path, &photo->pixels);
  if (!error.empty()) throw RequestError(422, folder_->name(index) + ": " + error);
  photos_.push_front(photo);
  if (photos_.size() > kKept) photos_.pop_back();
  return photo;
}

}  // namespace circline::apps
