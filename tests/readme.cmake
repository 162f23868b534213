# The example in README.md is docs/example.cc, which the package test builds; CITATION.cff has the
# version of CMakeLists.txt.
file(READ "${source}/README.md" readme)
file(READ "${source}/docs/example.cc" example)
string(FIND "${readme}" "${example}" found)
if(found EQUAL -1)
  message(FATAL_ERROR "README.md does not show docs/example.cc as it is")
endif()

file(STRINGS "${source}/CMakeLists.txt" project REGEX "^project\\(circline VERSION ")
string(REGEX REPLACE ".*VERSION ([0-9.]+).*" "\\1" version "${project}")
file(STRINGS "${source}/CITATION.cff" cited REGEX "^version: ")
if(NOT cited STREQUAL "version: ${version}")
  message(FATAL_ERROR "CITATION.cff says '${cited}', CMakeLists.txt ${version}")
endif()
