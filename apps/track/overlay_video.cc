#include "apps/track/overlay_video.h"

#include <cmath>
#include <filesystem>
#include <opencv2/imgproc.hpp>

namespace circline::apps {
namespace {

bool IsAvi(const std::string& path) { return std::filesystem::path(path).extension() == ".avi"; }

}  // namespace

OverlayVideo::OverlayVideo(const std::string& folder, const std::string& name, double fps)
    : path_(folder + "/" + name), temporary_path_(folder + "/part." + name), fps_(fps) {}

OverlayVideo::~OverlayVideo() {
  if (committed_) return;
  writer_.release();
  std::error_code ignored;
  std::filesystem::remove(temporary_path_, ignored);
}

Status OverlayVideo::Add(const cv::Mat& picture) {
  try {
    if (!writer_.isOpened()) {
      // Encoders take even sizes only.
      size_ = cv::Size(picture.cols & ~1, picture.rows & ~1);
      const int codec = IsAvi(path_) ? cv::VideoWriter::fourcc('M', 'J', 'P', 'G')
                                     : cv::VideoWriter::fourcc('m', 'p', '4', 'v');
      // Not whatever OpenCV has: GStreamer waits for ever where memory runs out.
      backend_ = cv::CAP_FFMPEG;
      if (!writer_.open(temporary_path_, backend_, codec, fps_, size_) && IsAvi(path_)) {
        backend_ = cv::CAP_OPENCV_MJPEG;
        writer_.open(temporary_path_, backend_, codec, fps_, size_);
      }
      if (!writer_.isOpened())
        return Status::Failed(path_ + " cannot be written: OpenCV has no encoder for it here");
    }
    cv::Mat frame = picture;
    if (frame.size() != size_) cv::resize(picture, frame, size_, 0.0, 0.0, cv::INTER_AREA);
    writer_.write(frame);
    ++num_frames_;
  } catch (const std::exception& error) {
    return Status::Failed(path_ + " cannot be written: " + error.what());
  }
  return Status::Ok();
}

// Encoders do not say that a disk is full: the file then lacks frames or its end, and there is no
// room left.
bool OverlayVideo::IsWhole() const {
  std::error_code error;
  const std::filesystem::space_info space = std::filesystem::space(temporary_path_, error);
  cv::VideoCapture video(temporary_path_, backend_);
  // Some files say how long they are, not how many frames they have.
  constexpr double kRounding = 1.0;
  return !error && space.available > 0 && video.isOpened() &&
         std::abs(video.get(cv::CAP_PROP_FRAME_COUNT) - num_frames_) <= kRounding;
}

Status OverlayVideo::Commit() {
  if (!writer_.isOpened()) return Status::Ok();
  writer_.release();
  if (!IsWhole()) return Status::Failed(path_ + ": cannot be written");
  std::error_code error;
  std::filesystem::rename(temporary_path_, path_, error);
  committed_ = !error;
  return error ? Status::Failed(path_ + ": " + error.message()) : Status::Ok();
}

}  // namespace circline::apps
