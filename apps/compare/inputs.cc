#include "apps/compare/inputs.h"

#include <gflags/gflags.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/common/camera_file.h"
#include "apps/common/output_file.h"
#include "apps/common/photo_list.h"
#include "apps/common/text.h"
#include "apps/common/written_files.h"

DEFINE_string(scene, "", "Scene file (YAML or JSON): photos and what is known of them.");
DEFINE_string(
    images, "",
    "Instead of --scene: photos to detect everything in; files, folders and quoted wildcards, "
    "separated by commas. Without --camera the camera is guessed, and what the photo shows "
    "counts.");
DEFINE_string(
    camera, "",
    "Camera: an OpenCV calibration file (camera_matrix, distortion_coefficients, image_width, "
    "image_height) or a COLMAP cameras.txt; of --images, or of a scene file without cameras.");
DEFINE_string(roi, "",
              "With --images: x,y,width,height, pixels; detect one circle inside it and nothing "
              "else.");
DEFINE_double(circle_radius, 0.0,
              "With --images: radius of the circle in --roi, or of the one that is largest in the "
              "photo; makes translations metric.");
DEFINE_string(
    shard, "0/1",
    "i/n: only every n-th image, from the i-th on. i counts from 0 or from 1 (n/n is 0/n).");
DEFINE_string(merge, "",
              "Instead of --scene or --images: folders of all the shards of a set, separated by "
              "commas, to be joined in --output.");

namespace circline::apps {
namespace {

Status CheckSources(const CameraGuess& guess) {
  const std::vector<std::string> given = {FLAGS_scene, FLAGS_images, FLAGS_merge};
  const auto missing = std::count(given.begin(), given.end(), "");
  if (missing == 3) {
    return Status::Invalid("give --scene or --images (--help says more)");
  }
  if (missing < 2) return Status::Invalid("give --scene, --images or --merge, not both");
  if (!FLAGS_images.empty()) return Status::Ok();
  const bool for_images = guess.IsGiven() || !FLAGS_roi.empty() || FLAGS_circle_radius != 0.0;
  return for_images ? Status::Invalid(
                          "--focal_px, --fov_deg, --roi and --circle_radius go with "
                          "--images; a scene file says these things itself")
                    : Status::Ok();
}

Status ReadGuess(CameraGuess* guess) {
  const Status status = CameraGuessFromFlags(guess);
  guess->wanted = !FLAGS_images.empty() && FLAGS_camera.empty();
  const int given = (FLAGS_camera.empty() ? 0 : 1) + (guess->focal_px > 0.0 ? 1 : 0) +
                    (guess->fov_deg > 0.0 ? 1 : 0);
  return status.ok() && given > 1 ? Status::Invalid("give one of --camera, --focal_px, --fov_deg")
                                  : status;
}

Status ReadRoi(std::optional<std::array<int, 4>>* roi) {
  if (FLAGS_roi.empty()) return Status::Ok();
  const std::vector<std::string> parts = SplitList(FLAGS_roi);
  std::array<int, 4>& numbers = roi->emplace();
  bool good = parts.size() == 4;
  for (std::size_t i = 0; good && i < 4; ++i) good = ParseInt(parts[i], &numbers[i]);
  if (good && numbers[2] > 0 && numbers[3] > 0) return Status::Ok();
  return Status::Invalid("--roi=" + FLAGS_roi +
                         ": must be x,y,width,height, whole pixels, the last two positive");
}

Status ReadShard(int* index, int* count) {
  const std::vector<std::string> parts = SplitList(FLAGS_shard, '/');
  const bool numbers = parts.size() == 2 && ParseInt(parts[0], index) && ParseInt(parts[1], count);
  if (!numbers || *count < 1 || *index < 0 || *index > *count) {
    return Status::Invalid("--shard=" + FLAGS_shard +
                           ": must be i/n with n at least 1 and i from 0 to n");
  }
  *index %= *count;
  return Status::Ok();
}

Status OneCamera(const std::vector<Camera>& cameras, Camera* camera) {
  if (cameras.size() != 1) {
    return Status::Invalid("--camera=" + FLAGS_camera + ": has " + std::to_string(cameras.size()) +
                           " cameras; --images takes one (a scene file can name several)");
  }
  *camera = cameras.front();
  return Status::Ok();
}

Status ReadScenes(const InputOptions& options, const std::vector<Camera>& cameras,
                  ImageSet* images) {
  std::vector<SceneImage> all;
  std::string rigid;
  const Status status = ReadScene(FLAGS_scene, cameras, &all, &rigid);
  if (status.ok())
    *images = ImageSet(std::move(all), options.shard_index, options.num_shards, rigid);
  return status;
}

// Photos in which everything is to be detected, or one circle.
Status ListImages(const InputOptions& options, const std::vector<Camera>& cameras,
                  ImageSet* images) {
  SceneImage like;
  like.detect_everything = !options.roi;
  Status status;
  if (!options.guess.wanted) status = OneCamera(cameras, &like.observations.camera);
  if (options.roi) {
    CircleObservation circle;
    circle.id = "circle";
    circle.radius = options.circle_radius;
    like.observations.circles = {circle};
    like.rois = {{0, *options.roi}};
  }
  std::vector<std::string> paths;
  if (status.ok()) status = ListPhotos(FLAGS_images, &paths);
  if (status.ok()) *images = ImageSet(paths, like, options.shard_index, options.num_shards);
  return status;
}

}  // namespace

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

Status InputsFromFlags(InputOptions* options) {
  Status status = ReadShard(&options->shard_index, &options->num_shards);
  if (status.ok()) status = ReadGuess(&options->guess);
  if (status.ok()) status = CheckSources(options->guess);
  if (status.ok()) status = ReadRoi(&options->roi);
  options->circle_radius = FLAGS_circle_radius;
  if (status.ok() && !(FLAGS_circle_radius >= 0.0 && std::isfinite(FLAGS_circle_radius))) {
    status = Status::Invalid("--circle_radius must be positive");
  }
  if (!FLAGS_merge.empty()) options->merge = SplitList(FLAGS_merge);
  return status;
}

Status ImagesFromFlags(const InputOptions& options, ImageSet* images) {
  std::vector<Camera> cameras;
  const Status status =
      FLAGS_camera.empty() ? Status::Ok() : ReadCameraFile(FLAGS_camera, &cameras);
  if (!status.ok()) return status;
  return FLAGS_scene.empty() ? ListImages(options, cameras, images)
                             : ReadScenes(options, cameras, images);
}

Status CheckInputsKept(const ImageSet& images, const std::string& output,
                       const std::vector<std::string>& written) {
  WrittenFiles files(output, written);
  Status status = files.CheckKept(FilesOfFlags());
  for (std::size_t i = 0; status.ok() && i < images.size(); ++i)
    status = files.CheckKept({images.path(i)});
  return status;
}

}  // namespace circline::apps
