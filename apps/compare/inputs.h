// Where the photos of a run come from.
#ifndef CIRCLINE_APPS_COMPARE_INPUTS_H_
#define CIRCLINE_APPS_COMPARE_INPUTS_H_

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "apps/compare/camera_guess.h"
#include "apps/compare/image_set.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/status.h"

namespace circline::apps {

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
