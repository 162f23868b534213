// The frames of a track, one after the other: from a video, or from photos in order.
#ifndef CIRCLINE_APPS_TRACK_FRAME_SOURCE_H_
#define CIRCLINE_APPS_TRACK_FRAME_SOURCE_H_

#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/common/scene.h"
#include "apps/compare/inputs.h"
#include "circline/estimators/status.h"

namespace circline::apps {

struct Frame {
  SceneImage image;  // What is known of it; name and stem are unique in the track.
  std::size_t index = 0;
  double time_s = 0.0;
  cv::Mat photo;
  std::string read_error;  // Not empty: there is no photo, and why.
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;
  // False after the last frame.
  virtual bool Next(Frame* frame) = 0;
  virtual int num_frames() const = 0;  // As far as is known; 0 = not known.
  double fps() const { return fps_; }  // > 0.
  // Of the frames, in order, where they do not follow fps(); what is beyond its end does.
  void SetTimes(std::vector<double> times_s) { times_s_ = std::move(times_s); }

 protected:
  double TimeOf(std::size_t index) const {
    return index < times_s_.size() ? times_s_[index] : static_cast<double>(index) / fps_;
  }
  double fps_ = 25.0;

 private:
  std::vector<double> times_s_;
};

// Not ok: --video names no file.
Status CheckVideoFile(const std::string& path);

// Of such a file. fps 0: that of the video, for photos 25. Not ok: a video that cannot be opened.
Status OpenVideo(const std::string& path, const SceneImage& pattern, double fps,
                 std::unique_ptr<FrameSource>* source);
// `images` outlives the source. Only photos that something is to be found in are read, or all.
std::unique_ptr<FrameSource> OpenPhotos(const ImageSet& images, double fps, bool reads_all,
                                        double max_megapixels);

// Seconds, a number a line; # starts a comment. Not ok: names file and line.
Status ReadTimes(const std::string& path, std::vector<double>* times_s);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_TRACK_FRAME_SOURCE_H_
