# The example in README.md is docs/example.cc, which the package test builds.
file(READ "${source}/README.md" readme)
file(READ "${source}/docs/example.cc" example)
string(FIND "${readme}" "${example}" found)
if(found EQUAL -1)
  message(FATAL_ERROR "README.md does not show docs/example.cc as it is")
endif()
