#include "apps/track/frame_source.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <opencv2/videoio.hpp>
#include <utility>

#include "apps/common/photo_file.h"
#include "apps/common/storage_node.h"
#include "apps/common/text.h"

namespace circline::apps {
namespace {

constexpr double kPhotosPerSecond = 25.0;

class VideoSource : public FrameSource {
 public:
  VideoSource(const cv::VideoCapture& capture, SceneImage pattern, double fps)
      : capture_(capture), pattern_(std::move(pattern)) {
    const double stated = capture_.get(cv::CAP_PROP_FPS);
    fps_ = fps > 0.0 ? fps : stated > 0.0 && std::isfinite(stated) ? stated : kPhotosPerSecond;
    const double count = capture_.get(cv::CAP_PROP_FRAME_COUNT);
    num_frames_ = count > 0.0 && count < 1e9 ? static_cast<int>(count) : 0;
  }

  bool Next(Frame* frame) override {
    *frame = Frame();
    frame->index = next_++;
    frame->time_s = TimeOf(frame->index);
    frame->image = pattern_;
    frame->image.index = frame->index;
    frame->image.set_size = static_cast<std::size_t>(num_frames_);
    std::array<char, 32> number{};
    std::snprintf(number.data(), number.size(), "%06zu", frame->index);
    frame->image.stem = pattern_.stem + "_" + number.data();
    frame->image.name = pattern_.name + "#" + number.data();
    try {
      if (!capture_.grab()) return false;
      if (!capture_.retrieve(frame->photo) || frame->photo.empty())
        frame->read_error = "the frame cannot be decoded";
    } catch (const std::exception& error) {
      frame->read_error = std::string("the video ends here: ") + error.what();
      capture_.release();  // It may throw for ever.
    }
    return true;
  }
  int num_frames() const override { return num_frames_; }

 private:
  cv::VideoCapture capture_;
  SceneImage pattern_;
  std::size_t next_ = 0;
  int num_frames_ = 0;
};

class PhotoSource : public FrameSource {
 public:
  PhotoSource(const ImageSet& images, double fps, bool reads_all, double max_megapixels)
      : images_(images), reads_all_(reads_all), max_megapixels_(max_megapixels) {
    fps_ = fps > 0.0 ? fps : kPhotosPerSecond;
  }
  bool Next(Frame* frame) override {
    if (next_ >= images_.size()) return false;
    *frame = Frame();
    frame->index = next_++;
    frame->time_s = TimeOf(frame->index);
    frame->image = images_.At(frame->index);
    if (reads_all_ || frame->image.detect_everything || !frame->image.rois.empty())
      frame->read_error = ReadPhoto(frame->image.path, &frame->photo, max_megapixels_);
    return true;
  }
  int num_frames() const override { return static_cast<int>(images_.size()); }

 private:
  const ImageSet& images_;
  const bool reads_all_;
  const double max_megapixels_;
  std::size_t next_ = 0;
};

}  // namespace

Status CheckVideoFile(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error))
    return Status::Invalid("--video=" + path + ": the file does not exist");
  return std::filesystem::is_directory(path, error)
             ? Status::Invalid("--video=" + path + ": is a folder, not a video")
             : Status::Ok();
}

Status OpenVideo(const std::string& path, const SceneImage& pattern, double fps,
                 std::unique_ptr<FrameSource>* source) {
  cv::VideoCapture capture;
  bool is_open = false;
  try {
    // FFmpeg alone: other back ends would look for cameras.
    is_open = capture.open(path, cv::CAP_FFMPEG) && capture.isOpened();
  } catch (const std::exception&) {  // Not a video, as far as FFmpeg knows any.
  }
  if (!is_open) return Status::Invalid("--video=" + path + ": is not a video that can be read");
  *source = std::make_unique<VideoSource>(capture, pattern, fps);
  return Status::Ok();
}

std::unique_ptr<FrameSource> OpenPhotos(const ImageSet& images, double fps, bool reads_all,
                                        double max_megapixels) {
  return std::make_unique<PhotoSource>(images, fps, reads_all, max_megapixels);
}

Status ReadTimes(const std::string& path, std::vector<double>* times_s) {
  std::string text;
  const Status status = ReadTextFile(path, &text);
  if (!status.ok()) return Status::Invalid("--timestamps: " + status.message);
  int number = 0;
  for (const std::string& line : SplitList(text, '\n')) {
    ++number;
    if (line.empty() || line[0] == '#') continue;
    double time = 0.0;
    if (!ParseDouble(line, &time)) {
      return Status::Invalid("--timestamps=" + path + ": line " + std::to_string(number) +
                             " is no number");
    }
    times_s->push_back(time);
  }
  return Status::Ok();
}

}  // namespace circline::apps
