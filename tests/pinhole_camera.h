// The camera of tests that need no lens: 640 x 480, focal length 800 px.
#ifndef CIRCLINE_TESTS_PINHOLE_CAMERA_H_
#define CIRCLINE_TESTS_PINHOLE_CAMERA_H_

#include "circline/estimators/camera.h"

namespace circline {

inline Camera PinholeCamera() {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 800.0;
  camera.cx = 320.0;
  camera.cy = 240.0;
  return camera;
}

}  // namespace circline

#endif  // CIRCLINE_TESTS_PINHOLE_CAMERA_H_
