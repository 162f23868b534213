#include "apps/compare/image_set.h"

#include <algorithm>
#include <tuple>

#include "apps/common/output_file.h"

namespace circline::apps {
namespace {

bool SameCamera(const Camera& a, const Camera& b) {
  const auto tie = [](const Camera& c) {
    return std::tie(c.id, c.model, c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.distortion);
  };
  return tie(a) == tie(b);
}

bool SameSigma(const StatedCameraSigma& a, const StatedCameraSigma& b) {
  return std::tie(a.log_focal, a.principal_point_px, a.k1) ==
         std::tie(b.log_focal, b.principal_point_px, b.k1);
}

// Nothing but the photo, its camera and perhaps a truth.
bool IsPlain(const SceneImage& image) {
  const FrameObservation& frame = image.observations.frame;
  return image.detect_everything && image.rois.empty() && image.points.empty() &&
         image.solids.empty() && image.observations.known_angles.empty() &&
         image.observations.known_lengths.empty() && frame.plane.empty() && !frame.origin &&
         !frame.x_axis && !frame.y_axis && frame.origin_is_center.empty();
}

}  // namespace

ImageSet::ImageSet(std::vector<SceneImage> images, int shard_index, int num_shards)
    : set_size_(images.size()) {
  std::vector<std::string> paths;
  for (const SceneImage& image : images) paths.push_back(image.path);
  std::vector<std::string> stems = UniqueStems(paths);
  const std::size_t step = static_cast<std::size_t>(num_shards);
  entries_.reserve(images.size() / step + 1);
  for (std::size_t i = static_cast<std::size_t>(shard_index); i < images.size(); i += step) {
    SceneImage& image = images[i];
    Entry entry;
    entry.name = image.name;
    if (image.path != image.name) entry.path = image.path;
    entry.stem = std::move(stems[i]);
    entry.index = i;
    if (IsPlain(image)) {
      entry.like = LikeAny(image);
      if (image.truth) entry.truth = std::make_unique<Truth>(std::move(*image.truth));
    } else {
      entry.annotated = std::make_unique<SceneImage>(std::move(image));
    }
    entries_.push_back(std::move(entry));
  }
}

ImageSet::ImageSet(const std::vector<std::string>& paths, const SceneImage& like, int shard_index,
                   int num_shards)
    : likes_({like}), set_size_(paths.size()) {
  std::vector<std::string> stems = UniqueStems(paths);
  const std::size_t step = static_cast<std::size_t>(num_shards);
  entries_.reserve(paths.size() / step + 1);
  for (std::size_t i = static_cast<std::size_t>(shard_index); i < paths.size(); i += step) {
    Entry entry;
    entry.name = paths[i];
    entry.stem = std::move(stems[i]);
    entry.index = i;
    entries_.push_back(std::move(entry));
  }
}

std::size_t ImageSet::LikeAny(const SceneImage& image) {
  const Camera& camera = image.observations.camera;
  const auto known = std::find_if(likes_.begin(), likes_.end(), [&](const SceneImage& like) {
    return SameCamera(like.observations.camera, camera) &&
           SameSigma(like.camera_sigma, image.camera_sigma);
  });
  const auto place = static_cast<std::size_t>(known - likes_.begin());
  if (known == likes_.end()) {
    SceneImage like;
    like.observations.camera = camera;
    like.camera_sigma = image.camera_sigma;
    like.detect_everything = true;
    likes_.push_back(std::move(like));
  }
  return place;
}

SceneImage ImageSet::At(std::size_t i) const {
  const Entry& entry = entries_[i];
  SceneImage image = entry.annotated != nullptr ? *entry.annotated : likes_[entry.like];
  image.name = entry.name;
  image.path = path(i);
  if (entry.truth != nullptr) image.truth = *entry.truth;
  image.index = entry.index;
  image.set_size = set_size_;
  image.stem = entry.stem;
  return image;
}

}  // namespace circline::apps
