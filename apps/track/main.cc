// circline_track: the pose of a moving camera, frame after frame.
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/common/flags_util.h"
#include "apps/common/in_parallel.h"
#include "apps/common/output_file.h"
#include "apps/compare/inputs.h"
#include "apps/compare/resume.h"
#include "apps/track/track_options.h"
#include "apps/track/track_report.h"
#include "apps/track/track_run.h"

namespace circline::apps {
namespace {

constexpr char kUsage[] =
    "circline_track: the pose of a camera that moves before circles and parallel lines, or of a\n"
    "thing that moves before it.\n"
    "\n"
    "  circline_track --video=walk.mp4 --camera=calib.yml --output=out --video_out=overlays.mp4\n"
    "  circline_track --images='frames/*.png' --camera=calib.yml --output=out\n"
    "  circline_track --images='frames/*.png' --camera=calib.yml --roi=120,80,60,40 --output=out\n"
    "  circline_track --scene=set/scene.yaml --output=out\n"
    "\n"
    "Frames in order, one world. Features are detected in the first frame and followed in the "
    "next\n"
    "ones; with --roi one circle, and nothing else; those of a scene file are taken as they are.\n"
    "Writes results.jsonl (a line a frame), trajectory.txt (TUM), observations.jsonl, "
    "timings.jsonl,\n"
    "report.html and overlays/*.png. Flags for inputs, detection and losses are those of\n"
    "circline_compare.\n"
    "Exit code 0: every frame gave an answer or a stated refusal; 1: some frame could not be used\n"
    "(named, the rest is done); 2: unusable flags, video or scene file (nothing is written).";

// The images of the flags; a video is one of them, which all of its frames are like.
Status OpenSource(const TrackOptions& options, ImageSet* images,
                  std::unique_ptr<FrameSource>* source) {
  Status status = options.video.empty() ? Status::Ok() : CheckVideoFile(options.video);
  if (status.ok()) status = ImagesFromFlags(options.compare.inputs, images);
  if (!status.ok()) return status;
  for (std::size_t i = 1; i < images->size(); ++i) {
    if (images->At(i).observations.camera.id != images->At(0).observations.camera.id)
      return Status::Invalid("a track has one camera; " + images->name(i) + " has another");
  }
  if (options.video.empty()) {
    *source =
        OpenPhotos(*images, options.fps, options.compare.overlays, options.compare.max_megapixels);
  } else {
    status = OpenVideo(options.video, images->At(0), options.fps, source);
  }
  std::vector<double> times_s;
  if (status.ok() && !options.timestamps.empty()) status = ReadTimes(options.timestamps, &times_s);
  const int num_frames = status.ok() ? (*source)->num_frames() : 0;
  if (status.ok() && !options.timestamps.empty() && static_cast<int>(times_s.size()) < num_frames) {
    return Status::Invalid("--timestamps=" + options.timestamps + ": has " +
                           std::to_string(times_s.size()) + " times for " +
                           std::to_string(num_frames) + " frames");
  }
  if (status.ok()) (*source)->SetTimes(std::move(times_s));
  return status;
}

std::vector<std::string> FilesWritten(const TrackOptions& options) {
  std::vector<std::string> names = {"results.jsonl",  "observations.jsonl", "timings.jsonl",
                                    "trajectory.txt", "report.html",        "overlays/*.png"};
  if (!options.video_out.empty()) names.push_back(options.video_out);
  return names;
}

int TrackFrames() {
  TrackOptions options;
  ImageSet images;
  std::unique_ptr<FrameSource> source;
  Status status = TrackOptionsFromFlags(&options);
  if (status.ok()) status = OpenSource(options, &images, &source);
  if (status.ok()) status = CheckInputsKept(images, options.compare.output, FilesWritten(options));
  if (!status.ok()) return Refuse("circline_track", status);
  if (options.compare.inputs.guess.wanted) SayOnStderr(DescribeGuess(options.compare.inputs.guess));
  UseThreads(options.compare.threads);
  const std::string& output = options.compare.output;
  FolderLock lock;
  status = CreateFolder(options.compare.overlays ? output + "/overlays" : output);
  if (status.ok()) status = lock.Acquire(output);
  if (status.ok()) status = CheckResultFiles(output);
  if (status.ok()) RemoveEarlierRun(output);
  std::vector<TrackedFrame> frames;
  if (status.ok()) status = RunTrack(options, source.get(), &frames);
  if (status.ok()) status = WriteTrackReport(output, frames);
  if (!status.ok()) return Refuse("circline_track", status);
  std::cout << TrackTable(frames) << "report: " << output << "/report.html\n";
  const bool is_whole = std::all_of(frames.begin(), frames.end(),
                                    [](const TrackedFrame& f) { return f.error.empty(); });
  return is_whole && !frames.empty() ? kExitOk : kExitUnreadable;
}

}  // namespace
}  // namespace circline::apps

int main(int argc, char** argv) {
  // A track is made in one go, from its first frame, and by one solver.
  return circline::apps::RunApp(argc, argv, "circline_track", circline::apps::kUsage,
                                circline::apps::TrackFrames,
                                {"merge", "plugin", "resume", "shard", "solvers", "peers",
                                 "export_as", "save_options", "list_solvers"});
}
