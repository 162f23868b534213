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
      const Camera& camera = image.observations.camera;
      const auto known = std::find_if(cameras_.begin(), cameras_.end(), [&](const StatedCamera& c) {
        return SameCamera(c.camera, camera) && SameSigma(c.sigma, image.camera_sigma);
      });
      entry.camera = static_cast<std::size_t>(known - cameras_.begin());
      if (known == cameras_.end()) cameras_.push_back({camera, image.camera_sigma});
      if (image.truth) entry.truth = std::make_unique<Truth>(std::move(*image.truth));
    } else {
      entry.annotated = std::make_unique<SceneImage>(std::move(image));
    }
    entries_.push_back(std::move(entry));
  }
}

SceneImage ImageSet::At(std::size_t i) const {
  const Entry& entry = entries_[i];
  SceneImage image;
  if (entry.annotated != nullptr) {
    image = *entry.annotated;
  } else {
    image.name = entry.name;
    image.path = path(i);
    image.observations.camera = cameras_[entry.camera].camera;
    image.camera_sigma = cameras_[entry.camera].sigma;
    image.detect_everything = true;
    if (entry.truth != nullptr) image.truth = *entry.truth;
  }
  image.index = entry.index;
  image.set_size = set_size_;
  image.stem = entry.stem;
  return image;
}

}  // namespace circline::apps
