// Everything that one photo tells about one pose: the common language of detection, fitting,
// solvers and refinement. Detected (DetectObservations), read from a scene file, or filled by hand.
#ifndef CIRCLINE_ESTIMATORS_OBSERVATIONS_H_
#define CIRCLINE_ESTIMATORS_OBSERVATIONS_H_

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic_fit.h"
#include "circline/estimators/export.h"
#include "circline/estimators/line.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/status.h"
#include "circline/estimators/vanishing_point.h"

namespace CIRCLINE_EXPORT circline {

// Two pixels of the photo. As an axis it is oriented from [0] to [1]; elsewhere it has no sense.
using Segment = std::array<Eigen::Vector2d, 2>;

// A conic and the points that speak for it.
struct ConicReading {
  ConicFit fit;                       // Calibrated.
  std::vector<std::uint8_t> inliers;  // One per point of the contour, 1 = inlier.
};

// Image of one circle. All pixels are pixels of the photo as taken.
struct CircleObservation {
  std::string id;                       // Unique among the circles.
  std::vector<Eigen::Vector2d> points;  // Contour, pixels, any order; 5 or more.
  // Of the edge at each point: unit gradient across the contour, on the photo, its sense without
  // meaning, zero where not known; or empty. A robust fit is faster and surer with them.
  std::vector<Eigen::Vector2d> normals;
  double sigma_px = 0.0;  // Standard deviation of each coordinate; 0 = not known.
  std::optional<Eigen::Vector2d>
      center;                 // Image of the circle's centre (NOT the ellipse's), pixels.
  double radius = 0.0;        // In the world's unit; 0 = not known.
  double radius_sigma = 0.0;  // Of that radius, relative; 0 = that of the noise model.
  std::string plane;       // Circles and pencils with the same id share a plane; empty = with none.
  std::string concentric;  // Circles with the same id share their centre; empty = with none.
  // +1: brighter inside than outside, -1: darker, 0: not known. Contours of one contrast share an
  // offset (NoiseModel::contour_offset_px).
  int contrast = 0;
  // Circles with the same id have equal radii, known or not; empty = with none. A radius, and its
  // radius_sigma, may be given of one of them or of all.
  std::string radius_group;
  std::vector<Segment> diameters;  // Chords through the centre, pixels.

  // Added by a fit.
  std::optional<ConicFit> fit;
  std::vector<std::uint8_t> inliers;  // One per point, 1 = inlier; empty = all.
  // A less likely ellipse, through points that `fit` leaves out: of two rims the other one. The
  // refinement reads the contour so, too, where `fit` contradicts the rest.
  std::optional<ConicReading> second;
};

// Image of one straight line: the end points of a segment, or points along it.
struct LineObservation {
  std::vector<Eigen::Vector2d> points;  // Pixels; 2 or more.

  // Added by a fit.
  std::optional<LineFit> fit;
  std::vector<std::uint8_t> inliers;
  bool is_parallel = true;  // To the others of its pencil: else an outlier of the pencil's fit.

  double sigma_px = 0.0;  // Of each point's coordinates; 0 = that of the pencil.
};

// Along a world axis, or unknown.
enum class PencilDirection { kX, kY, kZ, kFree };
const char* PencilDirectionName(PencilDirection direction);  // "x", "y", "z", "free".

// A direction that a pencil may have.
struct DirectionReading {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  // Unit, camera frame, without sense.
  double probability = 0.0;                             // Among those of its pencil.
};

// Images of lines that are parallel in space.
struct PencilObservation {
  std::string id;                                      // Unique among the pencils.
  std::vector<LineObservation> lines;                  // Two or more say a direction.
  PencilDirection direction = PencilDirection::kFree;  // Of the world, without sense.
  std::string plane;  // The plane in which the lines lie; empty = none in particular.
  // Of each point's coordinates, where its line says nothing else; 0 = not known.
  double sigma_px = 0.0;

  std::optional<VanishingPointFit> fit;  // Added by a fit; camera frame.
  // Of a detected pencil along an axis: directions about the other axis, one degree apart, as all
  // lines of the photo speak for them, whichever are its own; the probabilities sum to 1. The
  // refinement gives those far from its pose to hypotheses of their own: the same turned, with its
  // covariance and inliers. Empty: as `fit` says.
  std::vector<DirectionReading> readings;
  // Of a detected pencil along an axis, where the focal length is unknown: how probably it runs so.
  // Hypotheses in which it does have this probability in all, and others, in which it runs any way
  // (of x and y: any way in their plane), the rest.
  double axis_probability = 1.0;
};

// Where the user wants the world frame. All optional; where nothing is said, the plane is the first
// one named, +Z faces the camera, the origin is the first circle's centre.
struct FrameObservation {
  std::string plane;                      // The plane Z = 0.
  std::optional<Eigen::Vector2d> origin;  // Image of the world origin, pixels.
  std::optional<Segment> x_axis, y_axis;  // Oriented pieces of the axes' images, pixels.
  std::string origin_is_center;           // Id of the circle whose centre is the origin.
};

// The angle between the directions of two pencils. These have no sense: it and its supplement are
// the same.
struct KnownAngle {
  std::array<std::string, 2> pencils;  // Ids.
  double value = 0.0;                  // Radians, within 2 pi.
  double sigma = 0.0;                  // Radians; 0 = exact.
};

// The distance between two points of a plane.
struct KnownLength {
  Segment points;      // Pixels.
  std::string plane;   // Empty = the frame's plane; of another plane it is not used.
  double value = 0.0;  // In the world's unit.
  double sigma = 0.0;  // Of value, relative; 0 = that of the noise model.
};

// All evidence of one photo.
struct Observations {
  Camera camera;  // The one that took the photo.
  // The focal length that is known beforehand, of fx, pixels, where `camera` has another, at which
  // the photo's structure is likelier (DetectObservations), or its curves (FitObservations); 0 =
  // that of `camera`.
  double stated_focal_px = 0.0;
  // What the k1 of `camera` has beyond the one known beforehand, where the photo's lines are
  // straighter with it (DetectObservations), or its curves likelier (FitObservations); else 0.
  double found_k1 = 0.0;
  std::vector<CircleObservation> circles;  // Images of circles.
  std::vector<PencilObservation> pencils;  // Images of parallel lines.
  FrameObservation frame;                  // Where the world frame is to lie.
  std::vector<KnownAngle> known_angles;    // Between pencils.
  std::vector<KnownLength> known_lengths;  // On planes.
  int num_dropped_points = 0;  // Pixels that the camera model cannot undistort, counted by fits.
  std::string message;  // What a detection wants to say ("one pencil only: ..."); may be empty.

  // Ok, or a sentence naming what is inconsistent: an id used twice, a reference to nothing (a
  // circle, a pencil, the plane of a length), a non-finite number, a negative sigma, radius or
  // length.
  Status Validate() const;
};

// Logarithm of the focal length known beforehand, against that of `camera`.
double StatedLogFocal(const Observations& observations);

// Standard deviation of the points of a pencil's line: its own, else the pencil's; 0 = not known.
double LineSigma(const PencilObservation& pencil, const LineObservation& line);

// Whether the pencil runs along an axis of the world.
bool RunsAlongAxis(const PencilObservation& pencil);

// Index of a circle or pencil by id, or -1.
int FindCircle(const Observations& observations, const std::string& id);
int FindPencil(const Observations& observations, const std::string& id);

// Whether a known length lies in the plane Z = 0 of resolved observations (ResolveWorld).
bool IsInWorldPlane(const KnownLength& length, const Observations& resolved);

// Settles by convention what the user left open, so that every solver speaks of the same world
// frame; returns the observations with frame.plane and the roles filled in:
// - The plane Z = 0 is frame.plane, else the first plane named by a circle, then by a pencil. Where
//   none is named it gets the id "world", and holds the circle whose centre is the origin (else the
//   first circle) and those concentric with it. Where there is no circle either, and no pencil has
//   a role, the first two pencils of different direction span it.
// - A free pencil on one of whose lines an axis is drawn gets that axis' role.
// - A radius known of one circle holds for its whole radius group, and so does the least
//   radius_sigma stated with it; that of the noise model where none is.
// - Where nothing fixes the X axis (no role x or y, no axis drawn), the first free pencil of that
//   plane does: it gets role x.
Observations ResolveWorld(const Observations& observations);

// The line of a pencil of which `axis` is a part: both its end points are points of the line. Such
// an axis is no evidence of its own (the line is); it adds the sense, and that the line meets the
// origin.
bool FindAxisLine(const Observations& observations, const Segment& axis, int* pencil, int* line);

// Points of a line or circle that count (mask applied), calibrated. Returns how many were dropped
// because the camera cannot undistort them.
int CalibrateInliers(const Camera& camera, const std::vector<Eigen::Vector2d>& pixels,
                     const std::vector<std::uint8_t>& inliers,
                     std::vector<CalibratedPoint>* points);

// Takes all fits away.
void ResetFits(Observations* observations);

// What FitDirect needs in between, for callers that keep it from photo to photo.
struct FitMemory {
  std::vector<CalibratedPoint> points;  // Of one feature.
  std::vector<double> numbers;          // Of a contour.
  std::vector<LineFit> fits;            // Of one pencil's lines.
};

// Fills every fit that is absent by the direct (non-robust) maximum-likelihood fits, taking
// `default_sigma_px` where a feature states no sigma of its own. What cannot be fitted stays
// without a fit; `problems` (optional) receives one sentence for each. Covariances include the
// errors of the noise model that the points of one feature share, and that of a line against its
// pencil's direction.
void FitDirect(double default_sigma_px, Observations* observations,
               std::vector<std::string>* problems = nullptr,
               const NoiseModel& noise = NoiseModel::Exact(), FitMemory* memory = nullptr);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_OBSERVATIONS_H_
