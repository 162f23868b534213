#include <algorithm>
#include <cmath>
#include <vector>

#include "circline/estimators/exactness.h"
#include "circline/refine/joint/linearization.h"
#include "circline/refine/joint/readings.h"

namespace circline {
namespace {

constexpr double kMostScale = 2.0;
constexpr std::size_t kFewCircles = 2, kFewLines = 4;  // So few hardly contradict each other.

// Variance of what the points alone say of an own unknown with a Gaussian prior, from that with it.
double PriorShare(double variance, double sigma) {
  if (!(sigma > 0.0) || !(variance > 0.0)) return 0.0;
  const double prior = sigma * sigma;
  const double information = std::max(0.0, 1.0 / variance - 1.0 / prior);
  return information * prior;
}

}  // namespace

bool HasManyFeatures(const JointProblem& problem) {
  const NoiseModel& m = problem.options().noise_model;
  const bool circles_differ = m.contour_px > 0.0 || m.circle_tilt_rad > 0.0,
             lines_differ = m.line_px > 0.0 || m.line_direction_rad > 0.0;
  return m.spread > 0.0 && ((circles_differ && problem.circles().size() > kFewCircles) ||
                            (lines_differ && problem.lines().size() > kFewLines));
}

NoiseModel ScaledNoiseModel(const JointProblem& problem, const State& minimum) {
  NoiseModel model = problem.options().noise_model;
  Linearization at(problem, minimum, Weighing());
  if (!at.ok() || !at.ComputeCovariance()) return model;
  const std::vector<Linearization::Misfit> found = at.Misfits();
  // An outlier counts for no more than a feature that is kept.
  constexpr double kMost = 9.0;
  const auto add = [&](int feature, int term, double deviations, std::vector<Misfit>* out) {
    const auto f = static_cast<std::size_t>(feature);
    if (minimum.active[f] == 0) return;
    const double weight = problem.term(term).weighed->points()->options().weight;
    const double dof = found[f].dof;
    out->push_back({std::min(found[f].d2, kMost * dof), dof, (1.0 + deviations) / weight - 1.0});
  };
  std::vector<Misfit> circles, lines;
  for (const JointProblem::CircleBlocks& c : problem.circles()) {
    double deviations = 0.0;
    for (int k = 0; c.tilt >= 0 && k < 2; ++k)
      deviations += 0.5 * PriorShare(at.OwnVariance(c.feature, c.tilt, k), model.circle_tilt_rad);
    add(c.feature, c.term, deviations, &circles);
  }
  for (const JointProblem::LineBlocks& l : problem.lines()) {
    const bool is_soft = problem.block(l.line).size > 1;
    add(l.feature, l.term,
        is_soft ? PriorShare(at.OwnVariance(l.feature, l.line, 1), model.line_direction_rad) : 0.0,
        &lines);
  }
  if (circles.size() > kFewCircles) {
    const double s = ExpectedScale(circles.data(), circles.size(), model.spread, kMostScale);
    model.contour_px *= s;
    model.circle_tilt_rad *= s;
    model.circle_height *= s;
    model.circle_shape *= s;
  }
  if (lines.size() > kFewLines) {
    const double s = ExpectedScale(lines.data(), lines.size(), model.spread, kMostScale);
    model.line_px *= s;
    model.line_direction_rad *= s;
  }
  return model;
}

}  // namespace circline
