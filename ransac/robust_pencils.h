// Robust vanishing points: the direction that most of a set of lines share, and the several
// directions that one set of lines shares out among them. Residuals are those of pencil_model.h.
#ifndef CIRCLINE_RANSAC_ROBUST_PENCILS_H_
#define CIRCLINE_RANSAC_ROBUST_PENCILS_H_

#include <cstdint>
#include <vector>

#include "circline/estimators/export.h"
#include "circline/estimators/line.h"
#include "circline/estimators/status.h"
#include "circline/estimators/vanishing_point.h"
#include "circline/ransac/ransac.h"

namespace CIRCLINE_EXPORT circline {

// What counts as a pencil.
struct PencilOptions {
  // A line farther than `ransac.threshold` standard deviations from the direction is an outlier.
  RansacOptions ransac;
  // What a line that is truly parallel may miss the direction by beyond its own noise (lens,
  // edges that bend, walls not quite parallel), radians; 0 or more. 0.4 px at a focal length of
  // 800 px is 5e-4.
  double model_sigma_rad = 5e-4;
  // FindPencils: directions to look for; 0 or more.
  int max_pencils = 3;
  // FindPencils: fewest lines of a pencil; 3 or more (two lines always meet).
  int min_lines = 3;
  // FindPencils: a pencil is kept if fewer than this many as good are expected among as many
  // unrelated lines (number of false alarms; Desolneux, Moisan, Morel, IJCV 2000); > 0.
  double max_false_alarms = 0.01;

  PencilOptions() {
    ransac.threshold = kInlierSigmas;
    // Lines along other directions are many: with one, the plane that scikit-image's
    // motorcycle_left.png is taken for changes with the seed three times as often.
    ransac.local_samples = 3;
  }
  // Ok, or a sentence that names the field which is wrong.
  Status Validate() const;
};

// A pencil and its lines.
struct FoundPencil {
  VanishingPointFit fit;   // Of its lines.
  std::vector<int> lines;  // Indices of its members, ascending.
};

// The direction with the most support and its covariance, fitted to the inliers (which `mask`,
// optional, receives, one per line). Refuses fewer than two usable lines, and lines that all
// coincide. Two lines are fitted as they are. Lines with a zero or non-finite normal are outliers.
// `fit` and `mask` are written only if the status is ok.
Status FitVanishingPointRobust(const std::vector<LineFit>& lines, const PencilOptions& options,
                               VanishingPointFit* fit, std::vector<std::uint8_t>* mask = nullptr);

// Several pencils from one set of lines, the best supported first. One direction after the other is
// found among the lines that are left; the search stops at max_pencils, or when the best direction
// left has fewer than min_lines lines or more than max_false_alarms; the lines that are expected to
// drift off the pencils found, a few degrees, count among those. Then every line goes to the
// pencil that it misses least (within the threshold), each direction is fitted again, and pencils
// that no longer meet the conditions are dropped. No line is in two pencils. An empty answer is ok.
Status FindPencils(const std::vector<LineFit>& lines, const PencilOptions& options,
                   std::vector<FoundPencil>* pencils);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_ROBUST_PENCILS_H_
