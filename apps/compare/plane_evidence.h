// Where on the world's plane the evidence lies.
#ifndef CIRCLINE_APPS_COMPARE_PLANE_EVIDENCE_H_
#define CIRCLINE_APPS_COMPARE_PLANE_EVIDENCE_H_

#include <Eigen/Geometry>

#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"

namespace circline::apps {

// The part of the plane Z = 0 that carries evidence, world coordinates; without what lies much
// farther away than the nearest, towards the vanishing line. May be empty. `camera`: that of the
// observations, or as the pose's hypothesis sees through it.
Eigen::AlignedBox2d EvidenceOnPlane(const Observations& observations, const Camera& camera,
                                    const CameraPose& pose);

// The point of the plane Z = 0 that is seen in a pixel; false where there is none.
bool PixelOnPlane(const Camera& camera, const CameraPose& pose, const Eigen::Vector2d& pixel,
                  Eigen::Vector2d* point);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_PLANE_EVIDENCE_H_
