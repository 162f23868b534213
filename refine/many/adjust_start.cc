#include <Eigen/Dense>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <future>
#include <limits>
#include <vector>

#include "circline/estimators/closed_form_solvers.h"
#include "circline/refine/joint/joint_problem.h"
#include "circline/refine/joint/joint_result.h"
#include "circline/refine/joint/readings.h"
#include "circline/refine/many/adjustment.h"

namespace circline {

void ParallelFor(std::size_t count, int num_threads, const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next{0};
  const auto run = [&] {
    try {
      for (std::size_t i = next++; i < count; i = next++) work(i);
    } catch (...) {  // No memory left, or a cost function of the user's.
      next = count;
      throw;
    }
  };
  std::vector<std::future<void>> others;
  try {
    for (std::size_t k = 1; k < std::min<std::size_t>(static_cast<std::size_t>(num_threads), count);
         ++k)
      others.push_back(std::async(std::launch::async, run));
  } catch (const std::exception&) {  // No more threads can be had: fewer do the work.
  }
  run();
  for (std::future<void>& other : others) other.get();
}

Observations Prepare(const Observations& given, const Camera& camera,
                     const EstimationOptions& options, const PointNoise* noise) {
  Observations photo = given;
  photo.camera = camera;
  ResetFits(&photo);
  photo = ResolveWorld(photo);
  photo.num_dropped_points = 0;
  FitDirect(FitSigmaPx(options), &photo, nullptr, options.noise_model);
  photo = ResolveWorld(photo);
  StateNoise(noise != nullptr ? *noise : MeasurePointNoise(photo, options.noise_model),
             options.conic_loss.scale_px, options.line_loss.scale_px, &photo);
  return photo;
}

double CoarsePose(const Observations& photo, const EstimationOptions& options,
                  PoseEstimate* estimate) {
  constexpr int kIterations = 3;
  constexpr double kImpossible = 0.5 * kInlierSigmas * kInlierSigmas;  // As an outlier.
  // Points that the camera cannot have seen.
  const double impossible = kImpossible * photo.num_dropped_points;
  SolverRegistry registry;
  AddClosedFormSolvers(&registry);
  const std::vector<Seed> seeds = CollectSeeds(photo, registry.solvers(), 0.0);
  const JointProblem problem(photo, options);
  Status last;
  std::vector<SeedStart> starts = StartsOf(problem, seeds, problem.FirstReading(), &last);
  if (estimate != nullptr)
    estimate->status = Status::Refused("no closed form leads to a pose that can be refined");
  if (starts.empty()) return std::numeric_limits<double>::infinity();
  State& best = starts.front().state;
  if (!problem.Solve(kIterations, &best).ok()) return starts.front().cost + impossible;
  Refined refined;
  if (estimate != nullptr && FillRefined(problem, best, &refined).ok()) {
    estimate->status = Status::Ok();
    estimate->hypotheses = {std::move(refined.hypothesis)};
  }
  return best.cost + LeftOutCost(problem, best) + impossible;
}

CameraSweep::CameraSweep(const std::vector<Observations>& photos, const Camera& given,
                         const EstimationOptions& options, int num_threads)
    : photos_(photos),
      given_(given),
      options_(options),
      num_threads_(num_threads),
      noise_(photos_.size()),
      least_(photos_.size(), std::numeric_limits<double>::infinity()) {
  ParallelFor(photos_.size(), num_threads_, [&](std::size_t i) {
    noise_[i] = MeasurePointNoise(Prepare(photos_[i], given_, options_));
  });
}

std::vector<double> CameraSweep::CostsAt(const std::vector<Camera>& cameras) {
  std::vector<std::vector<double>> costs(photos_.size());
  ParallelFor(photos_.size(), num_threads_, [&](std::size_t i) {
    for (const Camera& camera : cameras) {
      const Observations photo = Prepare(photos_[i], camera, options_, &noise_[i]);
      costs[i].push_back(CoarsePose(photo, options_, nullptr));
      least_[i] = std::min(least_[i], costs[i].back());
    }
  });
  // A photo that no pose explains at one of them tells nothing but that.
  constexpr double kNoPose = 1e3;  // Of cost, above its best.
  std::vector<double> sums(cameras.size(), 0.0);
  for (std::size_t i = 0; i < photos_.size(); ++i) {
    if (!std::isfinite(least_[i])) continue;
    for (std::size_t c = 0; c < cameras.size(); ++c)
      sums[c] += std::min(costs[i][c], least_[i] + kNoPose);
  }
  return sums;
}

std::vector<Camera> CameraSweep::Candidates(double log_focal_sigma, bool has_radial) {
  constexpr double kFocalStep = 0.3, kWidest = 1.8;  // Of log f; standard deviations of the prior.
  constexpr double kRadialStep = -0.2;
  constexpr std::size_t kMost = 3;
  constexpr double kWidestPrior = 1.5;  // Of log f: a view of 60 degrees from 150 to 5 degrees.
  const int half =
      static_cast<int>(std::ceil(kWidest * std::min(log_focal_sigma, kWidestPrior) / kFocalStep));
  const int focals = 2 * half + 1, radials = has_radial ? 3 : 1;
  std::vector<Camera> cameras;
  for (int k = 0; k < focals; ++k) {
    for (int r = 0; r < radials; ++r) {
      Camera& made = cameras.emplace_back(given_);
      made.fx *= std::exp((k - half) * kFocalStep);
      made.fy *= std::exp((k - half) * kFocalStep);
      made.distortion[0] += r * kRadialStep;
    }
  }
  const std::vector<double> costs = CostsAt(cameras);
  if (std::none_of(least_.begin(), least_.end(), [](double cost) { return std::isfinite(cost); }))
    return {};
  const auto at = [&](int k, int r) {
    const bool inside = k >= 0 && k < focals && r >= 0 && r < radials;
    return inside ? costs[static_cast<std::size_t>(k * radials + r)]
                  : std::numeric_limits<double>::infinity();
  };
  std::vector<std::pair<double, std::size_t>> minima;
  for (int k = 0; k < focals; ++k) {
    for (int r = 0; r < radials; ++r) {
      double around = std::numeric_limits<double>::infinity();
      for (const auto& [dk, dr] : {std::pair(-1, 0), {1, 0}, {0, -1}, {0, 1}})
        around = std::min(around, at(k + dk, r + dr));
      if (at(k, r) <= around)
        minima.emplace_back(at(k, r), static_cast<std::size_t>(k * radials + r));
    }
  }
  std::sort(minima.begin(), minima.end());
  std::vector<Camera> candidates;
  for (std::size_t m = 0; m < std::min(kMost, minima.size()); ++m)
    candidates.push_back(cameras[minima[m].second]);
  return candidates;
}

}  // namespace circline
