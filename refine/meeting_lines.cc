#include "circline/refine/meeting_lines.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "circline/estimators/noise_model.h"
#include "circline/refine/statistics.h"

namespace circline {
namespace {

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

}  // namespace

std::vector<MeetingLines> FindMeetingLines(const std::vector<LineFit>& lines,
                                           const VanishingPointFit& all) {
  constexpr std::size_t kMost = 12;  // Of more, the fit of all tells; for time, not tuned.
  constexpr double kByChance = 0.002;
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

}  // namespace circline
