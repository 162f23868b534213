// The overlays of a track as a video.
#ifndef CIRCLINE_APPS_TRACK_OVERLAY_VIDEO_H_
#define CIRCLINE_APPS_TRACK_OVERLAY_VIDEO_H_

#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <string>

#include "circline/estimators/status.h"

namespace circline::apps {

// MPEG-4 in .mp4, motion JPEG in .avi. Written under another name until it is whole.
class OverlayVideo {
 public:
  OverlayVideo(const std::string& folder, const std::string& name, double fps);
  ~OverlayVideo();
  OverlayVideo(const OverlayVideo&) = delete;
  OverlayVideo& operator=(const OverlayVideo&) = delete;

  // The first picture sets the size; others are scaled to it. Not ok: it cannot be written.
  Status Add(const cv::Mat& picture);
  // Gives the video its own name. Nothing where no picture came.
  Status Commit();

 private:
  bool IsWhole() const;

  std::string path_, temporary_path_;
  double fps_;
  cv::Size size_;
  cv::VideoWriter writer_;
  int backend_ = cv::CAP_FFMPEG;  // Of OpenCV, that writes and reads it.
  int num_frames_ = 0;
  bool committed_ = false;
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_TRACK_OVERLAY_VIDEO_H_
