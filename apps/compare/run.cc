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

// Of the images that are left, every n-th is this rank's, n being the number of ranks.
class Share {
 public:
  Share(std::size_t done, std::size_t total, const Ranks& ranks)
      : first_(done + static_cast<std::size_t>(ranks.rank())),
        total_(total),
        step_(static_cast<std::size_t>(ranks.count())) {}
  std::size_t size() const { return first_ < total_ ? (total_ - first_ - 1) / step_ + 1 : 0; }
  std::size_t At(std::size_t i) const { return first_ + i * step_; }

 private:
  std::size_t first_, total_, step_;
};

// Writes images in order and says what there is to say of them.
class Output {
 public:
  Output(const ImageSet& images, const std::string& folder, const DonePart& done)
      : images_(images),
        writer_(folder, done.bytes),
        progress_("images", static_cast<int>(images.size()), static_cast<int>(done.images)) {
    status_ = writer_.Append({});  // Names a file that cannot be written before the work.
  }

  bool Write(std::size_t i, const WorkedImage& image) {
    if (!image.read_error.empty()) {
      progress_.Clear();
      SayOnStderr(images_.path(i) + ": " + image.read_error);
    }
    if (status_.ok()) status_ = image.status;
    if (status_.ok()) status_ = writer_.Append(image.lines);
    progress_.Advance();
    return status_.ok();
  }
  const Status& status() const { return status_; }

 private:
  const ImageSet& images_;
  RecordWriter writer_;
  Progress progress_;
  Status status_;
};

// Rank 0: after each image of its own it takes those of the other ranks that follow.
Status WorkAndCollect(const ImageSet& images, const ImageWorker& worker, const std::string& folder,
                      const DonePart& done, const Ranks& ranks) {
  Output output(images, folder, done);
  if (!output.status().ok()) return output.status();
  const Share share(done.images, images.size(), ranks);
  WorkInOrder(
      share.size(), [&](std::size_t i) { return worker.Work(images.At(share.At(i))); },
      [&](std::size_t i, const WorkedImage& image) {
        bool go_on = output.Write(share.At(i), image);
        for (int other = 1; go_on && other < ranks.count(); ++other) {
          const std::size_t theirs = share.At(i) + static_cast<std::size_t>(other);
          if (theirs < images.size()) go_on = output.Write(theirs, ranks.Receive(other));
        }
        return go_on;
      });
  return output.status();
}

void WorkAndSend(const ImageSet& images, const ImageWorker& worker, std::size_t num_done,
                 const Ranks& ranks) {
  const Share share(num_done, images.size(), ranks);
  WorkInOrder(
      share.size(), [&](std::size_t i) { return worker.Work(images.At(share.At(i))); },
      [&](std::size_t, const WorkedImage& image) {
        ranks.SendToFirst(image);
        return true;
      });
}

// Rank 0 alone looks at the folder; it tells the others how many images are done, or to stop.
Status Prepare(const ImageSet& images, const CompareOptions& options, const ImageWorker& worker,
               const Ranks& ranks, FolderLock* lock, DonePart* done) {
  constexpr std::size_t kStop = static_cast<std::size_t>(-1);
  Status status;
  if (ranks.is_first()) {
    status = CheckFinish(options.output, options.finish);
    if (status.ok())
      status = CreateFolder(options.overlays ? options.output + "/overlays" : options.output);
    if (status.ok()) status = lock->Take(options.output);
    if (status.ok()) {
      status = PrepareFolder(options, images, worker.solvers().Keys(options), done);
    }
  }
  done->images = ranks.FromFirst(status.ok() ? done->images : kStop);
  return status.ok() && done->images == kStop ? Status::Invalid("rank 0 cannot begin") : status;
}

}  // namespace

Status MergeComparison(const CompareOptions& options, ComparisonResult* result) {
  Status status = CheckFinish(options.output, options.finish);
  if (status.ok()) status = MergeFolders(options.inputs.merge, options.output);
  if (status.ok()) status = FinishFolder(options.output, options.finish, result);
  return status;
}

Status RunComparison(const ImageSet& images, const CompareOptions& options, const Ranks& ranks,
                     ComparisonResult* result) {
  // More threads than cores gain nothing, and TBB would print that it has none.
  if (options.threads > 0) cv::setNumThreads(std::min(options.threads, cv::getNumberOfCPUs()));
  LOG(INFO) << images.size() << " images, " << cv::getNumThreads() << " threads";
  const ImageWorker worker(options);
  FolderLock lock;
  DonePart done;
  Status status = Prepare(images, options, worker, ranks, &lock, &done);
  if (!status.ok()) return status;
  if (!ranks.is_first()) {
    WorkAndSend(images, worker, done.images, ranks);
    return Status::Ok();
  }
  status = WorkAndCollect(images, worker, options.output, done, ranks);
  if (!status.ok() && ranks.count() > 1) {  // The others wait to be heard.
    SayOnStderr("circline_compare: " + status.message);
    ranks.Abort(kExitUnreadable);
  }
  if (status.ok()) status = FinishFolder(options.output, options.finish, result);
  if (status.ok()) MarkFinished(options.output);
  return status;
}

}  // namespace circline::apps
