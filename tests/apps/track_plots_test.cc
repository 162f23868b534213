#include "apps/track/track_plots.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace circline::apps {
namespace {

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
