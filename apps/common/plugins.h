// Solvers from shared libraries (estimators/solver_plugin.h).
#ifndef CIRCLINE_APPS_COMMON_PLUGINS_H_
#define CIRCLINE_APPS_COMMON_PLUGINS_H_

#include <string>

#include "circline/estimators/closed_form_solvers.h"
#include "circline/estimators/solver_registry.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// Loads the libraries of a comma-separated list, each once, for as long as the program runs, as is
// the way of libraries. Not ok: one line that names the library that cannot be loaded, is no
// plug-in or was built for another version. Not thread-safe; to be called before threads start.
Status LoadPlugins(const std::string& files);

// Adds the solvers of all plug-ins that are loaded.
void AddPluginSolvers(const ClosedFormOptions& options, SolverRegistry* registry);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_PLUGINS_H_
