#include "apps/compare/image_worker.h"

#include <exception>
#include <memory>
#include <utility>

#include "apps/common/output_file.h"
#include "apps/compare/encode.h"
#include "apps/compare/overlay.h"
#include "apps/compare/results.h"

namespace circline::apps {
namespace {

Status WriteOverlay(const ImageRun& run, const std::string& path) {
  try {
    const std::vector<std::uint8_t> png = EncodePng(DrawOverlay(run));
    return WriteFile(path, std::string(png.begin(), png.end()));
  } catch (const std::exception& error) {  // Such as a picture too large for the memory.
    return Status::Failed(path + " cannot be drawn: " + error.what());
  }
}

}  // namespace

Finishing ImageWorker::Work(SceneImage image) const {
  struct Photo {
    SceneImage image;
    ImageRun run;  // Refers to `image`.
  };
  const auto photo = std::make_shared<Photo>();
  photo->image = std::move(image);
  photo->run = RunImage(options_, solvers_, &photo->image);
  return [this, photo] { return Finish(&photo->run); };
}

WorkedImage ImageWorker::Finish(ImageRun* run) const {
  WorkedImage worked;
  std::string overlay;
  if (options_.overlays && run->read_error.empty() && !run->photo.empty()) {
    overlay = "overlays/" + run->image->stem + ".png";
    const Stopwatch watch;
    worked.status = WriteOverlay(*run, options_.output + "/" + overlay);
    run->stages.emplace_back("overlay", watch.Microseconds());
  }
  try {
    worked.lines = WriteLines(*run, overlay, options_.unusual_flags, options_.fit.noise_model);
  } catch (const std::exception& error) {  // It would end the thread, and the run with it.
    worked.status =
        Status::Failed(run->image->path + ": its results cannot be written: " + error.what());
  }
  worked.read_error = run->read_error;
  return worked;
}

}  // namespace circline::apps
