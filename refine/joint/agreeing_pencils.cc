// Readings of pencils that alone tell the plane, and of which some lines do not meet where the
// others do.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "circline/estimators/closed_form_solvers.h"
#include "circline/estimators/line.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/statistics.h"
#include "circline/estimators/vanishing_point.h"
#include "circline/refine/joint/readings.h"

namespace circline {
namespace {

// Lines of a pencil, by their number in it.
struct MeetingLines {
  std::vector<std::size_t> odd;  // The others.
  VanishingPointFit fit;         // Of those that meet.
};

// Those that meet where two do; a fit of zeros where these meet nowhere.
MeetingLines MeetingAt(const std::vector<LineFit>& lines, std::size_t i, std::size_t j) {
  MeetingLines meeting;
  const VanishingPointFit& at = meeting.fit;
  if (!FitVanishingPoint({lines[i], lines[j]}, &meeting.fit).ok()) return meeting;
  std::vector<LineFit> agreeing;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const LineFit& l = lines[k];
    const double of_line = at.direction.dot(l.covariance * at.direction),
                 of_fit = l.line.dot(at.covariance * l.line), sigma = std::sqrt(of_line + of_fit);
    if (k == i || k == j || std::abs(l.line.dot(at.direction)) <= kInlierSigmas * sigma) {
      agreeing.push_back(l);
    } else {
      meeting.odd.push_back(k);
    }
  }
  if (agreeing.size() > 2) FitVanishingPoint(agreeing, &meeting.fit);
  return meeting;
}

// Sets of lines that meet where two of them do, as far as these and they themselves are known, each
// once, those of most lines first: of three lines any two may be right. All lines are one set, with
// the fit of `all`, where they agree with it, or are many.
std::vector<MeetingLines> FindMeetingLines(const std::vector<LineFit>& lines,
                                           const VanishingPointFit& all) {
  constexpr std::size_t kMost = 12;    // Of more, the fit of all tells; for time, not tuned.
  constexpr double kByChance = 0.002;  // Pencils of parallel lines that are looked at for nothing.
  const std::size_t n = lines.size();
  double squares = 0.0;
  for (const LineFit& line : lines)
    squares += std::pow(VanishingPointResidual(line, all.direction), 2.0);
  if (n < 3 || n > kMost || squares <= ChiSquareLimit(static_cast<int>(n) - 2, kByChance))
    return {{{}, all}};
  std::vector<MeetingLines> found;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      MeetingLines meeting = MeetingAt(lines, i, j);
      const bool is_known = std::any_of(found.begin(), found.end(), [&](const MeetingLines& other) {
        return other.odd == meeting.odd;
      });
      if (!is_known && !meeting.fit.direction.isZero()) found.push_back(std::move(meeting));
    }
  }
  std::stable_sort(found.begin(), found.end(), [](const MeetingLines& a, const MeetingLines& b) {
    return a.odd.size() < b.odd.size();
  });
  return found;
}

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
    Seed seed = seeds[0];
    if (!WorldRotation(problem.observations(), normal.normalized(), seed.pose.translation,
                       kAnySigmaPx, &seed.pose.rotation))
      return;
    AgreeingLines agreeing{Reading(problem.features().size(), 1), {seed}};
    for (const std::size_t line : a.odd) agreeing.reading[p.features[line]] = 0;
    for (const std::size_t line : b.odd) agreeing.reading[q.features[line]] = 0;
    found.push_back(std::move(agreeing));
  };
  for (auto p = pencils.begin(); p != pencils.end(); ++p) {
    for (auto q = p + 1; q != pencils.end(); ++q) {
      for (const MeetingLines& a : p->meetings) {
        for (const MeetingLines& b : q->meetings) add(*p, a, *q, b);
      }
    }
  }
  KeepFullest(kMostReadings, &found);
  return found;
}

}  // namespace circline
