// Readings of lines along the axes, of which some do not run as the others do. Internal: not
// installed.
#ifndef CIRCLINE_REFINE_AGREEING_LINES_H_
#define CIRCLINE_REFINE_AGREEING_LINES_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "circline/refine/joint_problem.h"
#include "circline/refine/pose_seeds.h"

namespace circline {

struct AgreeingLines {
  std::vector<std::uint8_t> reading;  // Without the lines that do not agree.
  std::vector<Seed> seeds;            // The planes, turned such that one of them fits.
  int num_lines = 0;                  // That agree.
};

// In a circle's plane one line along an axis tells how the world is turned: the sample of a search
// by consensus. For each such line, and each plane of the best known circle among the seeds, the
// lines that agree with it as far as the plane and they themselves are known; those with most lines
// first, at most `max_readings`, each reading once. None where all lines agree, or there are many.
std::vector<AgreeingLines> FindAgreeingLines(const JointProblem& problem,
                                             const std::vector<Seed>& seeds,
                                             std::size_t max_readings);

}  // namespace circline

#endif  // CIRCLINE_REFINE_AGREEING_LINES_H_
