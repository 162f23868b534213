# How circline's own targets are made.
#
# Sources are globbed: a room of a module is a .h/.cc pair (and a test of the same name), so the
# folder itself is the list, and CONFIGURE_DEPENDS makes the build notice a new file by itself.

# Warnings and language level of our own sources; PRIVATE, so that users inherit none of it.
# -Wsign-conversion stays out: with int and Eigen::Index as loop variables over std::vector it
# asks for a cast in every line and has nothing to say.
function(circline_own_target target)
  target_compile_features(${target} PUBLIC cxx_std_17)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wconversion -Wnon-virtual-dtor -Woverloaded-virtual
    $<$<BOOL:${CIRCLINE_WERROR}>:-Werror>)
  if(NOT CMAKE_UNITY_BUILD)  # There a name of one file hides that of another.
    target_compile_options(${target} PRIVATE -Wshadow)
  endif()
  # GCC 12 warns of "a" + std::string as C++20, wrongly (its bug 105651).
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13 AND
     CMAKE_CXX_STANDARD VERSION_GREATER_EQUAL 20)
    target_compile_options(${target} PRIVATE
      -Wno-array-bounds -Wno-restrict -Wno-stringop-overflow -Wno-stringop-overread)
  endif()
  # Clang 19 warns of what std::stable_sort uses within the library of GCC 12.
  if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang" AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 19)
    target_compile_options(${target} PRIVATE -Wno-deprecated-declarations)
  endif()
  if(CIRCLINE_SANITIZE)
    # GCC guesses wrong on code that the sanitizers have rewritten.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  endif()
  # A third of clang's time is in these. A build without them shows that every file names what it
  # uses.
  if(CIRCLINE_PRECOMPILE)
    target_precompile_headers(${target} PRIVATE <Eigen/Dense> <algorithm> <functional> <map>
                                                <memory> <optional> <sstream> <string> <vector>)
  endif()
endfunction()

# What a library shows and is called where it is shared. Hidden is all but what public headers
# declare (estimators/export.h); of what other libraries' templates leave in our objects the linker's
# script hides the rest. Tests and benchmarks reach inside: for theirs everything is shown.
if(BUILD_SHARED_LIBS AND (CIRCLINE_BUILD_TESTS OR CIRCLINE_BUILD_BENCHMARKS))
  set(CIRCLINE_HIDE OFF)
else()
  set(CIRCLINE_HIDE ON)
endif()
set(CIRCLINE_EXPORTS "${CMAKE_CURRENT_LIST_DIR}/exports.map")
function(circline_shared_library target)
  set_target_properties(${target} PROPERTIES VERSION ${PROJECT_VERSION}
                                             SOVERSION ${CIRCLINE_SOVERSION} DEFINE_SYMBOL ""
                                             INSTALL_RPATH "$ORIGIN")
  if(CIRCLINE_HIDE AND UNIX AND NOT APPLE)
    target_link_options(${target} PRIVATE
      $<$<STREQUAL:$<TARGET_PROPERTY:${target},TYPE>,SHARED_LIBRARY>:LINKER:--version-script=${CIRCLINE_EXPORTS}>)
    set_target_properties(${target} PROPERTIES LINK_DEPENDS "${CIRCLINE_EXPORTS}")
  endif()
endfunction()

# circline_module(<folder> PUBLIC <targets> PRIVATE <targets> PRIVATE_HEADERS <files> PARTS <folders>):
# the library of a folder and of folders in it, circline_<name> after the last part of its path, known
# to users as circline::<name>. The headers of the folder itself are public and get installed, except
# for PRIVATE_HEADERS.
function(circline_module folder)
  cmake_parse_arguments(ARG "" "" "PUBLIC;PRIVATE;PRIVATE_HEADERS;PARTS" ${ARGN})
  get_filename_component(module "${folder}" NAME)
  set_property(GLOBAL PROPERTY CIRCLINE_${module}_FOLDER "${folder}")
  set_property(GLOBAL PROPERTY CIRCLINE_${module}_PRIVATE_HEADERS ${ARG_PRIVATE_HEADERS})
  set(target circline_${module})
  set(patterns *.cc)
  foreach(part ${ARG_PARTS})
    list(APPEND patterns ${part}/*.cc)
  endforeach()
  list(TRANSFORM patterns PREPEND "${CMAKE_CURRENT_SOURCE_DIR}/")
  file(GLOB sources CONFIGURE_DEPENDS ${patterns})
  # Headers are "circline/<folder>/x.h" before and after installation; a folder within another is
  # there already.
  file(MAKE_DIRECTORY "${PROJECT_BINARY_DIR}/include/circline")
  if(NOT EXISTS "${PROJECT_BINARY_DIR}/include/circline/${folder}")
    file(CREATE_LINK "${CMAKE_CURRENT_SOURCE_DIR}"
         "${PROJECT_BINARY_DIR}/include/circline/${folder}" SYMBOLIC)
  endif()

  add_library(${target} ${sources})
  circline_own_target(${target})
  # What GCC takes to choose among Eigen's operators grows with the square of the expressions that
  # a unit has seen: 32 files of estimators as one take it more than twice as long as eight times four.
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    set_target_properties(${target} PROPERTIES UNITY_BUILD_BATCH_SIZE 4)
  endif()
  circline_shared_library(${target})
  # Clang hides a function whose definition stands in a namespace without the attribute, whatever its
  # header says: there the linker's script alone hides, and internal headers show.
  if(CIRCLINE_HIDE AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    set_target_properties(${target} PROPERTIES CXX_VISIBILITY_PRESET hidden
                                               VISIBILITY_INLINES_HIDDEN ON)
  endif()
  target_include_directories(${target} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(${target} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  add_library(circline::${module} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${module})
endfunction()

# Sets <headers> to the public headers of a module, or of all of them.
function(circline_public_headers headers)
  set(modules ${ARGN})
  if(NOT modules)
    set(modules estimators ransac detection refine)
  endif()
  set(found)
  foreach(module ${modules})
    get_property(folder GLOBAL PROPERTY CIRCLINE_${module}_FOLDER)
    file(GLOB files CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/${folder}/*.h")
    get_property(private_headers GLOBAL PROPERTY CIRCLINE_${module}_PRIVATE_HEADERS)
    list(TRANSFORM private_headers PREPEND "${PROJECT_SOURCE_DIR}/${folder}/")
    list(REMOVE_ITEM files ${private_headers})
    list(APPEND found ${files})
  endforeach()
  set(${headers} "${found}" PARENT_SCOPE)
endfunction()

# circline_app(<name> <targets>): the program circline_<name> of the folder <name>, if that has a
# main.cc. All the rest is an internal library, circline_<name>_lib, for its tests and other programs.
# Headers are "apps/<name>/x.h".
function(circline_app name)
  file(GLOB sources CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/${name}/*.cc")
  set(main "${CMAKE_CURRENT_SOURCE_DIR}/${name}/main.cc")
  list(REMOVE_ITEM sources "${main}")
  if(sources)
    add_library(circline_${name}_lib STATIC ${sources})
    circline_own_target(circline_${name}_lib)
    target_include_directories(circline_${name}_lib PUBLIC "${PROJECT_SOURCE_DIR}")
    target_link_libraries(circline_${name}_lib PUBLIC ${ARGN})
  endif()
  if(EXISTS "${main}")
    add_executable(circline_${name} "${main}")
    circline_own_target(circline_${name})
    target_include_directories(circline_${name} PRIVATE "${PROJECT_SOURCE_DIR}")
    target_link_libraries(circline_${name} PRIVATE ${ARGN})
    if(sources)
      target_link_libraries(circline_${name} PRIVATE circline_${name}_lib)
    endif()
    set_property(GLOBAL APPEND PROPERTY CIRCLINE_APPS circline_${name})
    if(BUILD_SHARED_LIBS)  # An installation finds its own libraries, wherever it is moved.
      file(RELATIVE_PATH libraries "/${CMAKE_INSTALL_BINDIR}" "/${CMAKE_INSTALL_LIBDIR}")
      set_target_properties(circline_${name} PROPERTIES INSTALL_RPATH "$ORIGIN/${libraries}")
    endif()
  endif()
endfunction()

# circline_test(<folder> <targets>): all *.cc of the folder as circline_<name>_test, after the last
# part of its path, one ctest entry per case. Test helpers are "tests/x.h".
function(circline_test folder)
  file(GLOB sources CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*.cc")
  if(NOT sources)
    return()
  endif()
  get_filename_component(name "${folder}" NAME)
  set(target circline_${name}_test)
  add_executable(${target} ${sources})
  circline_own_target(${target})
  target_include_directories(${target} PRIVATE "${PROJECT_SOURCE_DIR}")
  target_compile_definitions(${target} PRIVATE CIRCLINE_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  # What runs once is sooner done where it is compiled with less effort, at which GCC guesses wrong;
  # the libraries are optimised as ever.
  target_compile_options(${target} PRIVATE
    "$<$<CONFIG:Release>:-O1;$<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>>")
  if(CIRCLINE_SANITIZE)
    target_compile_definitions(${target} PRIVATE CIRCLINE_SANITIZED)
  endif()
  target_link_libraries(${target} PRIVATE ${ARGN} GTest::gtest GTest::gtest_main Threads::Threads)
  gtest_discover_tests(${target} TEST_PREFIX ${name}. DISCOVERY_MODE PRE_TEST
                       DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 600)
endfunction()
