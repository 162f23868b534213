# cmake --install, and the package that find_package(circline CONFIG) finds. One export set a
# library, so that a user of circline::estimators needs nothing but Eigen. Components: runtime (shared
# libraries), dev, tools, as cmake/Packages.cmake packs them.
include(CMakePackageConfigHelpers)

set(CIRCLINE_CMAKE_DIR "${CMAKE_INSTALL_LIBDIR}/cmake/circline")

foreach(module estimators ransac detection refine circline)
  install(TARGETS circline_${module} EXPORT circline-${module}
          ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT dev
          LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT runtime
                  NAMELINK_COMPONENT dev
          RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT runtime)
  install(EXPORT circline-${module} NAMESPACE circline:: FILE circline-${module}.cmake
          DESTINATION "${CIRCLINE_CMAKE_DIR}" COMPONENT dev)
endforeach()

foreach(module estimators ransac detection refine)
  get_property(folder GLOBAL PROPERTY CIRCLINE_${module}_FOLDER)
  circline_public_headers(headers ${module})
  install(FILES ${headers} DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/circline/${folder}" COMPONENT dev)
endforeach()
install(FILES "${PROJECT_BINARY_DIR}/include/circline/version.h"
        DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/circline" COMPONENT dev)

configure_package_config_file(
  "${PROJECT_SOURCE_DIR}/cmake/circline-config.cmake.in"
  "${PROJECT_BINARY_DIR}/circline-config.cmake"
  INSTALL_DESTINATION "${CIRCLINE_CMAKE_DIR}")
# Before 1.0 a minor version may change the interface.
write_basic_package_version_file("${PROJECT_BINARY_DIR}/circline-config-version.cmake"
                                 COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/circline-config.cmake"
              "${PROJECT_BINARY_DIR}/circline-config-version.cmake"
        DESTINATION "${CIRCLINE_CMAKE_DIR}" COMPONENT dev)

# pkg-config, for builds without CMake: a file for each library, circline.pc for all. Their prefix is
# where they lie, so that an installation can be moved.
file(RELATIVE_PATH prefix_from_pc "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
string(REGEX REPLACE "/$" "" prefix_from_pc "${prefix_from_pc}")
function(circline_pkg_config pc_name pc_requires pc_requires_private pc_libs pc_description)
  configure_file("${PROJECT_SOURCE_DIR}/cmake/circline.pc.in"
                 "${PROJECT_BINARY_DIR}/pkgconfig/${pc_name}.pc" @ONLY)
  install(FILES "${PROJECT_BINARY_DIR}/pkgconfig/${pc_name}.pc"
          DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig" COMPONENT dev)
endfunction()
circline_pkg_config(circline-estimators "eigen3" "" "-lcircline_estimators"
                    "Closed-form camera poses from circles and parallel lines")
circline_pkg_config(circline-ransac "circline-estimators" "" "-lcircline_ransac"
                    "Robust fits of circles and parallel lines")
# Of OpenCV the two libraries that are used; opencv4 would link all that are installed.
circline_pkg_config(circline-detection "circline-ransac" "opencv4"
                    "-lcircline_detection -lopencv_imgproc -lopencv_core"
                    "Circles and parallel lines in photos")
# Ceres has no file of its own in Debian 12.
circline_pkg_config(circline-refine "circline-estimators" "" "-lcircline_refine -lceres -lglog"
                    "Camera poses from circles and parallel lines, refined by Ceres")
circline_pkg_config(circline "circline-detection circline-refine" "" "" "${PROJECT_DESCRIPTION}")

get_property(apps GLOBAL PROPERTY CIRCLINE_APPS)
if(apps)
  install(TARGETS ${apps} RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT tools)
endif()

# One completion for all programs, found by the name of each; it asks their --help.
set(completions "${CMAKE_INSTALL_DATADIR}/bash-completion/completions")
foreach(app ${apps})
  install(FILES "${PROJECT_SOURCE_DIR}/cmake/completion.bash" DESTINATION "${completions}"
          RENAME ${app} COMPONENT tools)
endforeach()

# Man pages out of --help.
if(CIRCLINE_BUILD_MAN)
  foreach(app ${apps})
    set(page "${PROJECT_BINARY_DIR}/man/${app}.1.gz")
    add_custom_command(OUTPUT "${page}" DEPENDS ${app} VERBATIM
      COMMAND "${CMAKE_COMMAND}" -E make_directory "${PROJECT_BINARY_DIR}/man"
      COMMAND sh -c "set -e; help=$($1 --help | sed -n '1s/^[^:]*: *//p'); $2 -N -n \"$help\" -o $3.plain $1; gzip -9nc $3.plain > $3"
              sh "$<TARGET_FILE:${app}>" "${CIRCLINE_HELP2MAN}" "${page}")
    list(APPEND pages "${page}")
  endforeach()
  add_custom_target(circline_man ALL DEPENDS ${pages})
  install(FILES ${pages} DESTINATION "${CMAKE_INSTALL_MANDIR}/man1" COMPONENT tools)
endif()
