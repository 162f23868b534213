// Solvers of your own in a shared library of their own: circline_compare --plugin=libmine.so.
//
//   void AddMySolvers(const circline::ClosedFormOptions& options, circline::SolverRegistry*
//   registry) {
//     registry->Add(std::make_shared<MySolver>(options));
//   }
//   CIRCLINE_SOLVER_PLUGIN(AddMySolvers)
//
// in one source; docs/examples/own_solver is a whole one. Each closed form is refined and compared
// as the built-in ones are. What goes across are C++ objects: build it with the compiler and the
// circline of the program that loads it; a library of another version is refused by the program.
#ifndef CIRCLINE_ESTIMATORS_SOLVER_PLUGIN_H_
#define CIRCLINE_ESTIMATORS_SOLVER_PLUGIN_H_

#include "circline/estimators/closed_form_solvers.h"
#include "circline/estimators/export.h"
#include "circline/estimators/solver_registry.h"
#include "circline/version.h"

namespace CIRCLINE_EXPORT circline {

// The two functions of a plug-in, in C's manner: the version that it was built with, "0.1.0", and
// that which adds its solvers. Its solvers stay in use until the program ends.
using PluginVersionFunction = const char*();
using PluginAddSolversFunction = void(const ClosedFormOptions* options, SolverRegistry* registry);
inline constexpr char kPluginVersionSymbol[] = "circline_plugin_version";
inline constexpr char kPluginAddSolversSymbol[] = "circline_plugin_add_solvers";

}  // namespace circline

#define CIRCLINE_SOLVER_PLUGIN(add_solvers)                                             \
  extern "C" CIRCLINE_EXPORT const char* circline_plugin_version() {                    \
    return CIRCLINE_VERSION_STRING;                                                     \
  }                                                                                     \
  extern "C" CIRCLINE_EXPORT void circline_plugin_add_solvers(                          \
      const circline::ClosedFormOptions* options, circline::SolverRegistry* registry) { \
    add_solvers(*options, registry);                                                    \
  }

#endif  // CIRCLINE_ESTIMATORS_SOLVER_PLUGIN_H_
