// A circle about the origin of a plane, alone and with lines along the axes.
#ifndef CIRCLINE_TESTS_REFINE_ROUND_SCENE_H_
#define CIRCLINE_TESTS_REFINE_ROUND_SCENE_H_

#include "circline/estimators/observations.h"
#include "tests/plane_scene.h"

namespace circline {

inline Observations OneCircle(PlaneScene* scene) {
  Observations observations = scene->Empty();
  observations.circles = {scene->Circle("c0", 0.0, 0.0, 1.0)};
  observations.frame.origin_is_center = "c0";
  return observations;
}

inline Observations CircleAndAxes(PlaneScene* scene) {
  Observations observations = OneCircle(scene);
  observations.pencils = scene->Axes();
  return observations;
}

}  // namespace circline

#endif  // CIRCLINE_TESTS_REFINE_ROUND_SCENE_H_
