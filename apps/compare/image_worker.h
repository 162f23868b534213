// From a photo to its lines in the output files, and its picture.
#ifndef CIRCLINE_APPS_COMPARE_IMAGE_WORKER_H_
#define CIRCLINE_APPS_COMPARE_IMAGE_WORKER_H_

#include <functional>
#include <string>

#include "apps/compare/image_run.h"
#include "apps/compare/record.h"
#include "circline/estimators/status.h"

namespace circline::apps {

struct WorkedImage {
  ImageLines lines;
  std::string read_error;  // Not empty: the photo could not be used.
  Status status;           // Of writing its overlay.
};

// What is left to do with a photo once it is solved: to draw it, and to write its lines. Called
// once, by any thread.
using Finishing = std::function<WorkedImage()>;

// Many threads may use one. The options outlive it.
class ImageWorker {
 public:
  explicit ImageWorker(const CompareOptions& options) : options_(options), solvers_(options) {}
  // Detects and solves. The worker outlives what it returns.
  Finishing Work(SceneImage image) const;
  const SolverSet& solvers() const { return solvers_; }

 private:
  WorkedImage Finish(ImageRun* run) const;

  const CompareOptions& options_;
  SolverSet solvers_;
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_IMAGE_WORKER_H_
