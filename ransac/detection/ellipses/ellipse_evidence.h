// From detected ellipses to observations: what cold detection and following have in common.
// Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_ELLIPSES_ELLIPSE_EVIDENCE_H_
#define CIRCLINE_RANSAC_DETECTION_ELLIPSES_ELLIPSE_EVIDENCE_H_

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "circline/ransac/detection/detect_observations.h"
#include "circline/ransac/detection/edges.h"
#include "circline/ransac/detection/ellipses/detect_ellipses.h"

namespace circline {

// Points of an ellipse as an observation, with all that is known of them and nothing of what was
// there: thinned, and the fit's covariance widened by the correlation of dense points and by what
// they all share. `camera`: of the edges.
void FillCircle(const EdgeMap& edges, const DetectedEllipse& ellipse, const Camera& camera,
                const NoiseModel& noise, CircleObservation* circle);

// Edge points that belong to an ellipse and so to no line.
std::vector<std::uint8_t> EllipsePoints(const EdgeMap& edges,
                                        const std::vector<DetectedEllipse>& ellipses);

// Bad options or camera, an empty image, or one of another size than the camera's.
Status CheckDetectionInput(const cv::Mat& image, const Camera& camera,
                           const DetectionOptions& options);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_ELLIPSES_ELLIPSE_EVIDENCE_H_
