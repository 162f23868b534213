#include "apps/compare/run.h"

#include <glog/logging.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <opencv2/core/utility.hpp>

#include "apps/common/flags_util.h"
#include "apps/common/output_file.h"
#include "apps/common/progress.h"
#include "apps/compare/image_run.h"
#include "apps/compare/overlay.h"
#include "apps/compare/report.h"
#include "apps/compare/results.h"
#include "apps/compare/summary.h"

namespace circline::apps {
namespace {

constexpr int kReportPictureWidth = 900;
constexpr std::size_t kMaxReportPictures = 200;  // So that a browser can still open the report.

// What is kept of an image once it is done.
struct ImageOutput {
  ImageRun run;  // Without the photo.
  std::string results, observations, timings, section;
  Status status;  // Of writing its overlay.
};

// Receives images in any order, writes them in theirs.
class Collector {
 public:
  Collector(const std::string& folder, std::size_t num_images)
      : results_(folder + "/results.jsonl"),
        observations_(folder + "/observations.jsonl"),
        timings_(folder + "/timings.jsonl"),
        folder_(folder),
        progress_("images", static_cast<int>(num_images)) {}

  void Put(std::size_t index, ImageOutput output) {
    const std::lock_guard<std::mutex> lock(mutex_);
    waiting_.emplace(index, std::move(output));
    while (!waiting_.empty() && waiting_.begin()->first == next_) {
      Write(waiting_.begin()->second);
      waiting_.erase(waiting_.begin());
      ++next_;
    }
    progress_.Advance();
  }

  Status Finish() {
    Status status = status_;
    if (status.ok()) status = results_.Commit();
    if (status.ok()) status = observations_.Commit();
    if (status.ok()) status = timings_.Commit();
    if (status.ok()) status = WriteFile(folder_ + "/summary.csv", summary_.Csv());
    if (status.ok())
      status = WriteFile(folder_ + "/report.html", RenderReport(summary_, sections_));
    return status;
  }

  const Summary& summary() const { return summary_; }

 private:
  void Write(const ImageOutput& output) {
    if (status_.ok()) status_ = output.status;
    if (!output.run.read_error.empty()) {
      progress_.Clear();
      SayOnStderr(output.run.image->path + ": " + output.run.read_error);
    }
    results_.Write(output.results);
    observations_.Write(output.observations);
    timings_.Write(output.timings);
    sections_.push_back(output.section);
    summary_.Add(output.run);
  }

  std::mutex mutex_;
  std::map<std::size_t, ImageOutput> waiting_;
  std::size_t next_ = 0;
  OutputFile results_, observations_, timings_;
  std::string folder_;
  Progress progress_;
  Summary summary_;
  std::vector<std::string> sections_;
  Status status_;
};

class Worker {
 public:
  Worker(const std::vector<SceneImage>& images, const CompareOptions& options)
      : images_(images), options_(options), solvers_(options) {
    std::vector<std::string> paths;
    for (const SceneImage& image : images) paths.push_back(image.path);
    stems_ = UniqueStems(paths);
  }

  ImageOutput Work(std::size_t index) const {
    ImageOutput output;
    output.run = RunImage(images_[index], options_, solvers_);
    ImageRun& run = output.run;
    output.results = ResultLines(run);
    output.observations = ObservationLine(run);
    output.timings = TimingLines(run);
    std::vector<std::uint8_t> picture;
    std::string overlay_file;
    if (options_.overlays && run.read_error.empty() && !run.photo.empty()) {
      overlay_file = "overlays/" + stems_[index] + ".png";
      const cv::Mat overlay = DrawOverlay(run);
      const std::vector<std::uint8_t> png = EncodePng(overlay);
      output.status =
          WriteFile(options_.output + "/" + overlay_file, std::string(png.begin(), png.end()));
      if (index < kMaxReportPictures) picture = EncodeJpeg(overlay, kReportPictureWidth);
    }
    output.section = ReportSection(run, picture, overlay_file);
    run.photo.release();
    run.observations = {};
    return output;
  }

 private:
  const std::vector<SceneImage>& images_;
  const CompareOptions& options_;
  SolverSet solvers_;
  std::vector<std::string> stems_;
};

// Each worker takes the next image, so that they stay close together and little waits for its turn.
void WorkOnAll(const Worker& worker, std::size_t num_images, Collector* collector) {
  const int num_workers = static_cast<int>(
      std::min<std::size_t>(static_cast<std::size_t>(cv::getNumThreads()), num_images));
  std::atomic<std::size_t> next{0};
  cv::parallel_for_(
      cv::Range(0, num_workers),
      [&](const cv::Range& range) {
        for (int i = range.start; i < range.end; ++i) {
          for (std::size_t index = next++; index < num_images; index = next++) {
            collector->Put(index, worker.Work(index));
          }
        }
      },
      num_workers);
}

}  // namespace

Status RunComparison(const std::vector<SceneImage>& images, const CompareOptions& options,
                     ComparisonResult* result) {
  Status status = CreateFolder(options.overlays ? options.output + "/overlays" : options.output);
  if (!status.ok()) return status;
  if (options.threads > 0) cv::setNumThreads(options.threads);
  LOG(INFO) << images.size() << " images, " << cv::getNumThreads() << " threads";
  Collector collector(options.output, images.size());
  const Worker worker(images, options);
  if (!images.empty()) WorkOnAll(worker, images.size(), &collector);
  status = collector.Finish();
  result->num_unreadable = collector.summary().num_unreadable();
  result->table = collector.summary().Table();
  return status;
}

}  // namespace circline::apps
