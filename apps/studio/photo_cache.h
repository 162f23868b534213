// Photos that were looked at last, with what is known of their cameras.
#ifndef CIRCLINE_APPS_STUDIO_PHOTO_CACHE_H_
#define CIRCLINE_APPS_STUDIO_PHOTO_CACHE_H_

#include <list>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <string>

#include "apps/studio/photo_folder.h"

namespace circline::apps {

struct LoadedPhoto {
  std::size_t index = 0;
  std::string path;
  cv::Mat pixels;
};

// Many threads may use one.
class PhotoCache {
 public:
  explicit PhotoCache(const PhotoFolder* folder) : folder_(folder) {}
  // Throws RequestError where the photo cannot be used.
  std::shared_ptr<const LoadedPhoto> Get(std::size_t index);

 private:
  const PhotoFolder* folder_;
  std::mutex mutex_;  // Held while one is read: one at a time is in the making.
  std::list<std::shared_ptr<const LoadedPhoto>> photos_;  // The last one first.
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_STUDIO_PHOTO_CACHE_H_
