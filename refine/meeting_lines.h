// Lines of a pencil of which some do not meet where the others do. Internal: not installed.
#ifndef CIRCLINE_REFINE_MEETING_LINES_H_
#define CIRCLINE_REFINE_MEETING_LINES_H_

#include <cstddef>
#include <vector>

#include "circline/estimators/line.h"
#include "circline/estimators/vanishing_point.h"

namespace circline {

struct MeetingLines {
  std::vector<std::size_t> odd;  // The others.
  VanishingPointFit fit;         // Of those that meet.
};

// Sets of lines that meet where two of them do, as far as these and they themselves are known, each
// once, those of most lines first: of three lines any two may be right. All lines are one set, with
// the fit of `all`, where they agree with it, or are many.
std::vector<MeetingLines> FindMeetingLines(const std::vector<LineFit>& lines,
                                           const VanishingPointFit& all);

}  // namespace circline

#endif  // CIRCLINE_REFINE_MEETING_LINES_H_
