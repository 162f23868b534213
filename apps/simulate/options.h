// What circline_simulate was asked to do, from its flags.
#ifndef CIRCLINE_APPS_SIMULATE_OPTIONS_H_
#define CIRCLINE_APPS_SIMULATE_OPTIONS_H_

#include <string>

#include "apps/simulate/simulate.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// Not ok: one line that names the flag.
Status SimulationFromFlags(SimulationOptions* options, std::string* output);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_SIMULATE_OPTIONS_H_
