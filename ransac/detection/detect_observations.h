// From a photo and a calibration to Observations: ellipses, pencils of parallel lines, and which of
// them share a plane.
//
//     Observations observations;
//     const Status status = DetectObservations(image, camera, DetectionOptions(), &observations);
//
// What comes out: circles "c0", "c1", ... and pencils "L0", "L1", ..., the best supported of the
// world's plane first, each with its pixels and its fit. Plane "p0", the plane Z = 0, is the one
// that has most support: of two pencils and the circles that agree with them, or of circles alone,
// where it is likelier that they share a plane than that some of them agree by accident.
// Two pencils in it that are likelier to be at right angles, as walls are to about 0.7 degrees,
// than at any angle become its axes x and y, a third one orthogonal to both z; others stay free.
// How far they lean from their axes is for the estimate to find (NoiseModel::pencil_axis_rad).
// Pencils whose lines hardly meet (the edges of a box, the stripes of a cushion behind it) span no
// plane: each is then in one of its own.
// Rows and columns of a sheet of equal circles are pencils too: of lines through the images of
// their centres. A box that stands on the plane of circles, found by its corners, gives that plane
// its axes x and y (one line may be all that there is along each), and tells which of the two
// normals of a lone circle is right. Where there is no plane else, or one circle's, it is
// that of the largest rectangle which four lines close, a sheet of paper or a screen, if the circle
// can lie in it: each pencil has two of its sides. What cannot be a pose is said in `message`.
#ifndef CIRCLINE_RANSAC_DETECTION_DETECT_OBSERVATIONS_H_
#define CIRCLINE_RANSAC_DETECTION_DETECT_OBSERVATIONS_H_

#include <cstdint>
#include <opencv2/core.hpp>

#include "circline/estimators/export.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/status.h"

namespace CIRCLINE_EXPORT circline {

// What is worth detecting.
struct DetectionOptions {
  double min_ellipse_axis_px = 3.0;     // Smallest semi-minor axis; > 0.
  double min_arc_deg = 100.0;           // Smallest angular coverage of an ellipse; in (0, 360].
  double min_segment_length_px = 20.0;  // Shortest line; > 0.
  int max_circles = 400;  // The best ones by coverage and size; 0 or more. `message` says more.
  int max_pencils = 3;    // Directions of parallel lines to look for; 0 to 100.
  // A direction nearer to a plane than this may lie in it (a statistical test decides), and a plane
  // of circles has the normal of one of them to so much (a standard deviation); > 0.
  double max_shared_plane_deg = 5.0;
  std::uint64_t seed = 1;  // Same photo, options and seed: same bits out.
  // What the points of one contour share: in the covariances of ellipses, and so in which planes
  // they may lie. By how much lines miss their pencil's direction is measured. Where the camera's
  // focal length is known to 10 % or worse (noise_model.camera), right angles and planes are judged
  // where they are likeliest: Observations::camera has that focal length, and stated_focal_px the
  // one given, about which the estimate's prior still is. Two to five times the time.
  NoiseModel noise_model;

  // Ok, or a sentence that names the field which is wrong.
  Status Validate() const;
};

// Detects everything; fits included. Observations::camera has the photo's size, known or not.
// `image` is 8-bit, 1, 3 or 4 channels. The status is not ok for an empty image, a wrong type, a
// wrong size (against camera.width x height) or bad options; a photo in which nothing is found is
// ok; observations->message says so, and what was cut. Where nothing tells a pose the photo is
// looked at once more, for edges of half the usual contrast: two to three times the time.
Status DetectObservations(const cv::Mat& image, const Camera& camera,
                          const DetectionOptions& options, Observations* observations);

// The same inside a rectangle (clipped to the photo): the ellipse best supported there becomes the
// points of `circle`, with its sigma_px and fit, and no second reading; all else of `circle` stays
// as it is. Refuses where there is none.
Status DetectCircleInRoi(const cv::Mat& image, const Camera& camera, const cv::Rect& roi,
                         const DetectionOptions& options, CircleObservation* circle);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_DETECT_OBSERVATIONS_H_
