// What one image says about a plane once the pose is known, and about what stands on it
// (proposition 6 of Wang, Wu and Ji 2007).
//
// Conventions: image points are homogeneous calibrated 3-vectors (x, y, 1) or rays, any positive
// multiple; image lines and conics are calibrated as well. The plane is Z = 0 of the world frame of
// the pose, and (X, Y) on it are world coordinates. Lengths come in the unit of the pose's
// translation: metres if that is metric, else multiples of the distance from the camera to the
// world origin; ratios and angles do not care. Whatever returns bool returns false, with its result
// untouched, for what cannot be computed: a point on or beyond the horizon, a camera in the plane,
// a number that is not finite. Nothing allocates where it does not say so.
#ifndef CIRCLINE_ESTIMATORS_METROLOGY_H_
#define CIRCLINE_ESTIMATORS_METROLOGY_H_

#include <Eigen/Core>
#include <array>
#include <functional>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/export.h"
#include "circline/estimators/pose.h"

namespace CIRCLINE_EXPORT circline {

// Into space, world frame: a point is seen along a ray, a line in a plane, a conic in a cone.
struct WorldRay {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();     // The camera centre.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  // Unit.
};
// The plane in which a line of the image is seen.
struct WorldPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // Unit.
  double offset = 0.0;                               // normal . X + offset = 0.
};
// The cone in which a conic of the image is seen.
struct WorldCone {
  Eigen::Vector3d apex = Eigen::Vector3d::Zero();  // The camera centre.
  Eigen::Matrix3d form = Eigen::Matrix3d::Zero();  // (X - apex)^T form (X - apex) = 0.
};
// The ray, plane or cone of an image point (homogeneous), line or conic, calibrated.
bool RayOfPoint(const CameraPose& pose, const Eigen::Vector3d& x, WorldRay* ray);
bool PlaneOfLine(const CameraPose& pose, const Eigen::Vector3d& line, WorldPlane* plane);
bool ConeOfConic(const CameraPose& pose, const Eigen::Matrix3d& conic, WorldCone* cone);

// Onto the plane. The point (X, Y) of the plane that is seen at x; 10 ns.
bool PointOnPlane(const CameraPose& pose, const Eigen::Vector3d& x, Eigen::Vector2d* point);
// The line l . (X, Y, 1) = 0 of the plane that is seen as `line`, with a unit normal (l0, l1), so
// that l . (X, Y, 1) is a distance. False for the horizon itself.
bool LineOnPlane(const CameraPose& pose, const Eigen::Vector3d& line, Eigen::Vector3d* plane_line);
// The ellipse of the plane that is seen as `conic`: a circle (a = b) if it is the image of one.
// False where the conic touches the horizon or lies beyond it, or is no ellipse.
bool ConicOnPlane(const CameraPose& pose, const Eigen::Matrix3d& conic, Ellipse* ellipse);

// The homography (X, Y, 1) ~ H x that rectifies the image of the plane, of unit Frobenius norm; the
// third component of H x is positive for what is on this side of the horizon. For pixels of an
// undistorted photo multiply by K^-1 from the right.
bool RectifyingHomography(const CameraPose& pose, Eigen::Matrix3d* plane_from_image);

// Distance on the plane between the points seen at a and b.
bool LengthOnPlane(const CameraPose& pose, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                   double* length);
// Four image points: two segments, from 0 to 1 and from 2 to 3.
using SegmentPair = std::array<Eigen::Vector3d, 4>;
// |first| / |second| on the plane. False where the second has no length.
bool LengthRatio(const CameraPose& pose, const SegmentPair& segments, double* ratio);
// Angle on the plane from the direction of the first to that of the second, radians in (-pi, pi],
// positive from +X to +Y. False where one has no length.
bool AngleOnPlane(const CameraPose& pose, const SegmentPair& segments, double* angle);
// Area of the polygon with these three or more corners, in order; of a polygon that crosses itself,
// the areas that it turns around with opposite senses are subtracted.
bool AreaOnPlane(const CameraPose& pose, const std::vector<Eigen::Vector3d>& corners, double* area);
// Height Z of the point seen at `top` that stands perpendicularly over the point of the plane seen
// at `foot`; the nearest point of the perpendicular to the ray, should they miss each other.
// Negative below the plane, where Z is negative. False where the perpendicular is seen end-on.
bool HeightOverPlane(const CameraPose& pose, const Eigen::Vector3d& foot,
                     const Eigen::Vector3d& top, double* height);

// A measurement and its standard deviation.
struct Measurement {
  double value = 0.0, sigma = 0.0;  // In the world's unit; radians of an angle.
};
// The same of pixels of the photo as taken, with a standard deviation: first-order propagation of
// the points' noise, `sigma_px` for each coordinate, of the hypothesis' covariance, taken as
// independent of it, and where the focal length was refined, of that too, with its covariance with
// the pose. `camera` is the one that the pose was estimated with, its focal length as given. Free
// directions of the pose, which the covariance leaves out, must not matter to the result; a free
// rotation about the normal does not. Nor does it hold the length of a translation that is not
// metric: lengths, areas and heights are then exact multiples of that unit. Allocates.
bool LengthOnPlane(const PoseHypothesis& pose, const Camera& camera,
                   const std::array<Eigen::Vector2d, 2>& segment, double sigma_px,
                   Measurement* length);
bool LengthRatio(const PoseHypothesis& pose, const Camera& camera,
                 const std::array<Eigen::Vector2d, 4>& segments, double sigma_px,
                 Measurement* ratio);
bool AngleOnPlane(const PoseHypothesis& pose, const Camera& camera,
                  const std::array<Eigen::Vector2d, 4>& segments, double sigma_px,
                  Measurement* angle);
bool AreaOnPlane(const PoseHypothesis& pose, const Camera& camera,
                 const std::vector<Eigen::Vector2d>& corners, double sigma_px, Measurement* area);
bool HeightOverPlane(const PoseHypothesis& pose, const Camera& camera,
                     const std::array<Eigen::Vector2d, 2>& foot_and_top, double sigma_px,
                     Measurement* height);
// And of anything else: `function(pose, image points of the pixels, &value)`.
using PlaneFunction =
    std::function<bool(const CameraPose&, const std::vector<Eigen::Vector3d>&, double*)>;
bool MeasureOnPlane(const PlaneFunction& function, const PoseHypothesis& pose, const Camera& camera,
                    const std::vector<Eigen::Vector2d>& pixels, double sigma_px,
                    Measurement* measurement);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_METROLOGY_H_
