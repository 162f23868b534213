// Many photos at once: the camera that took them (or several), the pose of every photo and what is
// seen, in one ceres::Problem. No known layout: circles and parallel lines are enough.
//
//   std::vector<Observations> photos = ...;     // DetectObservations or FitObservations, each.
//   const AdjustedPhotos adjusted = AdjustPhotos(photos);
//   if (adjusted.status.ok()) use(adjusted.cameras[0].camera, adjusted.cameras[0].Sigma(0));
#ifndef CIRCLINE_REFINE_ADJUST_PHOTOS_H_
#define CIRCLINE_REFINE_ADJUST_PHOTOS_H_

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/export.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/status.h"
#include "circline/refine/camera_shifts.h"
#include "circline/refine/estimate_pose.h"

namespace CIRCLINE_EXPORT circline {

// Whether a circle's id means the same circle in all photos: one world seen from many sides; or
// every photo has a world of its own, and only the camera is common.
enum class RigidWorld { kAuto, kYes, kNo };
const char* RigidWorldName(RigidWorld rigid);  // "auto", "yes", "no".
// False, with `rigid` untouched, where there is no such name.
bool RigidWorldFromName(const std::string& name, RigidWorld* rigid);

// How AdjustPhotos weighs, and what it estimates.
struct AdjustOptions {
  LossOptions conic_loss, line_loss;  // As in EstimationOptions.
  NoiseModel noise_model;             // Its camera is not used here: see camera_sigma.
  // Prior of a camera about the one that its photos come with, by Camera::id; UnknownCamera() where
  // there is none. Every id must be a photo's.
  std::map<std::string, CameraSigma> camera_sigma;
  // Distortion coefficients that are estimated, about those of the camera: so many radial ones, the
  // first of the model (0 to 3; fisheye 0 to 4), each with the prior k1 has; none of them where
  // that is 0. A pinhole camera has none: make it kOpenCV with zeros to estimate them.
  int num_radial = 3;
  // Standard deviation of p1 and p2 about those of the camera, kOpenCV with radial ones only; 0 =
  // held. That of seven lenses in ten; the others are taken to be off by ten times as much.
  double tangential_sigma = 0.0005;
  // kAuto: the evidence decides, and `rigid` of the answer says how.
  RigidWorld rigid = RigidWorld::kAuto;
  // Where a photo shows lines alone, and they lie on a grid of equal squares, as a chessboard's do,
  // they count as that (NoiseModel::grid_line); and circles of a world whose centres do, as a
  // calibration sheet's. False: as lines of two directions, and circles anywhere.
  bool square_grids = true;
  // Photos of a video that show nearly the same share their errors, and their number makes the
  // camera no better known: of those whose features lie within so much of one another, of the
  // photo's diagonal, the first one takes part. 0: all do. Of the 58 photographs of five sets here
  // no two of one camera are nearer than 0.01.
  double nearly_equal = 0.005;
  // Poses that are known from elsewhere (structure from motion), cam_from_anywhere, in any unit:
  // one for each photo, or none at all. Photos without one take no part. The photos' world is one
  // (`rigid` stays kAuto), circles and directions are found again by where they lie, and where the
  // world lies among the given poses is estimated, too: AdjustedPhotos::given.
  std::vector<std::optional<CameraPose>> given_poses;
  // Their standard deviations: of rotations, radians; of translations, of the distance to the
  // world's origin.
  double given_rotation_sigma = 0.001, given_translation_sigma = 0.001;
  int max_iterations = 100;    // Of the joint problem, each time it is solved; 1 or more.
  int num_threads = 1;         // Photos are started on so many; the same bits with any number.
  int num_solver_threads = 1;  // Of the joint problem; above 1 runs are equal to 1e-9 only.
  // Told how far it is, from any thread but one call at a time: "cameras" and how many of all are
  // found, then "poses" and of how many photos.
  std::function<void(const char* what, int done, int total)> progress;

  // Ok, or a sentence that names the field which is wrong.
  Status Validate() const;
};

// A camera of which nothing is known but the size of its photos: standard deviations 0.7 of log f,
// 3 % of the diagonal for the principal point, 0.3 for k1 (a fisheye: 0.1); pixels square to 0.1 %.
CameraSigma UnknownCamera(const Camera& camera);

// What a shift of camera_shifts.h changes: "focal length", "aspect", "cx", "cy", then the model's
// distortion coefficients, "k1" first.
const char* ShiftName(CameraModel model, int shift);

// A camera as many photos tell it.
struct AdjustedCamera {
  Camera camera;  // Estimated.
  // Of the shifts of camera_shifts.h (log f, log aspect, principal point, distortion), 12 x 12
  // row-major; zero where one was held. Scaled by the misfit of features, where that is above 1.
  std::array<double, kCameraSize * kCameraSize> covariance{};
  // Of focal length, principal point and radial distortion: what the photos say next to nothing of.
  std::vector<std::string> at_prior;
  int num_photos = 0;   // That it took, and that take part.
  double rms_px = 0.0;  // Of the inlier residuals, pixels.
  // The standard deviation of log f that the first photos alone would give, about the same estimate
  // (Sigma(0) counts how far that may lie off, too): how many, and that; 1, 2, 4, ... 64 of those
  // that take part, and all.
  std::vector<std::pair<int, double>> sigma_by_photos;

  // Standard deviation of a shift, 0 to kCameraSize - 1.
  double Sigma(int shift) const;
  // Of fx, pixels.
  double SigmaFocalPx() const { return camera.fx * Sigma(0); }
};

// An inlier of a contour or a line, and how far it lies from where it should.
struct AdjustedResidual {
  // Pixels of the photo.
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero(), offset = Eigen::Vector2d::Zero();
};

// One photo of them: its pose, and how well it fits.
struct AdjustedPhoto {
  Status status;              // Not ok: it has no part in the rest, and this says why.
  int same_as = -1;           // The photo that shows nearly the same, where that is why; else -1.
  int camera = 0;             // Index in AdjustedPhotos::cameras.
  CameraPose cam_from_world;  // Of its world; its unit is that of the world's.
  // Of [delta, delta_t], 6x6 row-major, as in PoseHypothesis; the cameras' uncertainty is in it. Of
  // its world the first photo is held where nothing else ties it: its translation, or the length
  // of that, and its turn about the plane's normal. What nothing speaks of in any photo (the
  // translation where lines alone are seen) has no variance either.
  std::array<double, 36> covariance{};
  double rms_px = 0.0;  // Of the inlier residuals, pixels.
  double misfit = 0.0;  // Median chi^2 of its features by residual; 1 or less.
  // Of its lines, on a grid of equal squares. Where there are any these are its world: the unit is
  // a square, the origin where two lines meet, the axes run along lines.
  int num_grid_lines = 0;
  std::vector<std::string> left_out;        // Features, as PoseHypothesis::left_out.
  std::vector<AdjustedResidual> residuals;  // Of the points that count.
};

// A circle of a world.
struct AdjustedCircle {
  std::string id;  // CircleObservation::id; that of one photo, where they differ.
  int photo = -1;  // Of which world: -1 the one of all photos, else that photo's.
  // World frame; the normal is a unit vector.
  Eigen::Vector3d center = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::UnitZ();
  double radius = 0.0;  // In the world's unit.
};

// A pencil's direction in a world, without sense.
struct AdjustedDirection {
  std::string id;  // PencilObservation::id.
  // -1: of the world of all photos; else of that photo alone, in its world. Where photos share a
  // world but match circles by place, and no poses were given, that is the world of all.
  int photo = -1;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  // Unit.
};

// Where the world lies in the frame of given poses: X_given = scale * rotation * X + translation.
struct GivenFrame {
  double scale = 1.0;  // Their units for one of the world's: for a metre, where that is metric.
  // From the world's frame to the given one.
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  // In the unit of the given poses.
  double log_scale_sigma = 0.0;                           // Meaningful where the world is metric.
};

// What AdjustPhotos returns.
struct AdjustedPhotos {
  Status status;                        // Not ok: no camera, and why.
  std::vector<AdjustedCamera> cameras;  // In the order in which photos name them (Camera::id).
  std::vector<AdjustedPhoto> photos;    // One for each of the input.
  std::vector<AdjustedCircle> circles;  // Of all worlds.
  std::vector<AdjustedDirection> directions;  // Of all worlds.
  std::optional<GivenFrame> given;            // Where poses were given.
  bool rigid = false, metric = false;  // Whether there is one world; whether its unit is known.
  std::vector<std::string> notes;      // What was left out or decided, and why, in words.
};

// Circles of the world's plane, their centres and radii, and pencils take part; known lengths and
// angles, drawn axes and diameters serve the poses to start from, and no more.
//
// Photos with the same Camera::id share a camera, which must be the same in all of them: the one
// known beforehand, to which that of a photo is set back (stated_focal_px, found_k1). Where its
// focal length is not known to 10 %, starts are sought over the prior of focal length and first
// distortion coefficient, by how well the closed forms then explain all photos. EstimatePose gives
// the poses. Circles of one world are matched by their ids, where they lie alike under these, else
// by how they lie. A radius that several photos state is one statement, as well known as the one
// that knows it best; where they state different ones of one id, that is refused. Photos and
// features that contradict the rest as a whole are left out. Never throws, never returns NaN.
// Thread-safe.
AdjustedPhotos AdjustPhotos(const std::vector<Observations>& photos,
                            const AdjustOptions& options = {});

}  // namespace circline

#endif  // CIRCLINE_REFINE_ADJUST_PHOTOS_H_
