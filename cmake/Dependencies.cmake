# What the build needs, all of it from packages; nothing is downloaded. A missing one stops the
# configure with the name of the Debian package that has it.

macro(circline_find package debian_package)
  find_package(${package} ${ARGN} QUIET)
  if(NOT ${package}_FOUND)
    message(FATAL_ERROR "circline needs ${package} (${ARGN}), which was not found. "
                        "On Debian: apt-get install ${debian_package}")
  endif()
endmacro()

circline_find(Eigen3 libeigen3-dev 3.4 NO_MODULE)
circline_find(Ceres libceres-dev 2.1 CONFIG)
circline_find(OpenCV libopencv-dev 4.6 CONFIG COMPONENTS core imgproc)

if(CIRCLINE_BUILD_APPS OR CIRCLINE_BUILD_BENCHMARKS)
  circline_find(OpenCV libopencv-dev 4.6 CONFIG COMPONENTS core imgproc imgcodecs)
endif()
if(CIRCLINE_BUILD_APPS OR CIRCLINE_BUILD_TESTS)
  circline_find(Threads libc6-dev)
endif()
if(CIRCLINE_BUILD_APPS)
  circline_find(glog libgoogle-glog-dev CONFIG)
  circline_find(gflags libgflags-dev CONFIG)
  circline_find(nlohmann_json nlohmann-json3-dev 3 CONFIG)
endif()
if(CIRCLINE_BUILD_TESTS)
  circline_find(GTest libgtest-dev CONFIG)
endif()
if(CIRCLINE_BUILD_BENCHMARKS)
  circline_find(benchmark libbenchmark-dev CONFIG)
endif()
