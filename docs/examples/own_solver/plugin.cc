// The solver as a plug-in: circline_compare --plugin=libcircle_pencil.so --list_solvers
#include "circle_pencil.h"
#include "circline/estimators/solver_plugin.h"

CIRCLINE_SOLVER_PLUGIN(AddCirclePencilSolver)
