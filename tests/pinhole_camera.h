// Cameras of tests that need no lens.
#ifndef CIRCLINE_TESTS_PINHOLE_CAMERA_H_
#define CIRCLINE_TESTS_PINHOLE_CAMERA_H_

#include "circline/estimators/camera.h"

namespace circline {

inline Camera PinholeCamera(double focal = 800.0, int width = 640, int height = 480) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = focal;
  camera.cx = 0.5 * width;
  camera.cy = 0.5 * height;
  return camera;
}

// The same with its principal point in the middle of the pixels, whose centres are at integers.
inline Camera CenteredCamera(double focal, int width, int height) {
  Camera camera = PinholeCamera(focal, width, height);
  camera.cx -= 0.5;
  camera.cy -= 0.5;
  return camera;
}

}  // namespace circline

#endif  // CIRCLINE_TESTS_PINHOLE_CAMERA_H_
