// The tables of detection, one a kind of truth: each reads the photographs of a folder, detects,
// and prints how far that is from what is true of them.
#ifndef CIRCLINE_APPS_BENCHMARK_DETECTION_TABLES_H_
#define CIRCLINE_APPS_BENCHMARK_DETECTION_TABLES_H_

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <string>

namespace circline::apps {

// Renderings, `count` of each of the seeds first, first + 1, ...: a line a seed and their average.
// `textures`: a folder with OpenCV's sample photographs. False where it has none.
bool MeasureRenderings(const std::string& textures, int first_seed, int num_seeds, int count);

// Photographs with labelled ellipses, not calibrated.
void MeasureLabels(const std::string& folder, const cv::FileNode& root);

// Calibrated photographs: circles, pencils and contours.
void MeasurePhotographs(const std::string& folder, const cv::FileNode& root);

// End points of segments on the edges of chessboards, ours and OpenCV's; nothing where the set has
// no chessboards.
void MeasureSegments(const std::string& folder, const cv::FileNode& root);

// Times of the photographs of a calibrated set at the size of 640 x 480, and of its first one at 12
// megapixels, enlarged and tiled: a row.
void MeasureSpeed(const std::string& folder, const cv::FileNode& root);

// Times of targets with many rings, drawn here.
void MeasureRingSpeed();

// The angle between a normal and the better of the two that an ellipse allows.
double BetterNormalDeg(const Eigen::Matrix3d& conic, const Eigen::Vector3d& normal);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_DETECTION_TABLES_H_
