#include "apps/compare/run.h"

#include <glog/logging.h>

#include <algorithm>
#include <opencv2/core/utility.hpp>

#include "apps/common/flags_util.h"
#include "apps/common/output_file.h"
#include "apps/common/progress.h"
#include "apps/compare/image_worker.h"
#include "apps/compare/merge.h"
#include "apps/compare/record_files.h"
#include "apps/compare/resume.h"
#include "apps/compare/work_queue.h"

namespace circline::apps {
namespace {

// The images from done.images on.
Status WorkOn(const ImageSet& images, const ImageWorker& worker, const std::string& folder,
              const DonePart& done) {
  RecordWriter writer(folder, done.bytes);
  Progress progress("images", static_cast<int>(images.size()), static_cast<int>(done.images));
  Status status = writer.Append({});  // Names a file that cannot be written before the work.
  if (!status.ok()) return status;
  const auto work = [&](std::size_t i) { return worker.Work(images.At(done.images + i)); };
  const auto deliver = [&](std::size_t i, const WorkedImage& image) {
    if (!image.read_error.empty()) {
      progress.Clear();
      SayOnStderr(images.path(done.images + i) + ": " + image.read_error);
    }
    status = image.status.ok() ? writer.Append(image.lines) : image.status;
    progress.Advance();
    return status.ok();
  };
  WorkInOrder(images.size() - done.images, work, deliver);
  return status;
}

}  // namespace

Status MergeComparison(const CompareOptions& options, ComparisonResult* result) {
  Status status = MergeFolders(options.merge, options.output);
  if (status.ok()) status = FinishFolder(options.output, options.finish, result);
  return status;
}

Status RunComparison(const ImageSet& images, const CompareOptions& options,
                     ComparisonResult* result) {
  Status status = CreateFolder(options.overlays ? options.output + "/overlays" : options.output);
  if (!status.ok()) return status;
  // More threads than cores gain nothing, and TBB would print that it has none.
  if (options.threads > 0) cv::setNumThreads(std::min(options.threads, cv::getNumberOfCPUs()));
  LOG(INFO) << images.size() << " images, " << cv::getNumThreads() << " threads";
  const ImageWorker worker(options);
  DonePart done;
  status = PrepareFolder(options.output, options.resume, images, worker.solvers().Keys(options),
                         options.result_flags, &done);
  if (status.ok()) status = WorkOn(images, worker, options.output, done);
  if (status.ok()) status = FinishFolder(options.output, options.finish, result);
  if (status.ok()) MarkFinished(options.output);
  return status;
}

}  // namespace circline::apps
