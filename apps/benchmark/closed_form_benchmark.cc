// What the closed forms cost: one core, CPU time. Rows that begin with OpenCV are a neighbour's
// answers to the same data in the same run, so that ratios survive a busy machine.
#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "apps/benchmark/rows.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/circular_points.h"
#include "circline/estimators/conic_fit.h"
#include "circline/estimators/line_pose.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/random.h"
#include "tests/basics.h"

#ifdef CIRCLINE_BENCHMARK_CALIB3D
#include <opencv2/calib3d.hpp>
#endif

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFocal = 800.0;

// A circle, the frame of its plane, and everything seen of them, without noise.
struct Scene {
  Matrix3d rotation;  // cam_from_world of that frame.
  Matrix3d conic;
  Vector3d x_line, y_line;                            // Images of the axes.
  std::array<std::array<Vector3d, 2>, 2> first_pair;  // Two parallel segments: homogeneous points.
  std::array<std::array<Vector3d, 2>, 2> second_pair;
  std::array<Vector2d, 4> square;  // Corners of a square of side 2 about the origin, calibrated.
};

std::vector<Scene> RandomScenes(std::size_t count = kScenes) {
  Random random(1);
  std::vector<Scene> scenes;
  while (scenes.size() < count) {
    CirclePose circle;
    circle.center = {random.Uniform(-3.0, 3.0), random.Uniform(-3.0, 3.0),
                     random.Uniform(5.0, 20.0)};
    circle.normal =
        Vector3d{random.Uniform(-1.0, 1.0), random.Uniform(-1.0, 1.0), -1.0}.normalized();
    if (circle.normal.dot(circle.center) >= 0.0) continue;
    const Vector3d x = circle.normal.unitOrthogonal(), y = circle.normal.cross(x);
    const auto at = [&](double u, double v) -> Vector3d { return circle.center + u * x + v * y; };
    const auto seen = [&](double u, double v) -> Vector3d { return at(u, v) / at(u, v).z(); };
    Scene s;
    s.rotation << x, y, circle.normal;
    s.conic = ProjectCircle(circle);
    s.x_line = seen(0.3, 0.2).cross(seen(1.3, 0.2));
    s.y_line = seen(0.3, 0.2).cross(seen(0.3, 1.2));
    s.first_pair = {{{seen(-1, -1), seen(1, -1)}, {seen(-1, 1), seen(1, 1)}}};
    s.second_pair = {{{seen(-1, -1), seen(-1, 1)}, {seen(1, -1), seen(1, 1)}}};
    s.square = {seen(-1, 1).head<2>(), seen(1, 1).head<2>(), seen(1, -1).head<2>(),
                seen(-1, -1).head<2>()};
    scenes.push_back(s);
  }
  return scenes;
}

// Angle between rotations, the least over the senses of the axes; NaN if it is no rotation.
double RotationError(const Matrix3d& estimate, const Matrix3d& truth) {
  const double off = (estimate.transpose() * estimate - Matrix3d::Identity()).norm();
  if (!(off < 1e-9) || !(estimate.determinant() > 0.0)) return std::nan("");
  double best = 4.0;
  for (const Matrix3d& choice : SignChoices(estimate)) {
    best = std::min(best, (choice - truth).norm() / std::sqrt(2.0));
  }
  return best;
}

// Conic to both normals and centres.
void BM_CirclePoses(benchmark::State& state) {
  std::array<CirclePose, 2> poses;
  RunInTurn(state, RandomScenes(), [&](const Scene& s) { return CirclePoses(s.conic, &poses); });
  CountHypotheses(state, RandomScenes(kCountedScenes),
                  [&](const Scene& s, std::array<double, 4>* errors) {
                    const int count = CirclePoses(s.conic, &poses);
                    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
                      const CirclePose& p = poses[i];
                      const bool proper =
                          std::abs(p.normal.norm() - 1.0) < 1e-9 && p.normal.dot(p.center) < 0.0;
                      (*errors)[i] = proper ? (p.normal - s.rotation.col(2)).norm() : std::nan("");
                    }
                    return count;
                  });
}
BENCHMARK(BM_CirclePoses);

// Conic and the images of two axes to the rotations, the true one first.
void BM_CircleFrameToRotation(benchmark::State& state) {
  std::array<FrameRotation, 2> rotations;
  RunInTurn(state, RandomScenes(), [&](const Scene& s) {
    return RotationsFromCircleAndFrame(s.conic, s.x_line, s.y_line, &rotations);
  });
  CountHypotheses(
      state, RandomScenes(kCountedScenes), [&](const Scene& s, std::array<double, 4>* errors) {
        const int count = RotationsFromCircleAndFrame(s.conic, s.x_line, s.y_line, &rotations);
        for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
          (*errors)[i] = RotationError(rotations[i].rotation, s.rotation);
        }
        return count;
      });
}
BENCHMARK(BM_CircleFrameToRotation);

// Two pairs of parallel segments, by their end points, to the rotation.
void BM_TwoLinePairsToRotation(benchmark::State& state) {
  Matrix3d R;
  const auto vanishing_point = [](const std::array<std::array<Vector3d, 2>, 2>& pair) -> Vector3d {
    return pair[0][0].cross(pair[0][1]).cross(pair[1][0].cross(pair[1][1]));
  };
  RunInTurn(state, RandomScenes(), [&](const Scene& s) {
    return RotationFromDirections(vanishing_point(s.first_pair), vanishing_point(s.second_pair),
                                  &R);
  });
  CountHypotheses(state, RandomScenes(kCountedScenes),
                  [&](const Scene& s, std::array<double, 4>* errors) {
                    if (!RotationFromDirections(vanishing_point(s.first_pair),
                                                vanishing_point(s.second_pair), &R)) {
                      return 0;
                    }
                    (*errors)[0] = RotationError(R, s.rotation);
                    return 1;
                  });
}
BENCHMARK(BM_TwoLinePairsToRotation);

#ifdef CIRCLINE_BENCHMARK_CALIB3D
// What IPPE solves needs more: four points whose place on the plane is known.
void BM_OpenCV_SolvePnP_IPPE_FourKnownPoints(benchmark::State& state) {
  const std::vector<cv::Point3d> object = {{-1, 1, 0}, {1, 1, 0}, {1, -1, 0}, {-1, -1, 0}};
  std::vector<std::vector<cv::Point2d>> images;
  for (const Scene& s : RandomScenes()) {
    images.emplace_back();
    for (const Vector2d& x : s.square) images.back().emplace_back(x.x(), x.y());
  }
  const cv::Matx33d identity = cv::Matx33d::eye();
  std::vector<cv::Mat> rotations, translations;
  RunInTurn(state, images, [&](const std::vector<cv::Point2d>& image) {
    return cv::solvePnPGeneric(object, image, identity, cv::noArray(), rotations, translations,
                               false, cv::SOLVEPNP_IPPE);
  });
  CountHypotheses(
      state, RandomScenes(kCountedScenes), [&](const Scene& s, std::array<double, 4>* errors) {
        std::vector<cv::Point2d> image;
        for (const Vector2d& x : s.square) image.emplace_back(x.x(), x.y());
        const int count = cv::solvePnPGeneric(object, image, identity, cv::noArray(), rotations,
                                              translations, false, cv::SOLVEPNP_IPPE);
        for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
          const cv::Mat& r = rotations[i];
          const Vector3d delta(r.at<double>(0), r.at<double>(1), r.at<double>(2));
          (*errors)[i] = RotationError(ExpRotation(delta), s.rotation);
        }
        return count;
      });
}
BENCHMARK(BM_OpenCV_SolvePnP_IPPE_FourKnownPoints);
#endif

// Points with noise of 1 px all around an ellipse of 100 x 60 px.
struct EllipsePoints {
  std::vector<CalibratedPoint> points;
  std::vector<cv::Point2f> pixels;

  EllipsePoints(std::int64_t count, std::uint64_t seed) {
    Random random(seed);
    const Ellipse ellipse{{120.0, -70.0}, 100.0, 60.0, 0.4};
    for (std::int64_t i = 0; i < count; ++i) {
      Vector2d u =
          EllipsePoint(ellipse, 2.0 * kPi * static_cast<double>(i) / static_cast<double>(count));
      u += Noise2(1.0, &random);
      CalibratedPoint p;
      p.x = u / kFocal;
      p.x_from_pixel = {1.0 / kFocal, 0.0, 0.0, 1.0 / kFocal};
      points.push_back(p);
      pixels.emplace_back(static_cast<float>(u.x()), static_cast<float>(u.y()));
    }
  }
};

std::vector<EllipsePoints> RandomEllipses(std::int64_t count) {
  std::vector<EllipsePoints> ellipses;
  for (std::uint64_t seed = 0; seed < kScenes; ++seed) ellipses.emplace_back(count, seed);
  return ellipses;
}

void BM_ConicFromFivePoints(benchmark::State& state) {
  std::vector<std::array<Vector2d, 5>> samples;
  for (const EllipsePoints& e : RandomEllipses(5)) {
    samples.emplace_back();
    for (std::size_t k = 0; k < 5; ++k) samples.back()[k] = e.points[k].x;
  }
  Matrix3d conic;
  RunInTurn(state, samples,
            [&](const std::array<Vector2d, 5>& x) { return ConicFromFivePoints(x, &conic); });
}
BENCHMARK(BM_ConicFromFivePoints);

void BM_FitConicDirect(benchmark::State& state) {
  Matrix3d conic;
  RunInTurn(state, RandomEllipses(state.range(0)),
            [&](const EllipsePoints& e) { return FitConicDirect(e.points, &conic).ok(); });
}
BENCHMARK(BM_FitConicDirect)->Arg(100)->Arg(1000);

// Maximum likelihood, with covariance.
void BM_FitConic(benchmark::State& state) {
  ConicFit fit;
  RunInTurn(state, RandomEllipses(state.range(0)),
            [&](const EllipsePoints& e) { return FitConic(e.points, 1.0, &fit).ok(); });
}
BENCHMARK(BM_FitConic)->Arg(100)->Arg(1000);

// The neighbours, without covariance. At 100 points each runs its own method; OpenCV 4.6 answers
// with fitEllipse under the names of AMS and Direct from 200 points on, so there are no such rows.
void BM_OpenCV_fitEllipse(benchmark::State& state) {
  RunInTurn(state, RandomEllipses(state.range(0)),
            [](const EllipsePoints& e) { return cv::fitEllipse(e.pixels); });
}
BENCHMARK(BM_OpenCV_fitEllipse)->Arg(100)->Arg(1000);

void BM_OpenCV_fitEllipseAMS(benchmark::State& state) {
  RunInTurn(state, RandomEllipses(state.range(0)),
            [](const EllipsePoints& e) { return cv::fitEllipseAMS(e.pixels); });
}
BENCHMARK(BM_OpenCV_fitEllipseAMS)->Arg(100);

void BM_OpenCV_fitEllipseDirect(benchmark::State& state) {
  RunInTurn(state, RandomEllipses(state.range(0)),
            [](const EllipsePoints& e) { return cv::fitEllipseDirect(e.pixels); });
}
BENCHMARK(BM_OpenCV_fitEllipseDirect)->Arg(100);

}  // namespace
}  // namespace circline
