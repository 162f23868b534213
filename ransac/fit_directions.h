// The second half of FitObservations: vanishing points of pencils whose lines are fitted.
#ifndef CIRCLINE_RANSAC_FIT_DIRECTIONS_H_
#define CIRCLINE_RANSAC_FIT_DIRECTIONS_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/status.h"
#include "circline/ransac/fit_observations.h"
#include "circline/ransac/ransac.h"

namespace circline {

// A circle or a line: its points, calibrated once, and their noise as far as it is known. Fits are
// made for points of 1 px, and given the noise in the end.
struct FittedFeature {
  std::vector<CalibratedPoint> points;
  std::vector<int> indices;  // Of `points` among the pixels.
  bool is_stated = false;    // The noise.
  double sigma_px = 0.0;
  Status status;  // Of its first fit.

  // A line through two points misses neither: how it misses its pencil's direction tells its noise.
  bool HasNoiseFromPencil() const { return !is_stated && points.size() == 2; }
  // Takes the noise that was measured, unless one is stated; true if it is not what it was.
  bool FollowNoise(double measured_px);
};

// What the fits of one set of observations share.
struct FitRun {
  const FitOptions& options;
  Observations& observations;
  std::vector<std::string>* problems;  // May be null.
  std::uint64_t num_fits = 0;

  // Rounds of fits and measurements of the noise, at the most.
  static constexpr int kMaxRounds = 8;

  // What the options say, with a seed of its own for each fit.
  void SetNext(double threshold, RansacOptions* ransac);
  void Report(const std::string& what, const std::string& problem) const;
  void Report(const PencilObservation& pencil, std::size_t line, const std::string& problem) const;
};

// Fits the directions of all pencils; says which of their lines are parallel and gives each line
// its noise. `lines`: by pencil, by line.
void FitDirections(std::vector<std::vector<FittedFeature>>* lines, FitRun* run);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_FIT_DIRECTIONS_H_
