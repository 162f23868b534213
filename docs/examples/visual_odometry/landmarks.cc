#include "landmarks.h"

#include <cmath>
#include <cstdint>
#include <utility>

#include "circline/estimators/camera.h"
#include "circline/estimators/point_noise.h"
#include "circline/refine/estimate_pose.h"

using namespace circline;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kMatchPx = 12.0;   // How far a circle moves from one frame to the next, at most.
constexpr double kMatchRad = 0.01;  // How far off a line may run from where its direction points.

constexpr std::size_t kFewestCircles = 5;  // To start from: the map never grows.

// Of the centre of the ellipse; false where none is fitted.
bool CenterPx(const Camera& camera, const CircleObservation& circle, Vector2d* pixel) {
  Ellipse ellipse;  // Calibrated coordinates.
  return circle.fit && ConicToEllipse(circle.fit->conic, &ellipse) &&
         CameraToPixel(camera, ellipse.center.homogeneous(), pixel);
}

// Points with noise of their own and a part that neighbours share. Under the loss a point counts by
// both; what all of them count together is their weight, which NoiseModel gives for points with
// noise of their own alone.
ImagePoints MakePoints(const Camera& camera, const std::vector<Vector2d>& points,
                       const std::vector<std::uint8_t>& inliers, double own_px, double shared_px,
                       double weight) {
  ImagePoints::Options options;
  options.loss = LossType::kCauchy;  // Of each point, inside the block.
  options.sigma_px = std::hypot(own_px, shared_px);
  options.weight = weight * std::pow(options.sigma_px / own_px, 2);
  return ImagePoints(camera, points, inliers, options);
}

// A circle belongs to the landmark whose centre should be seen nearest to its own. (The image of a
// circle's centre is not the ellipse's: a pixel or so, here.)
Circle* MatchCircle(const Camera& camera, const CircleObservation& seen, const Frame& frame,
                    Map* map) {
  Circle* match = nullptr;
  double nearest = kMatchPx;
  Vector2d at, expected;
  if (!CenterPx(camera, seen, &at)) return nullptr;
  for (Circle& circle : map->circles) {
    const Vector3d X = frame.rotation * circle.center + frame.translation;
    if (!CameraToPixel(camera, X, &expected) || (at - expected).norm() > nearest) continue;
    nearest = (at - expected).norm();
    match = &circle;
  }
  return match;
}

// A line belongs to the direction that lies nearest to its plane through the camera.
Vector3d* MatchDirection(const LineObservation& seen, const Frame& frame, Map* map) {
  Vector3d* match = nullptr;
  double nearest = kMatchRad;
  for (Vector3d& direction : map->directions) {
    const double off = std::abs(seen.fit->line.dot(frame.rotation * direction));
    if (off > nearest) continue;
    nearest = off;
    match = &direction;
  }
  return match;
}

void AddCircle(const Camera& camera, const CircleObservation& seen, double own_px, Circle* circle,
               Frame* frame) {
  const NoiseModel noise;
  auto cost = std::make_unique<CircleContourCost>(
      MakePoints(camera, seen.points, seen.inliers, own_px, noise.contour_px,
                 noise.ContourWeight(own_px, seen.points, seen.inliers)),
      CircleContourCost::Blocks());
  frame->features.push_back(
      {std::move(cost),
       {frame->q(), frame->t(), circle->center.data(), circle->normal.data(), &circle->radius}});
}

void AddLine(const Camera& camera, const LineObservation& seen, double own_px, Vector3d* direction,
             Frame* frame) {
  const NoiseModel noise;
  DirectionLineCost::Options options;
  options.direction_sigma = noise.line_direction_rad;  // Edges are not quite parallel.
  auto cost = std::make_unique<DirectionLineCost>(
      MakePoints(camera, seen.points, seen.inliers, own_px, noise.line_px,
                 noise.LineWeight(own_px, seen.points, seen.inliers)),
      seen.fit->line, options);
  std::array<double, 2> line = {};
  const double* at[] = {frame->q(), direction->data()};
  if (!cost->Start(at, line.data())) return;
  frame->lines.push_back(line);
  frame->features.push_back(
      {std::move(cost), {frame->q(), direction->data(), frame->lines.back().data()}});
}

}  // namespace

bool StartMap(const Observations& seen, Frame* frame, Map* map) {
  const PoseEstimate estimate = EstimatePose(seen);
  if (!estimate.status.ok()) return false;
  const PoseHypothesis& best = estimate.hypotheses.front();
  if (!best.metric || best.probability < 0.95 || best.circles.size() < kFewestCircles) return false;
  const Vector3d& t = best.cam_from_world.translation;
  const Matrix3d world_from_cam = best.cam_from_world.rotation.transpose();
  frame->rotation = best.cam_from_world.rotation;
  frame->translation = t;
  for (const CircleEstimate& c : best.circles) {
    const int i = FindCircle(seen, c.id);
    const bool is_disc = seen.circles[static_cast<std::size_t>(i)].radius > 0.0;
    map->circles.insert(is_disc ? map->circles.begin() : map->circles.end(),
                        {world_from_cam * (c.center - t), world_from_cam * c.normal, c.radius});
  }
  for (const PencilEstimate& p : best.pencils)
    map->directions.push_back(world_from_cam * p.direction);
  return true;
}

void MatchFeatures(const Observations& seen, Map* map, Frame* frame) {
  const PointNoise own_px = MeasurePointNoise(seen, NoiseModel());
  for (std::size_t i = 0; i < seen.circles.size(); ++i) {
    Circle* circle = MatchCircle(seen.camera, seen.circles[i], *frame, map);
    if (circle != nullptr)
      AddCircle(seen.camera, seen.circles[i], own_px.circles[i], circle, frame);
  }
  for (std::size_t p = 0; p < seen.pencils.size(); ++p) {
    for (std::size_t k = 0; k < seen.pencils[p].lines.size(); ++k) {
      const LineObservation& line = seen.pencils[p].lines[k];
      Vector3d* direction = line.fit ? MatchDirection(line, *frame, map) : nullptr;
      if (direction != nullptr) AddLine(seen.camera, line, own_px.lines[p][k], direction, frame);
    }
  }
}
