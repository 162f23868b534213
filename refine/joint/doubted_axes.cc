#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "circline/refine/joint/readings.h"

namespace circline {
namespace {

// Readings of less probability are not worth their time.
constexpr double kLeastProbability = 1e-3;

// It stays in the plane where it was along one of its axes.
void Free(const std::string& plane, PencilObservation* pencil) {
  pencil->plane = pencil->direction == PencilDirection::kZ ? "" : plane;
  pencil->direction = PencilDirection::kFree;
  pencil->axis_probability = 1.0;
  pencil->readings.clear();
}

// Logarithm of the sum of what the probabilities of ranked hypotheses are proportional to.
double LogEvidence(const std::vector<PoseHypothesis>& hypotheses) {
  const PoseHypothesis& best = hypotheses.front();
  return -best.cost + 0.5 * best.log_det - std::log(best.probability);
}

bool Holds(const PoseEstimate& estimate, const PoseHypothesis& hypothesis) {
  return std::any_of(estimate.hypotheses.begin(), estimate.hypotheses.end(),
                     [&](const PoseHypothesis& h) {
                       return h.structure == hypothesis.structure && h.cost == hypothesis.cost;
                     });
}

std::vector<std::size_t> MostDoubtedFirst(const std::vector<PencilObservation>& pencils) {
  std::vector<std::size_t> doubted;
  for (std::size_t i = 0; i < pencils.size(); ++i) {
    if (pencils[i].direction != PencilDirection::kFree && pencils[i].axis_probability < 1.0)
      doubted.push_back(i);
  }
  std::stable_sort(doubted.begin(), doubted.end(), [&](std::size_t a, std::size_t b) {
    return pencils[a].axis_probability < pencils[b].axis_probability;
  });
  return doubted;
}

}  // namespace

// What is likelier to run along its axis does so wherever what is less likely does.
std::vector<AxesReading> ReadingsOfAxes(const Observations& resolved) {
  std::vector<AxesReading> readings = {{resolved, 1.0, ""}};
  for (const std::size_t i : MostDoubtedFirst(resolved.pencils)) {
    const double probability = std::max(resolved.pencils[i].axis_probability, kLeastProbability);
    AxesReading next = readings.back();
    next.probability = 1.0 - probability;
    next.freed += " + free " + resolved.pencils[i].id;
    Free(resolved.frame.plane, &next.observations.pencils[i]);
    readings.back().probability += probability - 1.0;
    readings.push_back(std::move(next));
  }
  const auto is_negligible = [](const AxesReading& r) {
    return r.probability < 0.5 * kLeastProbability;
  };
  readings.erase(std::remove_if(readings.begin() + 1, readings.end(), is_negligible),
                 readings.end());
  return readings;
}

PoseEstimate UnitedReadings(const std::vector<AxesReading>& readings,
                            std::vector<PoseEstimate> estimates) {
  PoseEstimate united = estimates.front();
  for (std::size_t k = 1; k < readings.size(); ++k) {
    if (!estimates[k].status.ok()) continue;
    const double shift = LogEvidence(estimates[k].hypotheses) -
                         LogEvidence(estimates[0].hypotheses) -
                         std::log(readings[k].probability / readings[0].probability);
    for (PoseHypothesis& h : estimates[k].hypotheses) {
      h.cost += shift;
      h.structure += readings[k].freed;
      united.hypotheses.push_back(h);
    }
  }
  RankHypotheses(&united.hypotheses);
  for (const PoseEstimate& estimate : estimates) {
    if (!estimate.status.ok() || !Holds(estimate, united.hypotheses[0])) continue;
    united.notes = estimate.notes;
    if (united.hypotheses.size() > 1 && !Holds(estimate, united.hypotheses[1]))
      united.decided_by = "how probably the axes are at right angles";
  }
  const std::vector<PencilObservation>& pencils = readings.front().observations.pencils;
  for (const std::size_t i : MostDoubtedFirst(pencils)) {
    char probability[32];
    std::snprintf(probability, sizeof(probability), "%.2f", pencils[i].axis_probability);
    united.notes.push_back("pencil '" + pencils[i].id + "': along " +
                           PencilDirectionName(pencils[i].direction) + " with probability " +
                           probability + " only; else it runs any way");
  }
  return united;
}

}  // namespace circline
