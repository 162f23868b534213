// What the closed forms for the focal length cost: one core, CPU time, covariance included.
#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "apps/benchmark/rows.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/circle_focal.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/focal_length.h"
#include "circline/estimators/plane_focal.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/random.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kFocal = 800.0;  // The guess, pixels.
constexpr double kSigma = 0.1;    // Of contour points, pixels, in the stated covariances.
constexpr double kMinFocal = 0.35, kMaxFocal = 7.0;

// A plane with circles of radius 1 and its directions, seen without noise by a camera whose focal
// length is half to twice the guess, in coordinates of the guess.
struct FocalScene {
  double focal;
  std::array<VanishingPointFit, 3> axes;
  VanishingPointFit oblique;       // 50 degrees from the first axis.
  ConicFit circle, inner, nested;  // About one centre; within it.
  Vector3d center;                 // Of the first.
  std::array<ConicFit, 12> dots;   // Of a lattice, radius 0.4.
};

FocalScene RandomScene(Random* random) {
  FocalScene s;
  s.focal = std::exp2(random->Uniform(-1.0, 1.0));
  const double tilt = random->Uniform(0.2, 1.2), about = random->Uniform(-kPi, kPi);
  const Matrix3d R = ExpRotation({tilt * std::cos(about), tilt * std::sin(about), 0.0}) *
                     ExpRotation({0.0, 0.0, random->Uniform(-kPi, kPi)});
  const Vector3d K(s.focal, s.focal, 1.0), to_guess = K.cwiseInverse();
  const auto at = [&](double x, double y) -> Vector3d {
    return Vector3d(0.0, 0.0, 10.0) + R.leftCols<2>() * Eigen::Vector2d(x, y);
  };
  const auto direction = [&](const Vector3d& d) {
    VanishingPointFit fit;
    fit.direction = K.cwiseProduct(R * d).normalized();
    const Matrix3d across = Matrix3d::Identity() - fit.direction * fit.direction.transpose();
    fit.covariance = 1e-6 * across;
    return fit;
  };
  // The covariance of 100 points all around.
  const auto circle = [&](double x, double y, double radius) {
    std::vector<CalibratedPoint> points(100);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double a = 2.0 * kPi * static_cast<double>(i) / 100.0;
      points[i].x =
          K.cwiseProduct(at(x + radius * std::cos(a), y + radius * std::sin(a))).hnormalized();
      points[i].x_from_pixel = {1.0 / kFocal, 0.0, 0.0, 1.0 / kFocal};
    }
    ConicFit fit;
    FitConic(points, kSigma, &fit);
    const CirclePose pose = {R.col(2), at(x, y) / radius};
    NormalizeEllipse(to_guess.asDiagonal() * ProjectCircle(pose) * to_guess.asDiagonal(),
                     &fit.conic);
    return fit;
  };
  s.axes = {direction(Vector3d::UnitX()), direction(Vector3d::UnitY()),
            direction(Vector3d::UnitZ())};
  s.oblique = direction({std::cos(50.0 * kDegree), std::sin(50.0 * kDegree), 0.0});
  s.circle = circle(0.5, 0.2, 2.0);
  s.inner = circle(0.5, 0.2, 1.2);
  s.nested = circle(0.9, 0.4, 1.0);
  s.center = K.cwiseProduct(at(0.5, 0.2));
  for (std::size_t i = 0; i < s.dots.size(); ++i) {
    const std::size_t column = i % 4, row = i / 4;
    s.dots[i] = circle(static_cast<double>(column) - 1.5, static_cast<double>(row) - 1.0, 0.4);
  }
  return s;
}

std::vector<FocalScene> RandomScenes(std::size_t count) {
  Random random(1);
  std::vector<FocalScene> scenes;
  for (std::size_t i = 0; i < count; ++i) scenes.push_back(RandomScene(&random));
  return scenes;
}

// A row: `solve` writes up to N solutions and returns how many.
template <std::size_t N, typename Solve>
void FocalRow(benchmark::State& state, const Solve& solve, std::size_t counted = kCountedScenes) {
  std::array<FocalSolution, N> solutions;
  RunInTurn(state, RandomScenes(kScenes),
            [&](const FocalScene& s) { return solve(s, &solutions); });
  CountHypotheses(state, RandomScenes(counted),
                  [&](const FocalScene& s, std::array<double, 4>* errors) {
                    const int count = solve(s, &solutions);
                    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
                      (*errors)[i] = std::abs(std::log(solutions[i].focal / s.focal));
                    }
                    return count;
                  });
}

void BM_FocalFromOrthogonalVanishingPoints(benchmark::State& state) {
  FocalRow<2>(state, [](const FocalScene& s, std::array<FocalSolution, 2>* solutions) {
    return FocalFromVanishingPoints(s.axes[0], s.axes[1], 0.5 * kPi, 0.0, solutions);
  });
}
BENCHMARK(BM_FocalFromOrthogonalVanishingPoints);

void BM_FocalFromObliqueVanishingPoints(benchmark::State& state) {
  FocalRow<2>(state, [](const FocalScene& s, std::array<FocalSolution, 2>* solutions) {
    return FocalFromVanishingPoints(s.axes[0], s.oblique, 50.0 * kDegree, 0.0, solutions);
  });
}
BENCHMARK(BM_FocalFromObliqueVanishingPoints);

void BM_FocalFromThreeVanishingPoints(benchmark::State& state) {
  FocalRow<1>(state, [](const FocalScene& s, std::array<FocalSolution, 1>* solutions) {
    return FocalFromThreeVanishingPoints(s.axes, 0.0, solutions->data());
  });
}
BENCHMARK(BM_FocalFromThreeVanishingPoints);

void BM_FocalFromCircleAndCenter(benchmark::State& state) {
  FocalRow<1>(state, [](const FocalScene& s, std::array<FocalSolution, 1>* solutions) {
    return FocalFromCircleAndCenter(s.circle, s.center, 1e-8 * Matrix3d::Identity(),
                                    solutions->data());
  });
}
BENCHMARK(BM_FocalFromCircleAndCenter);

void BM_FocalFromConcentricCircles(benchmark::State& state) {
  FocalRow<1>(state, [](const FocalScene& s, std::array<FocalSolution, 1>* solutions) {
    return FocalFromConcentricCircles(s.circle, s.inner, solutions->data());
  });
}
BENCHMARK(BM_FocalFromConcentricCircles);

void BM_FocalFromNestedCircles(benchmark::State& state) {
  FocalRow<2>(state, [](const FocalScene& s, std::array<FocalSolution, 2>* solutions) {
    return FocalFromCoplanarCircles(s.circle, s.nested, solutions);
  });
}
BENCHMARK(BM_FocalFromNestedCircles);

void BM_FocalFromCircleAndPencil(benchmark::State& state) {
  PlaneEvidence evidence;
  FocalRow<4>(
      state,
      [&](const FocalScene& s, std::array<FocalSolution, 4>* solutions) {
        evidence.circles = {&s.circle};
        evidence.pencils = {&s.oblique};
        return FocalFromPlane(evidence, kMinFocal, kMaxFocal, solutions);
      },
      kCountedScenes / 10);
}
BENCHMARK(BM_FocalFromCircleAndPencil);

// As many circles of one size as the argument says; with rows and columns.
void BM_FocalFromLattice(benchmark::State& state) {
  PlaneEvidence evidence;
  const auto number = static_cast<std::size_t>(state.range(0));
  evidence.radii.assign(number, 1.0);
  evidence.orthogonal_pencils = true;
  FocalRow<4>(
      state,
      [&](const FocalScene& s, std::array<FocalSolution, 4>* solutions) {
        evidence.circles.clear();
        for (std::size_t i = 0; i < number; ++i) evidence.circles.push_back(&s.dots[i]);
        evidence.pencils = {&s.axes[0], &s.axes[1]};
        return FocalFromPlane(evidence, kMinFocal, kMaxFocal, solutions);
      },
      kCountedScenes / 10);
}
BENCHMARK(BM_FocalFromLattice)->Arg(2)->Arg(12);

}  // namespace
}  // namespace circline
