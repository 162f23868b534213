// Where the gradient of the smoothed photo is largest across itself, to a fraction of a pixel.
#ifndef CIRCLINE_RANSAC_DETECTION_EDGE_POINTS_H_
#define CIRCLINE_RANSAC_DETECTION_EDGE_POINTS_H_

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "circline/ransac/detection/edges.h"

namespace circline {

// Fills the points, row by row, and the index of `map`, whose size is that of the grey photo; pixel
// i of `pixels` is where point i stands in the index. The outermost pixels hold no points. The
// photo is smoothed by `smoothing_px`; `low` is the weakest gradient that counts, `noise` the
// standard deviation of one component of the gradient, grey levels per pixel. `within` (optional):
// only in these rectangles, which lie in the photo and do not overlap, and there the same points.
void FindEdgePoints(const cv::Mat& gray, double smoothing_px, double low, double noise,
                    EdgeMap* map, std::vector<std::int32_t>* pixels,
                    const std::vector<cv::Rect>* within = nullptr);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_EDGE_POINTS_H_
