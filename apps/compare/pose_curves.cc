#include "apps/compare/pose_curves.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "apps/compare/plane_evidence.h"

namespace circline::apps {
namespace {

struct WorldView {
  const Camera& camera;
  const CameraPose& pose;

  PixelCurve Line(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
    return ProjectCurve(camera, 16, 0.0, 1.0, [&](double t) {
      return (pose.rotation * ((1.0 - t) * from + t * to) + pose.translation).eval();
    });
  }
  bool Pixel(const Eigen::Vector3d& point, Eigen::Vector2d* pixel) const {
    return CameraToPixel(camera, pose.rotation * point + pose.translation, pixel);
  }
};

std::vector<PixelCurve> Grid(const WorldView& world, Eigen::AlignedBox2d box) {
  constexpr int kCells = 8;
  std::vector<PixelCurve> lines;
  const double longest = box.isEmpty() ? 0.0 : box.sizes().maxCoeff();
  if (!(longest > 0.0) || !std::isfinite(longest)) return lines;
  box.min().array() -= 0.06 * longest;
  box.max().array() += 0.06 * longest;
  const double step = box.sizes().maxCoeff() / kCells;
  for (const int axis : {0, 1}) {
    const int other = 1 - axis;
    const int count = std::max(1, static_cast<int>(std::lround(box.sizes()[axis] / step)));
    for (int i = 0; i <= count; ++i) {
      Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = Eigen::Vector3d::Zero();
      from[axis] = to[axis] = box.min()[axis] + box.sizes()[axis] * i / count;
      from[other] = box.min()[other];
      to[other] = box.max()[other];
      lines.push_back(world.Line(from, to));
    }
  }
  return lines;
}

PixelCurve VanishingLine(const Camera& camera, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d sideways =
      (std::abs(normal.z()) > 0.999 ? Eigen::Vector3d::UnitX()
                                    : Eigen::Vector3d::UnitZ().cross(normal))
          .normalized();
  const Eigen::Vector3d forward = sideways.cross(normal).normalized();
  const double sign = forward.z() < 0.0 ? -1.0 : 1.0;
  return ProjectCurve(camera, 120, -1.55, 1.55, [&](double t) {
    return (std::sin(t) * sideways + sign * std::cos(t) * forward).eval();
  });
}

// World length at which the longest visible axis takes up a sixth of the photo's height.
double AxisLength(const WorldView& world, const Eigen::Vector3d& origin, int height) {
  const double wanted = 0.17 * height;
  Eigen::Vector2d start;
  if (!world.Pixel(origin, &start)) return 0.0;
  double length = 0.1 * (world.pose.rotation * origin + world.pose.translation).norm();
  for (int pass = 0; pass < 6; ++pass) {
    double longest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector2d end;
      if (world.Pixel(origin + length * Eigen::Vector3d::Unit(axis), &end)) {
        longest = std::max(longest, (end - start).norm());
      }
    }
    if (!(longest > 0.0)) return 0.0;
    length *= std::clamp(wanted / longest, 0.25, 4.0);
  }
  return length;
}

// World axes at the origin, or where the evidence is if the origin is not in the picture.
Eigen::Vector3d AxesOrigin(const WorldView& world, const Eigen::AlignedBox2d& box, int width,
                           int height) {
  Eigen::Vector2d pixel;
  const bool visible = world.Pixel(Eigen::Vector3d::Zero(), &pixel) && pixel.x() >= 0.0 &&
                       pixel.y() >= 0.0 && pixel.x() <= width - 1 && pixel.y() <= height - 1;
  if (visible || box.isEmpty()) return Eigen::Vector3d::Zero();
  return {box.center().x(), box.center().y(), 0.0};
}

std::vector<PixelCurve> Cube(const WorldView& world, const Eigen::Vector3d& origin, double side) {
  std::vector<PixelCurve> edges;
  for (int corner = 0; corner < 8; ++corner) {
    for (int axis = 0; axis < 3; ++axis) {
      if ((corner >> axis & 1) != 0) continue;
      const Eigen::Vector3d from =
          origin + side * Eigen::Vector3d(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
      edges.push_back(world.Line(from, from + side * Eigen::Vector3d::Unit(axis)));
    }
  }
  return edges;
}

}  // namespace

PixelCurve ProjectCurve(const Camera& camera, int pieces, double t0, double t1,
                        const std::function<Eigen::Vector3d(double)>& curve) {
  PixelCurve pixels;
  pixels.reserve(static_cast<std::size_t>(pieces) + 1);
  for (int i = 0; i <= pieces; ++i) {
    const Eigen::Vector3d point = curve(t0 + (t1 - t0) * i / pieces);
    Eigen::Vector2d pixel;
    const bool seen = point.allFinite() && CameraToPixel(camera, point, &pixel);
    pixels.push_back(seen ? pixel : Eigen::Vector2d::Constant(NAN));
  }
  return pixels;
}

PoseCurves CurvesOfPose(const Observations& observations, const PoseHypothesis& hypothesis,
                        int width, int height) {
  const Camera camera = CameraOf(hypothesis, observations.camera);
  const CameraPose& pose = hypothesis.cam_from_world;
  const WorldView world{camera, pose};
  const Eigen::AlignedBox2d box = EvidenceOnPlane(observations, camera, pose);
  PoseCurves curves;
  curves.grid = Grid(world, box);
  curves.vanishing_line = VanishingLine(camera, pose.rotation.col(2));
  const Eigen::Vector3d origin = AxesOrigin(world, box, width, height);
  const double length = AxisLength(world, origin, height);
  if (!(length > 0.0) || !world.Pixel(origin, &curves.origin)) return curves;
  for (int axis = 0; axis < 3; ++axis) {
    curves.axes[static_cast<std::size_t>(axis)] =
        world.Line(origin, origin + length * Eigen::Vector3d::Unit(axis));
  }
  curves.box = Cube(world, origin, length);
  return curves;
}

}  // namespace circline::apps
