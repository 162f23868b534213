// Where edges are looked for about predicted features: tiles of the photo. Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_SEARCH_BANDS_H_
#define CIRCLINE_RANSAC_DETECTION_SEARCH_BANDS_H_

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "circline/estimators/observations.h"

namespace circline {

class SearchBands {
 public:
  // All that lies within `reach_px` of what is added.
  SearchBands(const cv::Size& photo, double reach_px);

  // What is not on the photo, or not finite, adds nothing.
  void Add(const Eigen::Vector2d& pixel);
  void AddSegment(const Segment& segment);

  // Rectangles of tiles, which do not overlap.
  std::vector<cv::Rect> Rectangles() const;

 private:
  cv::Size photo_;
  double reach_px_;
  int columns_, rows_;
  std::vector<std::uint8_t> marked_;
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_SEARCH_BANDS_H_
