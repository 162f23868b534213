// The paper's figure: mean and standard deviation of the errors of rotation axis and angle.
#ifndef CIRCLINE_APPS_SIMULATE_PLOT_H_
#define CIRCLINE_APPS_SIMULATE_PLOT_H_

#include <string>
#include <vector>

#include "apps/simulate/simulate.h"

namespace circline::apps {

// A standalone SVG: the four panels over the noise, once for each outlier ratio; methods in solid
// lines, the bound of each kind of evidence dashed.
std::string RenderSimulation(const std::vector<SimulationRow>& rows);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_SIMULATE_PLOT_H_
