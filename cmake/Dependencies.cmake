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
  circline_find(OpenCV libopencv-dev 4.6 CONFIG COMPONENTS core imgproc imgcodecs videoio)
endif()
if(CIRCLINE_BUILD_APPS OR CIRCLINE_BUILD_TESTS)
  circline_find(Threads libc6-dev)
endif()
if(CIRCLINE_BUILD_APPS)
  circline_find(glog libgoogle-glog-dev CONFIG)
  circline_find(gflags libgflags-dev CONFIG)
  circline_find(nlohmann_json nlohmann-json3-dev 3 CONFIG)
  # It has no CMake package.
  find_library(CIRCLINE_EXIF_LIBRARY exif)
  find_path(CIRCLINE_EXIF_INCLUDE_DIR libexif/exif-data.h)
  if(NOT CIRCLINE_EXIF_LIBRARY OR NOT CIRCLINE_EXIF_INCLUDE_DIR)
    message(FATAL_ERROR "circline needs libexif, which was not found. "
                        "On Debian: apt-get install libexif-dev")
  endif()
  # Nor has cpp-httplib, whose flags must be those that its library was built with.
  circline_find(PkgConfig pkg-config)
  pkg_check_modules(HTTPLIB QUIET IMPORTED_TARGET cpp-httplib)
  if(NOT HTTPLIB_FOUND)
    message(FATAL_ERROR "circline needs cpp-httplib, which was not found. "
                        "On Debian: apt-get install libcpp-httplib-dev")
  endif()
  mark_as_advanced(CIRCLINE_EXIF_LIBRARY CIRCLINE_EXIF_INCLUDE_DIR)
endif()
if(CIRCLINE_BUILD_APPS AND CIRCLINE_WITH_MPI)
  circline_find(MPI libopenmpi-dev COMPONENTS CXX)
endif()
# A function of its own, as ViSP's package adds -fopenmp to the flags of all that follows.
function(circline_find_visp)
  circline_find(VISP libvisp-dev 3.5)
endfunction()
if(CIRCLINE_BUILD_APPS AND CIRCLINE_WITH_VISP)
  circline_find_visp()
endif()
if(CIRCLINE_BUILD_TESTS)
  circline_find(GTest libgtest-dev CONFIG)
endif()
if(CIRCLINE_BUILD_BENCHMARKS)
  circline_find(benchmark libbenchmark-dev CONFIG)
endif()
