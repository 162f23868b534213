// Whatever doubles come in - random, huge, tiny, subnormal, NaN, infinite, repeated, collinear - a
// free function that reports success returns finite numbers, and none crashes. As many calls as
// CIRCLINE_FUZZ_CALLS says, or two seconds' worth.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/circular_points.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/conic_fit.h"
#include "circline/estimators/line.h"
#include "circline/estimators/line_pose.h"
#include "circline/estimators/metrology.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/vanishing_point.h"
#include "tests/estimators/fuzzer.h"
#include "tests/trials.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

template <typename Derived>
bool Finite(const Eigen::MatrixBase<Derived>& m) {
  return m.allFinite();
}
bool Finite(double x) { return std::isfinite(x); }
bool Finite(const ConicFit& fit) {
  return Finite(fit.conic) && Finite(fit.Covariance()) && Finite(fit.rms_px);
}

// One call of one function each: false where it reported success on numbers that are not finite.

bool FuzzConic(Fuzzer* f) {
  Matrix3d C;
  if (NormalizeEllipse(f->Conic(), &C) && !Finite(C)) return false;
  Ellipse e;
  if (!ConicToEllipse(f->Conic(), &e)) return true;
  return Finite(e.center) && Finite(e.a) && Finite(e.b) && Finite(e.angle) && e.b > 0.0;
}

bool FuzzCirclePoses(Fuzzer* f) {
  std::array<CirclePose, 2> poses;
  const int count = CirclePoses(f->Conic(), &poses);
  bool good = count >= 0 && count <= 2;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    good = good && std::abs(poses[i].normal.norm() - 1.0) < 1e-12 && Finite(poses[i].center);
  }
  return good;
}

bool FuzzFivePoints(Fuzzer* f) {
  std::array<Vector2d, 5> x;
  for (Vector2d& v : x) v = f->Vector2();
  if (f->random.Uniform() < 0.3) x[3] = x[1];
  if (f->random.Uniform() < 0.3) x[4] = 0.5 * (x[0] + x[2]);
  Matrix3d C;
  return !ConicFromFivePoints(x, &C) || Finite(C);
}

bool FuzzFitConicDirect(Fuzzer* f) {
  Matrix3d C;
  return !FitConicDirect(f->Points(), &C).ok() || Finite(C);
}

bool FuzzFitConic(Fuzzer* f) {
  const std::vector<CalibratedPoint> points = f->Points();
  std::vector<double> weights(points.size());
  for (double& w : weights) w = std::abs(f->Number());
  ConicFit fit;
  return !FitConic(points, 1.0, &fit, f->random.Uniform() < 0.5 ? &weights : nullptr).ok() ||
         Finite(fit);
}

bool FuzzRefineConic(Fuzzer* f) {
  const std::vector<CalibratedPoint> points = f->Points();
  const double sigma = f->Number();
  ConicFit fit;
  return !RefineConic(points, sigma, f->Conic(), &fit).ok() || Finite(fit);
}

bool FuzzLines(Fuzzer* f) {
  LineFit line;
  if (FitLine(f->Points(), 1.0, &line).ok() &&
      !(Finite(line.line) && Finite(line.covariance) && Finite(line.rms_px))) {
    return false;
  }
  std::vector<LineFit> lines(static_cast<std::size_t>(f->random.UniformInt(5)));
  for (LineFit& l : lines) {
    if (f->random.Uniform() < 0.7 || &l == &lines.front()) FitLine(f->Points(), 1.0, &line);
    l = line;
  }
  VanishingPointFit fit;
  return !FitVanishingPoint(lines, &fit).ok() || (Finite(fit.direction) && Finite(fit.covariance));
}

bool FuzzDirections(Fuzzer* f) {
  const Vector3d x = f->Vector3();
  const Vector3d y = f->random.Uniform() < 0.2 ? Vector3d(f->Number() * x) : f->Vector3();
  Matrix3d R;
  if (RotationFromDirections(x, y, &R) && !Finite(R)) return false;
  const double x_variance = f->Number(), y_variance = f->Number();
  if (RotationFromOrthogonalDirections(x, x_variance, y, y_variance, &R) && !Finite(R)) {
    return false;
  }
  const Vector3d from = f->Vector3(), to = f->Vector3();
  MovesAlong(x, y, from, to);
  return true;
}

bool FuzzCircularPoints(Fuzzer* f) {
  CircularPoints m;
  if (CircularPointsOfPlane(f->Vector3(), &m) && !(Finite(m.real) && Finite(m.imag))) return false;
  if (f->random.Uniform() < 0.5) m = {f->Vector3(), f->Vector3()};
  Vector3d v;
  Matrix3d R;
  FrameRotation frame;
  if (VanishingLine(m, &v) && !Finite(v)) return false;
  const Vector3d x = f->Vector3(), y = f->Vector3();
  const double x_variance = f->Number(), y_variance = f->Number();
  if (RotationFromFrame(m, x, x_variance, y, y_variance, &frame) &&
      !(Finite(frame.rotation) && Finite(frame.deviation))) {
    return false;
  }
  if (HarmonicConjugate(m, f->Vector3(), &v) && !Finite(v)) return false;
  if (RotationFromCircularPoints(m, f->Vector3(), &R) && !Finite(R)) return false;
  const Vector3d a = f->Vector3(), b = f->Vector3();
  return !std::isnan(HarmonicDeviation(m, a, b));
}

bool FuzzCircleFrame(Fuzzer* f) {
  std::array<CircularPoints, 2> points;
  const Matrix3d conic = f->Conic();
  int count = CircularPointsOfConic(conic, &points);
  bool good = true;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    good = good && Finite(points[i].real) && Finite(points[i].imag);
  }
  std::array<FrameRotation, 2> rotations;
  const Vector3d x_line = f->Vector3(), y_line = f->Vector3();
  count = RotationsFromCircleAndFrame(conic, x_line, y_line, &rotations);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    good = good && Finite(rotations[i].rotation) && Finite(rotations[i].deviation);
  }
  return good;
}

bool FuzzBackProjection(Fuzzer* f) {
  const CameraPose pose = f->Pose();
  WorldRay ray;
  WorldPlane plane;
  WorldCone cone;
  Vector2d point;
  Vector3d line;
  Ellipse e;
  Matrix3d H;
  if (RayOfPoint(pose, f->Vector3(), &ray) && !(Finite(ray.origin) && Finite(ray.direction))) {
    return false;
  }
  if (PlaneOfLine(pose, f->Vector3(), &plane) && !(Finite(plane.normal) && Finite(plane.offset))) {
    return false;
  }
  if (ConeOfConic(pose, f->Conic(), &cone) && !(Finite(cone.apex) && Finite(cone.form))) {
    return false;
  }
  if (PointOnPlane(pose, f->Vector3(), &point) && !Finite(point)) return false;
  if (LineOnPlane(pose, f->Vector3(), &line) && !Finite(line)) return false;
  if (ConicOnPlane(pose, f->Conic(), &e) &&
      !(Finite(e.center) && Finite(e.a) && Finite(e.b) && Finite(e.angle))) {
    return false;
  }
  return !RectifyingHomography(pose, &H) || Finite(H);
}

bool FuzzMetrology(Fuzzer* f) {
  const CameraPose pose = f->Pose();
  const SegmentPair segments = {f->Vector3(), f->Vector3(), f->Vector3(), f->Vector3()};
  double value;
  if (LengthOnPlane(pose, segments[0], segments[1], &value) && !Finite(value)) return false;
  if (LengthRatio(pose, segments, &value) && !Finite(value)) return false;
  if (AngleOnPlane(pose, segments, &value) && !Finite(value)) return false;
  const std::vector<Vector3d> corners(segments.begin(), segments.end());
  if (AreaOnPlane(pose, corners, &value) && !Finite(value)) return false;
  if (HeightOverPlane(pose, segments[0], segments[1], &value) && !Finite(value)) return false;

  PoseHypothesis h;
  h.cam_from_world = pose;
  for (double& c : h.covariance) c = f->Number();
  for (double& c : h.focal_covariance) c = f->Number();
  h.focal_sigma = f->Number();
  Camera camera;
  camera.fx = camera.fy = 1.0;
  std::array<Vector2d, 4> points;
  for (Vector2d& p : points) p = f->Vector2();
  Measurement m;
  const double sigma = f->Number();
  if (LengthRatio(h, camera, points, sigma, &m) && !(Finite(m.value) && Finite(m.sigma))) {
    return false;
  }
  return !AngleOnPlane(h, camera, points, sigma, &m) || (Finite(m.value) && Finite(m.sigma));
}

bool FuzzCamera(Fuzzer* f) {
  Camera camera;
  camera.model = static_cast<CameraModel>(f->random.UniformInt(3));
  camera.fx = std::pow(10.0, f->random.Uniform(-3.0, 6.0));
  camera.fy = std::pow(10.0, f->random.Uniform(-3.0, 6.0));
  camera.cx = 300.0 * f->Number();
  camera.cy = 200.0 * f->Number();
  for (double& d : camera.distortion) d = 0.1 * f->Number();
  if (camera.model == CameraModel::kPinhole) camera.distortion.fill(0.0);
  if (!camera.Validate().ok()) return true;  // The functions ask for a valid one.
  CalibratedPoint p;
  if (PixelToCalibrated(camera, 500.0 * f->Vector2(), &p)) {
    for (double entry : p.x_from_pixel) {
      if (!Finite(entry)) return false;
    }
    if (!Finite(p.x)) return false;
  }
  Vector2d pixel;
  return !CameraToPixel(camera, f->Vector3(), &pixel) || Finite(pixel);
}

TEST(FuzzTest, NothingThatSucceedsIsNotFinite) {
  struct Case {
    const char* name;
    bool (*call)(Fuzzer*);
  };
  constexpr Case kCases[] = {{"conic", FuzzConic},
                             {"circle poses", FuzzCirclePoses},
                             {"five points", FuzzFivePoints},
                             {"direct conic fit", FuzzFitConicDirect},
                             {"conic fit", FuzzFitConic},
                             {"conic refinement", FuzzRefineConic},
                             {"lines", FuzzLines},
                             {"directions", FuzzDirections},
                             {"circular points", FuzzCircularPoints},
                             {"circle and frame", FuzzCircleFrame},
                             {"back-projection", FuzzBackProjection},
                             {"metrology", FuzzMetrology},
                             {"camera", FuzzCamera}};
  const int calls = Trials("CIRCLINE_FUZZ_CALLS", 2000000) / static_cast<int>(std::size(kCases));
  std::uint64_t seed = 1;
  for (const Case& c : kCases) {
    Fuzzer fuzzer(seed++);
    int bad = 0;
    for (int i = 0; i < calls; ++i) {
      fuzzer.NextInput();
      if (!c.call(&fuzzer)) ++bad;
    }
    EXPECT_EQ(bad, 0) << c.name << ", of " << calls << " calls";
  }
}

}  // namespace
}  // namespace circline
