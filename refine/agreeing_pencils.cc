// Readings of pencils that alone tell the plane, and of which some lines do not meet where the
// others do.
#include <Eigen/Geometry>
#include <algorithm>
#include <utility>
#include <vector>

#include "circline/estimators/closed_form_solvers.h"
#include "circline/refine/meeting_lines.h"
#include "circline/refine/readings.h"

namespace circline {
namespace {

struct Pencil {
  bool is_across = false;             // Along Z.
  std::vector<std::size_t> features;  // Of its lines.
  std::vector<MeetingLines> meetings;
};

// Those of which some direction is known.
std::vector<Pencil> PencilsOf(const JointProblem& problem) {
  const Observations& observations = problem.observations();
  std::vector<Pencil> pencils(observations.pencils.size());
  std::vector<std::vector<LineFit>> fits(pencils.size());
  for (std::size_t i = 0; i < problem.features().size(); ++i) {
    const Feature& f = problem.features()[i];
    if (f.kind != Feature::Kind::kLine || f.line < 0) continue;
    const auto pencil = static_cast<std::size_t>(f.observation);
    pencils[pencil].features.push_back(i);
    fits[pencil].push_back(WithDirectionError(*problem.LineOf(f).fit,
                                              problem.options().noise_model.line_direction_rad));
  }
  for (std::size_t i = 0; i < pencils.size(); ++i) {
    const PencilObservation& pencil = observations.pencils[i];
    pencils[i].is_across = pencil.direction == PencilDirection::kZ;
    if (pencil.fit && fits[i].size() > 1)
      pencils[i].meetings = FindMeetingLines(fits[i], *pencil.fit);
  }
  return pencils;
}

}  // namespace

std::vector<AgreeingLines> FindAgreeingPencils(const JointProblem& problem,
                                               const std::vector<Seed>& seeds) {
  constexpr std::size_t kMostReadings = 8;  // For time, not tuned.
  std::vector<AgreeingLines> found;
  if (!problem.circles().empty() || seeds.empty()) return found;
  const std::vector<Pencil> pencils = PencilsOf(problem);
  if (std::all_of(pencils.begin(), pencils.end(),
                  [](const Pencil& p) { return p.meetings.size() < 2; }))
    return found;
  const auto add = [&](const Pencil& p, const MeetingLines& a, const Pencil& q,
                       const MeetingLines& b) {
    const Eigen::Vector3d normal = p.is_across   ? a.fit.direction
                                   : q.is_across ? b.fit.direction
                                                 : a.fit.direction.cross(b.fit.direction);
    AgreeingLines agreeing;
    Seed seed = seeds[0];
    if (!WorldRotation(problem.observations(), normal.normalized(), seed.pose.translation,
                       kAnySigmaPx, &seed.pose.rotation))
      return;
    agreeing.seeds = {seed};
    agreeing.reading.assign(problem.features().size(), 1);
    for (const std::size_t line : a.odd) agreeing.reading[p.features[line]] = 0;
    for (const std::size_t line : b.odd) agreeing.reading[q.features[line]] = 0;
    agreeing.num_lines =
        static_cast<int>(std::count(agreeing.reading.begin(), agreeing.reading.end(), 1));
    found.push_back(std::move(agreeing));
  };
  for (auto p = pencils.begin(); p != pencils.end(); ++p) {
    for (auto q = p + 1; q != pencils.end(); ++q) {
      for (const MeetingLines& a : p->meetings) {
        for (const MeetingLines& b : q->meetings) add(*p, a, *q, b);
      }
    }
  }
  std::stable_sort(found.begin(), found.end(), [](const AgreeingLines& a, const AgreeingLines& b) {
    return a.num_lines > b.num_lines;
  });
  found.resize(std::min(found.size(), kMostReadings));
  return found;
}

}  // namespace circline
