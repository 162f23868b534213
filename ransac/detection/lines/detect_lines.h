// Straight lines of a scene, from edge chains.
//
// "Straight" means straight in calibrated coordinates: chains are undistorted first, so that a line
// that the lens bends across the photo stays one line. Chains are cut into straight pieces, pieces
// that continue each other (the sides of a row of chessboard squares, of a row of windows) are
// joined, whatever the polarity of their edges, and every line keeps points along it.
#ifndef CIRCLINE_RANSAC_DETECTION_LINES_DETECT_LINES_H_
#define CIRCLINE_RANSAC_DETECTION_LINES_DETECT_LINES_H_

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/line.h"
#include "circline/estimators/observations.h"
#include "circline/ransac/detection/edges.h"

namespace circline {

struct DetectedLine {
  std::vector<Eigen::Vector2d> points;  // Pixels of the photo, in order along the line; 2 or more.
  Segment ends;                         // The outermost edge points.
  double length_px = 0.0;               // Of the pieces, gaps left out.
  double sigma_px = 0.0;                // Standard deviation of a point across the line.
  LineFit fit;                          // Calibrated.
};

// Sets the fit and sigma_px of a line from its points, calibrated; false, and nothing changed,
// where there is none.
bool FitAverages(const std::vector<CalibratedPoint>& points, DetectedLine* line);

// Lines of `min_length_px` (> 0) or more, the longest first, 400 at most; without those along the
// photo's border, of dark rims and of frames. `camera` must be valid. `skip` (optional, one per
// edge point, 1 = belongs to something else) marks points that are not used. `bent` (optional)
// receives what is all but straight, up to a sagitta of 1.2 px and of 1.8 % of its length: edges of
// worn and of soft things, and arcs; longest first, as many as lines at most. About 1 ms for a
// 640x480 photo.
std::vector<DetectedLine> DetectLines(const EdgeMap& edges, const Camera& camera,
                                      double min_length_px,
                                      const std::vector<std::uint8_t>* skip = nullptr,
                                      std::vector<DetectedLine>* bent = nullptr);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_LINES_DETECT_LINES_H_
