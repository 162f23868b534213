// Pencils of a photo that are known from the one before. Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_FOLLOW_LINES_H_
#define CIRCLINE_RANSAC_DETECTION_FOLLOW_LINES_H_

#include <cstddef>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/ransac/detection/detect_lines.h"

namespace circline {

// What may be one feature in two photos.
struct FeaturePair {
  double cost;
  std::size_t first, second;
};

// For each of the first features the second one that it is, or -1: the cheapest pairs first, each
// feature once.
std::vector<int> CheapestPairs(std::vector<FeaturePair> pairs, std::size_t num_first,
                               std::size_t num_second);

// For each predicted pencil the detected lines that continue its own, none in two pencils: within
// `search_px` at both ends, over half of the shorter one. -1 for a line that none continues.
std::vector<std::vector<int>> MatchLines(const std::vector<PencilObservation>& predicted,
                                         const std::vector<DetectedLine>& lines, double search_px);

// A pencil of the lines found for it: fits, noise and outliers as those of the cold detector. Empty
// where none were found.
PencilObservation FollowPencil(const PencilObservation& predicted,
                               const std::vector<DetectedLine>& lines,
                               const std::vector<int>& matches, double diagonal_px);

// Whether the lines of a pencil pass through the centres of circles (see circle_grid.h), and then,
// for each line, of which.
std::vector<std::vector<int>> LinesOfCentres(const Observations& predicted,
                                             const PencilObservation& pencil);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_FOLLOW_LINES_H_
