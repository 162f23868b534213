#include "apps/reconstruct/model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "apps/compare/pixel_ellipse.h"
#include "apps/compare/plane_evidence.h"
#include "circline/estimators/metrology.h"

namespace circline::apps {
namespace {

constexpr double kNearShare = 0.02;  // Ends so near, as a share of the photo's width, are one.
constexpr double kParallelCosine = 0.999;  // Of planes that count as parallel.

struct View {
  const cv::Mat& photo;
  const Camera& camera;
  const CameraPose& pose;

  bool ToPlane(const Eigen::Vector2d& pixel, Eigen::Vector3d* world) const {
    CalibratedPoint ray;
    Eigen::Vector2d point;
    if (!PixelToCalibrated(camera, pixel, &ray)) return false;
    if (!PointOnPlane(pose, ray.Homogeneous(), &point)) return false;
    *world = {point.x(), point.y(), 0.0};
    return true;
  }
};

// The photo as seen on the patch; grey where the photo does not show it.
cv::Mat Texture(const View& view, const Patch& patch, double pixels_per_unit) {
  const auto pixels = [&](const Eigen::Vector3d& side) {
    return std::clamp(static_cast<int>(std::lround(side.norm() * pixels_per_unit)), 2, 8192);
  };
  cv::Mat map(pixels(patch.v), pixels(patch.u), CV_32FC2);
  for (int row = 0; row < map.rows; ++row) {
    for (int column = 0; column < map.cols; ++column) {
      const double s = (column + 0.5) / map.cols, t = 1.0 - (row + 0.5) / map.rows;
      const Eigen::Vector3d world = patch.corner + s * patch.u + t * patch.v;
      Eigen::Vector2d pixel(-1e6, -1e6);
      const Eigen::Vector3d seen = view.pose.rotation * world + view.pose.translation;
      if (!CameraToPixel(view.camera, seen, &pixel)) pixel.setConstant(-1e6);
      map.at<cv::Vec2f>(row, column) = {static_cast<float>(pixel.x()),
                                        static_cast<float>(pixel.y())};
    }
  }
  cv::Mat texture;
  cv::remap(view.photo, texture, map, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_CONSTANT,
            cv::Scalar::all(128));
  return texture;
}

Patch PlanePatch(const Eigen::AlignedBox2d& box) {
  return {"plane",
          {box.min().x(), box.min().y(), 0.0},
          {box.sizes().x(), 0.0, 0.0},
          {0.0, box.sizes().y(), 0.0},
          false,
          {}};
}

// The square about each circle on a plane parallel to the world's; those on it are lifted by a hair
// towards the camera, lest the plane show through.
std::vector<Patch> DiscPatches(const PoseHypothesis& hypothesis, double lift) {
  const CameraPose& pose = hypothesis.cam_from_world;
  std::vector<Patch> patches;
  for (const CircleEstimate& circle : hypothesis.circles) {
    if (std::abs(circle.normal.dot(pose.rotation.col(2))) < kParallelCosine) continue;
    Eigen::Vector3d center = pose.rotation.transpose() * (circle.center - pose.translation);
    const double side = (pose.rotation.transpose() * pose.translation).z() < 0.0 ? 1.0 : -1.0;
    if (std::abs(center.z()) < lift) center.z() += side * lift;
    const double r = circle.radius;
    patches.push_back({"circle_" + FileSafe(circle.id),
                       center - Eigen::Vector3d(r, r, 0.0),
                       {2.0 * r, 0.0, 0.0},
                       {0.0, 2.0 * r, 0.0},
                       true,
                       {}});
  }
  return patches;
}

// ---- What stands on the plane ----

struct PlaneSegment {
  std::string name;
  Segment ends;
};

std::vector<PlaneSegment> SegmentsOf(const Observations& resolved, bool upright) {
  std::vector<PlaneSegment> segments;
  for (const PencilObservation& pencil : resolved.pencils) {
    const bool is_upright = pencil.direction == PencilDirection::kZ;
    if (is_upright != upright) continue;
    if (!upright && pencil.plane != resolved.frame.plane) continue;
    for (std::size_t i = 0; i < pencil.lines.size(); ++i) {
      segments.push_back({pencil.id + "_" + std::to_string(i), EndPoints(pencil.lines[i])});
    }
  }
  return segments;
}

// Distance to the nearest end of a segment of the plane.
double DistanceToEnds(const Eigen::Vector2d& pixel, const std::vector<PlaneSegment>& segments) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const PlaneSegment& segment : segments) {
    for (const Eigen::Vector2d& end : segment.ends) {
      nearest = std::min(nearest, (end - pixel).norm());
    }
  }
  return nearest;
}

std::vector<UprightEdge> UprightEdges(const View& view, const Observations& resolved) {
  const std::vector<PlaneSegment> on_plane = SegmentsOf(resolved, false);
  std::vector<UprightEdge> edges;
  for (const PlaneSegment& segment : SegmentsOf(resolved, true)) {
    UprightEdge edge;
    edge.name = segment.name;
    edge.foot_px = segment.ends[0];
    edge.top_px = segment.ends[1];
    if (DistanceToEnds(edge.top_px, on_plane) < DistanceToEnds(edge.foot_px, on_plane)) {
      std::swap(edge.foot_px, edge.top_px);
    }
    if (DistanceToEnds(edge.foot_px, on_plane) > kNearShare * view.photo.cols) continue;
    CalibratedPoint foot, top;
    if (!PixelToCalibrated(view.camera, edge.foot_px, &foot) ||
        !PixelToCalibrated(view.camera, edge.top_px, &top) ||
        !view.ToPlane(edge.foot_px, &edge.foot) ||
        !HeightOverPlane(view.pose, foot.Homogeneous(), top.Homogeneous(), &edge.height)) {
      continue;
    }
    edges.push_back(std::move(edge));
  }
  return edges;
}

const UprightEdge* EdgeAt(const std::vector<UprightEdge>& edges, const Eigen::Vector2d& pixel,
                          double near_px) {
  for (const UprightEdge& edge : edges) {
    if ((edge.foot_px - pixel).norm() < near_px) return &edge;
  }
  return nullptr;
}

// As high as its two edges on average.
std::vector<Patch> Faces(const View& view, const Observations& resolved,
                         const std::vector<UprightEdge>& edges) {
  std::vector<Patch> faces;
  for (const PlaneSegment& segment : SegmentsOf(resolved, false)) {
    const double near_px = kNearShare * view.photo.cols;
    const UprightEdge* a = EdgeAt(edges, segment.ends[0], near_px);
    const UprightEdge* b = EdgeAt(edges, segment.ends[1], near_px);
    if (a == nullptr || b == nullptr || a == b) continue;
    const double height = 0.5 * (a->height + b->height);
    faces.push_back({"face_" + FileSafe(segment.name),
                     a->foot,
                     b->foot - a->foot,
                     {0.0, 0.0, height},
                     false,
                     {}});
  }
  return faces;
}

}  // namespace

std::string FileSafe(const std::string& name) {
  std::string safe = name;
  for (char& c : safe) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '.';
    if (!plain) c = '_';
  }
  return safe;
}

Model BuildModel(const cv::Mat& photo, const Observations& observations,
                 const PoseHypothesis& hypothesis, const ModelOptions& options) {
  Model model;
  const View view{photo, observations.camera, hypothesis.cam_from_world};
  Eigen::AlignedBox2d box = EvidenceOnPlane(observations, view.camera, view.pose);
  const double longest = box.isEmpty() ? 0.0 : box.sizes().maxCoeff();
  if (!(longest > 0.0) || !std::isfinite(longest)) return model;
  box.min().array() -= options.margin * longest;
  box.max().array() += options.margin * longest;
  model.size = box.diagonal().norm();
  const Observations resolved = ResolveWorld(observations);
  model.edges = UprightEdges(view, resolved);
  model.patches.push_back(PlanePatch(box));
  for (Patch& patch : DiscPatches(hypothesis, 1e-3 * model.size)) {
    model.patches.push_back(std::move(patch));
  }
  for (Patch& patch : Faces(view, resolved, model.edges)) model.patches.push_back(std::move(patch));
  const double pixels_per_unit = options.texture_px / box.sizes().maxCoeff();
  for (Patch& patch : model.patches) patch.texture = Texture(view, patch, pixels_per_unit);
  return model;
}

}  // namespace circline::apps
