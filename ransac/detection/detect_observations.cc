#include "circline/ransac/detection/detect_observations.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "circline/ransac/detection/detect_ellipses.h"
#include "circline/ransac/detection/detect_lines.h"
#include "circline/ransac/detection/edge_shift.h"
#include "circline/ransac/detection/edges.h"
#include "circline/ransac/detection/ellipse_evidence.h"
#include "circline/ransac/detection/observe_evidence.h"
#include "circline/ransac/detection/straight_lens.h"
#include "circline/ransac/detection/structure_focal.h"

namespace circline {
namespace {

using Eigen::Vector2d;

// A photo has no more directions worth telling apart.
constexpr int kMaxPencils = 100;

std::vector<CircleEvidence> MakeCircles(const EdgeMap& edges,
                                        const std::vector<DetectedEllipse>& ellipses,
                                        const NoiseModel& noise) {
  std::vector<CircleEvidence> circles;
  for (const DetectedEllipse& ellipse : ellipses) {
    CircleEvidence circle;
    FillCircle(edges, ellipse, noise, &circle.observation);
    if (ellipse.concentric >= 0) {
      circle.observation.concentric = "g" + std::to_string(ellipse.concentric);
    }
    circle.support_px = ellipse.length_px;
    circle.num_normals = CircleNormals(*circle.observation.fit, &circle.normals);
    if (circle.num_normals > 0) circles.push_back(std::move(circle));
  }
  return circles;
}

Status CollectEvidence(const EdgeMap& edges, const Camera& camera, const DetectionOptions& options,
                       PhotoEvidence* evidence) {
  std::vector<DetectedEllipse> ellipses;
  Status status = DetectEllipses(edges, camera, ToEllipseOptions(options), &ellipses);
  if (!status.ok()) return status;
  const std::vector<std::uint8_t> on_ellipses = EllipsePoints(edges, ellipses);
  evidence->num_ellipses = ellipses.size();
  ellipses.resize(std::min(ellipses.size(), static_cast<std::size_t>(options.max_circles)));
  evidence->circles = MakeCircles(edges, ellipses, options.noise_model);
  if (options.max_pencils == 0) return Status::Ok();
  LineOptions line_options;
  line_options.min_length_px = options.min_segment_length_px;
  status =
      DetectLines(edges, camera, line_options, &evidence->lines, &on_ellipses, &evidence->bent);
  if (!status.ok()) return status;
  UndoEdgeShift(edges, camera, &evidence->lines);
  return Status::Ok();
}

// What is seen of a photo through a camera whose focal length is a guess.
struct Look {
  double log_focal;  // Of fx.
  PhotoEvidence evidence;
  LikelyFocal likeliest;
};

// The same focal lengths whatever the guess.
double OnSteps(double log_focal) { return kFocalStep * std::round(log_focal / kFocalStep); }

// Of a usual lens, or as near to it as what is known of the focal length lets it be: what the photo
// shows does not depend on who guesses.
double FirstLogFocal(const Camera& camera, const CameraSigma& sigma) {
  constexpr double kUsual = 0.8660254;  // Over the longer side of the photo: 60 degrees.
  const double stated = std::log(camera.fx);
  const int longer = std::max(camera.width, camera.height);
  if (longer == 0) return stated;
  return std::clamp(std::log(kUsual * longer), stated - sigma.log_focal, stated + sigma.log_focal);
}

// The focal length at which its structure is likeliest.
Status Judge(const Observations& observations, const DetectionOptions& options, double diagonal_px,
             Look* look) {
  std::vector<DetectedPencil> pencils;
  if (options.max_pencils > 0) {
    const Status status = DetectPencilsApart(look->evidence.lines, options.max_pencils,
                                             options.seed, &pencils, diagonal_px);
    if (!status.ok()) return status;
  }
  const double prior = StatedLogFocal(observations);
  look->likeliest =
      LikeliestFocal(look->evidence, pencils, observations.camera, options.noise_model.camera,
                     prior, diagonal_px, observations.found_k1);
  return Status::Ok();
}

// By how much of its distance to the middle such a k1 moves a corner of the photo.
double BendAtCorner(double k1, const Camera& camera) {
  const Vector2d corner(camera.width / camera.fx, camera.height / camera.fy);
  return std::abs(k1) * (0.5 * corner).squaredNorm();
}

// Looks until the photo's lines are straight through the lens that is looked through: one that
// bends breaks them, so each look finds longer ones. Where they do not clearly say so it is the one
// that is known beforehand.
Status LookForLens(const EdgeMap& edges, const DetectionOptions& options, Camera* camera,
                   PhotoEvidence* evidence) {
  constexpr int kMostLooks = 3;
  // Logarithm of how much likelier it is: 20 to 1. Of 3, 6 and 10, on circles-discocal-tir, where
  // 10 leaves three of seven photos as they are, with dots and ChArUco boards beside it.
  constexpr double kClearly = 3.0;
  // Less breaks no lines, and the estimate finds it.
  constexpr double kMatters = 0.05;
  constexpr double kSameK1 = 0.01;
  Status status = CollectEvidence(edges, *camera, options, evidence);
  if (camera->model != CameraModel::kOpenCV || !options.noise_model.camera.IsLensOpen())
    return status;
  const double stated_k1 = camera->distortion[0];
  for (int k = 1; k < kMostLooks && status.ok(); ++k) {
    const LikelyLens likeliest = LikeliestLens(*evidence, *camera, options.noise_model, stated_k1);
    const double k1 =
        likeliest.gain > kClearly && BendAtCorner(likeliest.k1 - stated_k1, *camera) > kMatters
            ? likeliest.k1
            : stated_k1;
    if (std::abs(k1 - camera->distortion[0]) < kSameK1) break;
    camera->distortion[0] = k1;
    *evidence = PhotoEvidence();
    status = CollectEvidence(edges, *camera, options, evidence);
  }
  return status;
}

// The camera at the focal length at which the photo's structure is likeliest, and the evidence seen
// through that: what is found is straight and round at one focal length, so another one is looked
// through where it is clearly likelier. Where looks lead back to an earlier one, the one that is
// contradicted least.
Status LookForFocal(const EdgeMap& edges, const DetectionOptions& options, double diagonal_px,
                    PhotoEvidence* evidence, Observations* observations) {
  constexpr std::size_t kMostLooks = 4;
  constexpr double kClearly = 0.5;  // Logarithm of how much likelier it is.
  const CameraSigma& sigma = options.noise_model.camera;
  Camera& camera = observations->camera;
  observations->stated_focal_px = camera.fx;
  const double stated_k1 = camera.distortion[0];
  const auto look_through = [&](double log_focal) {
    SetFocal(log_focal - std::log(camera.fx), sigma, &camera);
    observations->found_k1 = camera.distortion[0] - stated_k1;
  };
  double next = OnSteps(FirstLogFocal(camera, sigma));
  std::vector<Look> looks;
  const auto is_next = [&next](const Look& look) {
    return std::abs(look.log_focal - next) < 0.5 * kFocalStep;
  };
  while (looks.size() < kMostLooks && std::none_of(looks.begin(), looks.end(), is_next)) {
    const bool is_first = looks.empty();
    looks.push_back({next, {}, {}});
    Look& look = looks.back();
    look_through(next);
    Status status = is_first ? LookForLens(edges, options, &camera, &look.evidence)
                             : CollectEvidence(edges, camera, options, &look.evidence);
    observations->found_k1 = camera.distortion[0] - stated_k1;
    if (status.ok()) status = Judge(*observations, options, diagonal_px, &look);
    if (!status.ok()) return status;
    if (look.likeliest.gain > kClearly) next = OnSteps(next + look.likeliest.log_focal);
  }
  const auto best = std::min_element(looks.begin(), looks.end(), [](const Look& a, const Look& b) {
    return a.likeliest.gain < b.likeliest.gain;
  });
  look_through(best->log_focal);
  *evidence = std::move(best->evidence);
  return Status::Ok();
}

}  // namespace

Status DetectionOptions::Validate() const {
  if (!(min_ellipse_axis_px > 0.0) || !std::isfinite(min_ellipse_axis_px))
    return Status::Invalid("min_ellipse_axis_px must be positive and finite");
  if (!(min_arc_deg > 0.0 && min_arc_deg <= 360.0)) {
    return Status::Invalid("min_arc_deg must be in (0, 360]");
  }
  if (!(min_segment_length_px > 0.0) || !std::isfinite(min_segment_length_px)) {
    return Status::Invalid("min_segment_length_px must be positive and finite");
  }
  if (max_circles < 0) return Status::Invalid("max_circles must not be negative");
  if (max_pencils < 0 || max_pencils > kMaxPencils) {
    return Status::Invalid("max_pencils must be from 0 to " + std::to_string(kMaxPencils));
  }
  if (!(max_shared_plane_deg > 0.0)) {
    return Status::Invalid("max_shared_plane_deg must be positive");
  }
  return noise_model.Validate();
}

Status DetectObservations(const cv::Mat& image, const Camera& camera,
                          const DetectionOptions& options, Observations* observations) {
  *observations = Observations();
  observations->camera = camera;
  Status status = CheckDetectionInput(image, camera, options);
  if (!status.ok()) return status;
  cv::Mat gray;
  status = ToGray(image, &gray);
  if (!status.ok()) return status;
  EdgeMap edges;
  status = DetectEdges(gray, EdgeOptions(), &edges);
  if (!status.ok()) return status;
  PhotoEvidence evidence;
  const double diagonal_px = DiagonalPx(image.cols, image.rows);
  status = options.noise_model.camera.IsWide()
               ? LookForFocal(edges, options, diagonal_px, &evidence, observations)
               : CollectEvidence(edges, camera, options, &evidence);
  return status.ok() ? ObserveEvidence(options, diagonal_px, &evidence, observations) : status;
}

Status DetectCircleInRoi(const cv::Mat& image, const Camera& camera, const cv::Rect& roi,
                         const DetectionOptions& options, CircleObservation* circle) {
  Status status = CheckDetectionInput(image, camera, options);
  if (!status.ok()) return status;
  const cv::Rect inside = roi & cv::Rect(0, 0, image.cols, image.rows);
  if (inside.width < 3 || inside.height < 3) {
    return Status::Invalid("the rectangle does not overlap the image");
  }
  cv::Mat gray;
  status = ToGray(image(inside), &gray);
  if (!status.ok()) return status;
  // The same camera, seen from the rectangle's corner: fits are calibrated, so they stay valid.
  Camera shifted = camera;
  shifted.width = inside.width;
  shifted.height = inside.height;
  shifted.cx -= inside.x;
  shifted.cy -= inside.y;
  EdgeMap edges;
  status = DetectEdges(gray, EdgeOptions(), &edges);
  if (!status.ok()) return status;
  std::vector<DetectedEllipse> ellipses;
  status = DetectEllipses(edges, shifted, ToEllipseOptions(options), &ellipses);
  if (!status.ok()) return status;
  if (ellipses.empty()) return Status::Refused("no ellipse found inside the rectangle");
  FillCircle(edges, ellipses.front(), options.noise_model, circle);
  for (Vector2d& p : circle->points) p += Vector2d(inside.x, inside.y);
  return Status::Ok();
}

}  // namespace circline
