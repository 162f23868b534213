// How much a frame says that the one before has not said. Internal: not installed.
#ifndef CIRCLINE_REFINE_FRAME_NEWS_H_
#define CIRCLINE_REFINE_FRAME_NEWS_H_

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/observations.h"
#include "circline/refine/scratch.h"

namespace circline {

// The errors that points of a contour or line share (NoiseModel) stay where the image stays: a
// camera at rest takes one photo, however often. Over frames in which a feature moves by d pixels
// across itself they are autoregressive, of coefficient r = exp(-d^2 / 2): n frames are worth n (1
// - r) / (1 + r). What else errs is new in every frame.
class FrameNews {
 public:
  // Of the next frame, fitted and with its noise: from 0, nothing, to 1, as much as a photo by
  // itself. The mean over its circles and lines; what the frame before does not have is all new.
  // Allocates nothing where there are no more features and points than before.
  double Next(const Observations& fitted, const NoiseModel& noise);

 private:
  struct Shape {
    std::string id;  // Of the circle, of the line's pencil.
    bool is_circle = false;
    Eigen::Matrix3d conic;
    Eigen::Vector3d line;

    double Distance2(const CalibratedPoint& p) const;  // Squared, pixels.
  };
  // What the shape that came last, of these points, says. `weight`: how much of its variance is new
  // in every frame (NoiseModel).
  double OfLast(double weight, const Camera& camera, const std::vector<Eigen::Vector2d>& points,
                const std::vector<std::uint8_t>& inliers);

  Kept<Shape> before_, now_;
  std::vector<CalibratedPoint> points_;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_FRAME_NEWS_H_
