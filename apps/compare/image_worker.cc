#include "apps/compare/image_worker.h"

#include <vector>

#include "apps/common/output_file.h"
#include "apps/compare/overlay.h"
#include "apps/compare/results.h"

namespace circline::apps {

WorkedImage ImageWorker::Work(SceneImage image) const {
  WorkedImage worked;
  const ImageRun run = RunImage(options_, solvers_, &image);
  std::string overlay;
  if (options_.overlays && run.read_error.empty() && !run.photo.empty()) {
    overlay = "overlays/" + image.stem + ".png";
    const std::vector<std::uint8_t> png = EncodePng(DrawOverlay(run));
    worked.status = WriteFile(options_.output + "/" + overlay, std::string(png.begin(), png.end()));
  }
  worked.lines = WriteLines(run, overlay, options_.unusual_flags, options_.fit.noise_model);
  worked.read_error = run.read_error;
  return worked;
}

}  // namespace circline::apps
