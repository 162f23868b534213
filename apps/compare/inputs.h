// Where the photos of a run come from.
#ifndef CIRCLINE_APPS_COMPARE_INPUTS_H_
#define CIRCLINE_APPS_COMPARE_INPUTS_H_

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "apps/compare/image_set.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// What stands in for a calibration: a pinhole camera that looks through the middle of the photo.
struct CameraGuess {
  double fov_deg = 0.0;   // Field of view along the longer side of the photo; 0 = not given.
  double focal_px = 0.0;  // 0 = not given.

  bool given() const { return fov_deg > 0.0 || focal_px > 0.0; }
  Camera ForPhoto(int width, int height) const;
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

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_INPUTS_H_
