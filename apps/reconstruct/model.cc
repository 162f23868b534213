#include "apps/reconstruct/model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <utility>

#include "apps/common/output_file.h"
#include "apps/compare/encode.h"
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
};

Patch PlanePatch(const Eigen::AlignedBox2d& box) {
  Patch patch;
  patch.name = "plane";
  patch.corner = {box.min().x(), box.min().y(), 0.0};
  patch.u = {box.sizes().x(), 0.0, 0.0};
  patch.v = {0.0, box.sizes().y(), 0.0};
  return patch;
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
    Patch patch;
    patch.name = "circle_" + circle.id;
    patch.shape = PatchShape::kDisc;
    patch.corner = center - Eigen::Vector3d(r, r, 0.0);
    patch.u = {2.0 * r, 0.0, 0.0};
    patch.v = {0.0, 2.0 * r, 0.0};
    patches.push_back(patch);
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
    Eigen::Vector2d foot_on_plane;
    if (!PixelToCalibrated(view.camera, edge.foot_px, &foot) ||
        !PixelToCalibrated(view.camera, edge.top_px, &top) ||
        !PixelOnPlane(view.camera, view.pose, edge.foot_px, &foot_on_plane) ||
        !HeightOverPlane(view.pose, foot.Homogeneous(), top.Homogeneous(), &edge.height)) {
      continue;
    }
    edge.foot << foot_on_plane, 0.0;
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
    Patch patch;
    patch.name = "face_" + segment.name;
    patch.corner = a->foot;
    patch.u = b->foot - a->foot;
    patch.v = {0.0, 0.0, height};
    faces.push_back(patch);
  }
  return faces;
}

}  // namespace

double CenterSigmaPx(double sigma_px, std::size_t num_points) {
  return sigma_px / std::sqrt(0.5 * static_cast<double>(num_points));
}

Model PlaneModel(const cv::Mat& photo, const Observations& observations,
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
  return model;
}

void FaceTheCamera(const CameraPose& pose, Model* model) {
  const Eigen::Vector3d eye = -(pose.rotation.transpose() * pose.translation);
  for (Patch& patch : model->patches) {
    if (patch.shape == PatchShape::kMantle) continue;
    if (patch.u.cross(patch.v).dot(eye - patch.corner) >= 0.0) continue;
    // What stands has its texture upright.
    Eigen::Vector3d& side = patch.v.z() < 0.0 ? patch.v : patch.u;
    patch.corner += side;
    side = -side;
  }
}

void NamePatches(Model* model) {
  std::vector<std::string> files;
  for (const Patch& patch : model->patches) {
    std::string& file = files.emplace_back(patch.name);
    std::replace_if(
        file.begin(), file.end(),
        [](unsigned char c) { return std::isalnum(c) == 0 && c != '-' && c != '.'; }, '_');
    file += ".png";
  }
  const std::vector<std::string> stems = UniqueStems(files);
  for (std::size_t i = 0; i < stems.size(); ++i) model->patches[i].name = stems[i];
}

void TextureModel(const cv::Mat& photo, const Camera& camera, const CameraPose& pose,
                  const ModelOptions& options, Model* model) {
  std::vector<Patch> solid;  // What can hide something: a disc in a plane cannot.
  for (const Patch& patch : model->patches) {
    if (patch.shape != PatchShape::kDisc || std::abs(patch.corner.z()) > 0.01 * model->size)
      solid.push_back(patch);
  }
  for (Patch& patch : model->patches) {
    const bool is_plane = patch.name == "plane";
    patch.texture =
        PatchTexture(photo, camera, pose, patch, solid, is_plane ? options.texture_px : 0);
    patch.png = EncodePng(patch.texture);
  }
}

}  // namespace circline::apps
