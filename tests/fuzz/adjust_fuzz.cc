// AdjustPhotos over up to four photos of any evidence.
#include <cmath>
#include <vector>

#include "circline/refine/adjust_photos.h"
#include "tests/fuzz/fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace circline;
  fuzz::Bytes bytes(data, size);
  std::vector<Observations> photos;
  const int count = bytes.Below(5);
  for (int i = 0; i < count; ++i) {
    photos.push_back(fuzz::ArbitraryObservations(&bytes));
    if (!bytes.OneIn(8)) photos.back().camera = photos.front().camera;
  }
  const AdjustedPhotos adjusted = AdjustPhotos(photos);
  if (!adjusted.status.ok()) {
    fuzz::Expect(!adjusted.status.message.empty(), "what is refused says why");
    return 0;
  }
  fuzz::Expect(adjusted.photos.size() == photos.size(), "each photo has its answer");
  for (const AdjustedCamera& made : adjusted.cameras) {
    fuzz::Expect(made.camera.Validate().ok(), "a camera is valid");
    for (int i = 0; i < 5; ++i) fuzz::Expect(std::isfinite(made.Sigma(i)), "a sigma is finite");
  }
  for (const AdjustedPhoto& photo : adjusted.photos) {
    if (!photo.status.ok()) continue;
    fuzz::Expect(
        photo.cam_from_world.rotation.allFinite() && photo.cam_from_world.translation.allFinite(),
        "a pose is finite");
  }
  return 0;
}
