// How well detection tells the directions of houses from segments: its choice against the same
// estimate from segments whose membership is known.
#ifndef CIRCLINE_APPS_SIMULATE_STREET_TRIALS_H_
#define CIRCLINE_APPS_SIMULATE_STREET_TRIALS_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "apps/simulate/street.h"

namespace circline::apps {

struct StreetAnswer {
  bool failed = true;            // No answer, or one whose rotation is free.
  double error_deg = 180.0;      // Of the rotation, to the nearest plane of the first house.
  double error_any_deg = 180.0;  // Of any house.
  // Of the error that counts for error_any_deg, camera frame, and its standard deviations.
  Eigen::Vector3d error = Eigen::Vector3d::Zero(), sigma = Eigen::Vector3d::Zero();
  double probability = 0.0;
  // Of the logarithm of the focal length, where that is a guess; the deviation is about the best
  // hypothesis, over all at their probabilities.
  double focal_error = 0.0, focal_sigma = 0.0;
};

struct StreetTrial {
  StreetPhoto photo;
  StreetAnswer detected, known;  // Known: told which segment is of which direction.
};

// The same options give the same bits, whatever the number of threads (0 = one for each core).
// `focal_sigma`: that of DrawStreet.
std::vector<StreetTrial> SimulateStreets(int trials, double focal_sigma, std::uint64_t seed,
                                         int threads);

std::string StreetCsv(const std::vector<StreetTrial>& trials);
std::string StreetSummary(const std::vector<StreetTrial>& trials);  // A line or two, for people.

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_SIMULATE_STREET_TRIALS_H_
