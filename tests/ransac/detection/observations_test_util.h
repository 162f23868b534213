// Detection on one photo, and how far what it found is from the truth.
#ifndef CIRCLINE_TESTS_RANSAC_DETECTION_OBSERVATIONS_TEST_UTIL_H_
#define CIRCLINE_TESTS_RANSAC_DETECTION_OBSERVATIONS_TEST_UTIL_H_

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <opencv2/core.hpp>

#include "circline/estimators/observations.h"
#include "circline/ransac/detection/detect_observations.h"
#include "tests/ransac/detection/detection_test_util.h"

namespace circline::detection_test {

inline Observations Detect(const cv::Mat& image, const Camera& camera,
                           const DetectionOptions& options = {}) {
  Observations found;
  const Status status = DetectObservations(image, camera, options, &found);
  EXPECT_TRUE(status.ok()) << status.message;
  const Status valid = found.Validate();
  EXPECT_TRUE(valid.ok()) << valid.message;
  return found;
}

// The x and y directions of the pencils with these roles; false where they are not both there.
inline bool Axes(const Observations& found, Eigen::Vector3d* x, Eigen::Vector3d* y) {
  *x = *y = Eigen::Vector3d::Zero();
  bool has_x = false, has_y = false;
  for (const PencilObservation& pencil : found.pencils) {
    if (!pencil.fit) continue;
    if (pencil.direction == PencilDirection::kX) {
      *x = pencil.fit->direction;
      has_x = true;
    }
    if (pencil.direction == PencilDirection::kY) {
      *y = pencil.fit->direction;
      has_y = true;
    }
  }
  return has_x && has_y;
}

// Largest angle of the two directions to the nearest board axis (each to its own).
inline double AxesErrorDeg(const Eigen::Vector3d& x, const Eigen::Vector3d& y,
                           const Eigen::Matrix3d& rotation) {
  const Eigen::Vector3d r1 = rotation.col(0), r2 = rotation.col(1);
  return std::min(std::max(AxisDeg(x, r1), AxisDeg(y, r2)),
                  std::max(AxisDeg(x, r2), AxisDeg(y, r1)));
}

}  // namespace circline::detection_test

#endif  // CIRCLINE_TESTS_RANSAC_DETECTION_OBSERVATIONS_TEST_UTIL_H_
