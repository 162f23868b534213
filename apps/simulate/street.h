// Photos of streets as the line segments that a detector finds in them: houses with directions that
// are not quite orthogonal, clutter, a camera that is not quite what its calibration says.
#ifndef CIRCLINE_APPS_SIMULATE_STREET_H_
#define CIRCLINE_APPS_SIMULATE_STREET_H_

#include <Eigen/Core>
#include <array>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/random.h"

namespace circline::apps {

// Along its two fronts and up, in that order, unit, camera frame.
using HouseDirections = std::array<Eigen::Vector3d, 3>;

struct StreetSegment {
  Segment ends;                    // Pixels.
  int house = -1, direction = -1;  // Which it is of; -1: clutter.
};

struct StreetPhoto {
  Camera camera;                        // As calibrated, or guessed.
  CameraSigma sigma;                    // How well it is known.
  double focal_px = 0.0;                // The true one.
  double sigma_px = 0.0;                // Standard deviation of end points across their segment.
  std::vector<HouseDirections> houses;  // The one that the photo is of comes first.
  std::vector<StreetSegment> segments;
  bool is_orthogonal = true;  // Whether the first house is: else its fronts meet at any angle.
};

// A photo of 640 x 480 pixels of a corner of a house. All is drawn at random: see the constants.
// `focal_sigma`: of the logarithm of the focal length, where that is a guess of 60 degrees and the
// principal point one of the middle; 0: the camera is calibrated.
StreetPhoto DrawStreet(double focal_sigma, Random* random);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_SIMULATE_STREET_H_
