// Sub-pixel edge points with their gradient direction, linked into chains.
//
// An edge is where the gradient of the slightly smoothed photo is largest across itself. Points are
// located along the image axis that is nearer to the gradient: the three samples used there lie on
// the pixel grid, so nothing is interpolated, and across a blurred step the gradient is a Gaussian,
// whose logarithm is a parabola: its vertex is the crossing of the edge with that row or column,
// without the bias of a parabola through the gradient itself. (Interpolation along one axis:
// Devernay, "A non-maxima suppression method for edge detection with sub-pixel accuracy", INRIA
// RR-2724, 1995.)
#ifndef CIRCLINE_RANSAC_DETECTION_EDGES_H_
#define CIRCLINE_RANSAC_DETECTION_EDGES_H_

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "circline/estimators/status.h"

namespace circline {

// Standard deviation of the smoothing, pixels.
constexpr double kEdgeSmoothingPx = 1.0;

struct EdgePoint {
  float x = 0.0f, y = 0.0f;    // Pixels of the photo.
  float nx = 0.0f, ny = 0.0f;  // Unit gradient: across the edge, towards the brighter side.
  float gradient = 0.0f;       // Its length, grey levels per pixel.
  float sigma_px = 0.0f;       // Standard deviation across the edge, from the noise alone.
  float blur_px = 0.0f;        // That of the gradient's profile across the edge.

  Eigen::Vector2d Position() const { return {x, y}; }
  Eigen::Vector2d Normal() const { return {nx, ny}; }
};

// points[begin] .. points[end - 1] of the map, neighbours along one edge, about one pixel apart.
// The brighter side is on the left of the walk as one sees it on the photo (y down).
struct EdgeChain {
  int begin = 0, end = 0;

  int size() const { return end - begin; }
};

// Where a contour borders on what is brighter: a disc on a plain ground has one side all around,
// one before a busy ground has either.
enum class BrightSide { kOutside, kInside, kEither };

struct EdgeMap {
  int width = 0, height = 0;
  std::vector<EdgePoint> points;  // Chain by chain.
  std::vector<EdgeChain> chains;
  // For each pixel (row by row), the point found in it, or -1. A pixel holds one point at most, and
  // the point lies within half a pixel of it.
  std::vector<std::int32_t> index;
  double gradient_noise = 0.0;  // Estimated standard deviation of one gradient component.
  cv::Mat gray;                 // The photo, shared, for whoever wants a second look.

  int PointAt(int x, int y) const {
    // Below 0 is beyond the end, once without a sign.
    if (static_cast<unsigned>(x) >= static_cast<unsigned>(width) ||
        static_cast<unsigned>(y) >= static_cast<unsigned>(height)) {
      return -1;
    }
    return index[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                 static_cast<std::size_t>(x)];
  }
};

// How far the point of a contour that bends with `curvature` (1 / pixels) lies on the inner side of
// it, pixels, to first order in the curvature; `blur_px` is that of the point or, less noisy, an
// average along the contour. Two effects, both about 1 / 20 px at a radius of 10 px:
// - A Gaussian of width s moves the steepest place of a curved step inward by k s^2 / 2 (from
//   I1(r R / s^2) of a disc's profile: exp(-(r - R)^2 / (2 s^2)) sqrt(R / r)).
// - Along a row or column at an angle to the normal (cosine c) the distance to the contour is not
//   linear, d = c x + k (1 - c^2) x^2 / 2, and the parabola through three samples, the point at
//   `o` from the middle one, leans inward by k (1 - c^2) (1 - 3 o^2) / 2.
double CurvatureBias(const EdgePoint& point, double blur_px, double curvature);

// The grey image that edges are looked for in. Refuses what is empty or not 8-bit with 1, 3 or 4
// channels (BGR, BGRA).
Status ToGray(const cv::Mat& image, cv::Mat* gray);

// `gray` is 8-bit with one channel, not empty. `smoothing_px` is the standard deviation of the
// smoothing, in [0.5, 5]: more finds fainter edges in noise, less resolves finer structure and
// rounds corners less. `within` (optional): only in these rectangles, as in FindEdgePoints; chains
// end at their borders. `faintness`: edges of that share of the usual contrast count. About 2 ms
// for a 640x480 photo.
EdgeMap DetectEdges(const cv::Mat& gray, double smoothing_px = kEdgeSmoothingPx,
                    const std::vector<cv::Rect>* within = nullptr, double faintness = 1.0);

// Fills the points of `map`, row by row, and its index from its grey photo; no chains. Returns
// where each point stands in the index. The outermost pixels hold no points. `low` is the weakest
// gradient that counts, grey levels per pixel. `within` (optional): only in these rectangles, which
// lie in the photo and do not overlap, and there the same points.
std::vector<std::int32_t> FindEdgePoints(double smoothing_px, double low,
                                         const std::vector<cv::Rect>* within, EdgeMap* map);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_EDGES_H_
