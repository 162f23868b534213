# -D headers=<public headers, ;> -D libraries=<shared libraries, ;> -D nm=<nm> -D compiler=<id>: whether
# public headers export what they declare, and shared libraries show nothing but that (with Clang also
# what internal headers declare, cmake/Targets.cmake).
foreach(header ${headers})
  file(READ "${header}" text)
  if(NOT text MATCHES "\nnamespace CIRCLINE_EXPORT circline {\n" AND text MATCHES "\nnamespace ")
    message(SEND_ERROR "${header} is public: open its namespace as `namespace CIRCLINE_EXPORT circline {` "
                       "(estimators/export.h), or add it to PRIVATE_HEADERS")
  endif()
endforeach()

set(all "")
foreach(library ${libraries})
  execute_process(COMMAND "${nm}" -D --defined-only "${library}"
                  OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX MATCHALL "[^\n]+" symbols "${symbols}")
  # Mangled: functions and objects, types and virtual tables, their thunks, all of namespace circline.
  list(FILTER symbols EXCLUDE REGEX "^[0-9a-f]+ [A-Za-z] _Z(N|NK|T.N|T[hv][0-9_n]*N)8circline")
  if(symbols)
    string(REPLACE ";" "\n  " symbols "${symbols}")
    message(SEND_ERROR "${library} shows what is not circline's:\n  ${symbols}")
  endif()
  execute_process(COMMAND "${nm}" -DC --defined-only "${library}"
                  OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
  string(APPEND all "${symbols}")
  if(NOT library MATCHES "\\.so\\.[0-9]+\\.[0-9]+\\.[0-9]+$")
    message(SEND_ERROR "${library} has no version in its name")
  endif()
endforeach()
foreach(public "CirclePoses(" "FitObservations(" "DetectObservations(" "EstimatePose("
               "vtable for circline::PlaneLineCost")
  string(FIND "${all}" "${public}" found)
  if(found EQUAL -1)
    message(SEND_ERROR "no shared library shows ${public}")
  endif()
endforeach()
foreach(hidden JointProblemBuilder ClosedFormSolver ConicSearch)
  if(compiler STREQUAL "GNU" AND all MATCHES "circline::${hidden}[^s]")
    message(SEND_ERROR "a shared library shows ${hidden}, which is internal")
  endif()
endforeach()
