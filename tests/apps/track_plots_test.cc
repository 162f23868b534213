#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "apps/track/track_report.h"

namespace circline::apps {
namespace {

// How many lines of the plot's first series of that name.
long CountLines(const std::string& html, const std::string& series) {
  const std::size_t end = html.find("'><title>" + series + "</title>");
  const std::size_t begin = html.rfind(" d='", end);
  EXPECT_NE(end, std::string::npos);
  return std::count(html.begin() + static_cast<std::ptrdiff_t>(begin),
                    html.begin() + static_cast<std::ptrdiff_t>(end), 'M');
}

TEST(TrackPlots, ALineEndsWhereTheTrackBeginsAnew) {
  for (const std::size_t size : {100U, 4500U, 4501U, 4502U}) {  // Of the latter not all are drawn.
    std::vector<TrackedFrame> frames(size);
    for (std::size_t i = 0; i < size; ++i) {
      frames[i].time_s = 0.04 * static_cast<double>(i);
      frames[i].has_pose = true;
      frames[i].probabilities = {1.0};
    }
    for (const std::size_t begin : {0U, 40U, 50U, 60U}) frames[begin].reinitialized = true;
    EXPECT_EQ(CountLines(TrackPlots(frames), "x"), 4) << size;
  }
}

// Such as of errors where the poses are those of the truth: no axis would ever get there.
TEST(TrackPlots, ALogarithmicAxisNeedsAPositiveValue) {
  std::vector<TrackedFrame> frames(2);
  frames[1].time_s = 0.04;
  for (TrackedFrame& frame : frames) frame.sigma_deg = frame.error_deg = frame.nees = 0.0;
  EXPECT_EQ(TrackPlots(frames), "<div class='plots'></div>");
  frames[0].nees = 1.0;
  EXPECT_NE(TrackPlots(frames).find("NEES"), std::string::npos);
}

}  // namespace
}  // namespace circline::apps
