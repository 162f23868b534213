#include "apps/compare/run.h"

#include <glog/logging.h>

#include <exception>
#include <filesystem>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <utility>
#include <vector>

#include "apps/common/flags_util.h"
#include "apps/common/in_parallel.h"
#include "apps/common/output_file.h"
#include "apps/common/progress.h"
#include "apps/compare/export.h"
#include "apps/compare/image_run.h"
#include "apps/compare/merge.h"
#include "apps/compare/overlay.h"
#include "apps/compare/record_files.h"
#include "apps/compare/report.h"
#include "apps/compare/results.h"
#include "apps/compare/resume.h"
#include "apps/compare/sweep.h"
#include "apps/compare/work_queue.h"

namespace circline::apps {
namespace {

// ---- Before and after the work ----

std::string BestSentence(const Summary& summary) {
  const SummaryRow* best = BestRow(summary);
  if (best == nullptr || LossPoints(summary).size() < 2) return "";
  return "best: " + DescribeRow(*best) + "\n";
}

Status SaveBest(const Summary& summary, const FinishOptions& options) {
  const SummaryRow* best = BestRow(summary);
  if (best == nullptr) {
    return Status::Failed("--save_options: no refined solver has an answer, so none is the best");
  }
  return WriteFile(options.save_options,
                   "# " + DescribeRow(*best) + "\n--robust_loss=" + best->key.loss +
                       "\n--loss_scale_px=" + best->key.ScaleText() + "\n" + options.other_flags);
}

// Before the work: whether what the options say could be written. The folder need not exist yet.
Status CheckFinish(const std::string& folder, const FinishOptions& options) {
  namespace fs = std::filesystem;
  if (options.save_options.empty()) return Status::Ok();
  std::error_code error;
  const fs::path parent = fs::absolute(options.save_options).lexically_normal().parent_path();
  if (parent == (fs::absolute(folder) / "").lexically_normal().parent_path() &&
      !fs::exists(parent, error)) {
    return Status::Ok();  // It is about to be made.
  }
  const Status status = CanWriteFile(options.save_options);
  return status.ok() ? status : Status::Invalid("--save_options: " + status.message);
}

// What is made of results.jsonl, observations.jsonl and timings.jsonl once they are whole:
// summary.csv, report.html, and what else the options say.
Status FinishFolder(const std::string& folder, const FinishOptions& options,
                    ComparisonResult* result) {
  Digest digest;
  Status status = ReadDigest(folder, &digest);
  const Summary& summary = digest.summary;
  if (status.ok()) status = WriteFile(folder + "/summary.csv", summary.Csv());
  if (status.ok()) status = WriteReport(folder, digest);
  std::string notes;
  if (status.ok()) status = WriteExports(folder, options.exports, &notes);
  if (status.ok() && !options.save_options.empty()) status = SaveBest(summary, options);
  result->num_unreadable = summary.num_unreadable();
  result->table = summary.Table() + BestSentence(summary) + notes;
  return status;
}

// ---- The work ----

// The lines of a photo that is solved, and its overlay if that is wanted.
WorkedImage Finish(const CompareOptions& options, ImageRun* run) {
  WorkedImage worked;
  std::string overlay;
  if (options.overlays) worked.status = WriteOverlay(options.output, run, &overlay);
  try {
    worked.lines = WriteLines(*run, overlay, options.unusual_flags, options.fit.noise_model);
  } catch (const std::exception& error) {  // It would end the thread, and the run with it.
    worked.status =
        Status::Failed(run->image->path + ": its results cannot be written: " + error.what());
  }
  worked.read_error = run->read_error;
  return worked;
}

// Detects and solves. Many threads may call it.
Finishing WorkOn(const CompareOptions& options, const SolverSet& solvers, SceneImage image) {
  struct Photo {
    SceneImage image;
    ImageRun run;  // Refers to `image`.
  };
  const auto photo = std::make_shared<Photo>();
  photo->image = std::move(image);
  photo->run = RunImage(options, &solvers, &photo->image);
  return [&options, photo] { return Finish(options, &photo->run); };
}

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

// Rank 0 writes: after each image of its own it takes those of the other ranks that follow.
Status WorkOnShare(const ImageSet& images, const CompareOptions& options, const SolverSet& solvers,
                   const DonePart& done, const Ranks& ranks) {
  // Of the images that are left, every n-th is this rank's, n being the number of ranks.
  std::vector<std::size_t> share;
  for (auto i = done.images + static_cast<std::size_t>(ranks.rank()); i < images.size();
       i += static_cast<std::size_t>(ranks.count()))
    share.push_back(i);
  const auto work = [&](std::size_t i) { return WorkOn(options, solvers, images.At(share[i])); };
  if (!ranks.is_first()) {
    WorkInOrder(share.size(), work, [&](std::size_t, const WorkedImage& image) {
      ranks.SendToFirst(image);
      return true;
    });
    return Status::Ok();
  }
  Output output(images, options.output, done);
  if (!output.status().ok()) return output.status();
  WorkInOrder(share.size(), work, [&](std::size_t i, const WorkedImage& image) {
    bool go_on = output.Write(share[i], image);
    for (int other = 1; go_on && other < ranks.count(); ++other) {
      const std::size_t theirs = share[i] + static_cast<std::size_t>(other);
      if (theirs < images.size()) go_on = output.Write(theirs, ranks.Receive(other));
    }
    return go_on;
  });
  return output.status();
}

// Rank 0 alone looks at the folder; it tells the others how many images are done, or to stop.
Status Prepare(const ImageSet& images, const CompareOptions& options, const SolverSet& solvers,
               const Ranks& ranks, FolderLock* lock, DonePart* done) {
  constexpr std::size_t kStop = static_cast<std::size_t>(-1);
  Status status;
  if (ranks.is_first()) {
    status = CheckFinish(options.output, options.finish);
    if (status.ok())
      status = CreateFolder(options.overlays ? options.output + "/overlays" : options.output);
    if (status.ok()) status = lock->Acquire(options.output);
    if (status.ok()) status = PrepareFolder(options, images, solvers.Keys(options), done);
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
  UseThreads(options.threads);
  LOG(INFO) << images.size() << " images, " << cv::getNumThreads() << " threads";
  const SolverSet solvers(options);
  FolderLock lock;
  DonePart done;
  Status status = Prepare(images, options, solvers, ranks, &lock, &done);
  if (!status.ok()) return status;
  status = WorkOnShare(images, options, solvers, done, ranks);
  if (!ranks.is_first()) return status;
  if (!status.ok() && ranks.count() > 1) {  // The others wait to be heard.
    SayOnStderr("circline_compare: " + status.message);
    ranks.Abort(kExitUnreadable);
  }
  if (status.ok()) MarkFinished(options.output);
  if (status.ok()) status = FinishFolder(options.output, options.finish, result);
  return status;
}

}  // namespace circline::apps
