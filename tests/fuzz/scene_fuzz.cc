// Readers of files: scenes (YAML, JSON, XML) and COLMAP's cameras.
#include <string>
#include <vector>

#include "apps/common/colmap_file.h"
#include "apps/common/scene.h"
#include "tests/fuzz/fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace circline;
  const std::string text(reinterpret_cast<const char*>(data), size);
  std::vector<apps::SceneImage> images;
  const Status read = apps::ParseScene("scene", text, "", {}, &images);
  fuzz::Expect(read.ok() == !images.empty(), "a scene has images, or is refused");
  fuzz::Expect(read.ok() || !read.message.empty(), "what is refused says why");
  for (const apps::SceneImage& image : images) {
    const Status camera = image.observations.camera.Validate();
    fuzz::Expect(camera.ok(), "the camera of a scene is valid");
  }
  std::vector<Camera> cameras;
  const Status parsed = apps::ParseColmapCameras("cameras.txt", text, &cameras);
  fuzz::Expect(parsed.ok() || !parsed.message.empty(), "what is refused says why");
  return 0;
}
