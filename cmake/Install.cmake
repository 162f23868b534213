# cmake --install, and the package that find_package(circline CONFIG) finds. One export set a
# library, so that a user of circline::estimators needs nothing but Eigen.
include(CMakePackageConfigHelpers)

set(CIRCLINE_CMAKE_DIR "${CMAKE_INSTALL_LIBDIR}/cmake/circline")

foreach(module estimators ransac detection refine circline)
  install(TARGETS circline_${module} EXPORT circline-${module}
          ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}"
          LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}"
          RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
  install(EXPORT circline-${module} NAMESPACE circline:: FILE circline-${module}.cmake
          DESTINATION "${CIRCLINE_CMAKE_DIR}")
endforeach()

foreach(module estimators ransac detection refine)
  get_property(folder GLOBAL PROPERTY CIRCLINE_${module}_FOLDER)
  file(GLOB headers CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/${folder}/*.h")
  get_property(private_headers GLOBAL PROPERTY CIRCLINE_${module}_PRIVATE_HEADERS)
  foreach(header ${private_headers})
    list(REMOVE_ITEM headers "${PROJECT_SOURCE_DIR}/${folder}/${header}")
  endforeach()
  install(FILES ${headers} DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/circline/${folder}")
endforeach()

foreach(app calibrate compare reconstruct simulate track)
  if(TARGET circline_${app})
    install(TARGETS circline_${app} RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
  endif()
endforeach()

configure_package_config_file(
  "${PROJECT_SOURCE_DIR}/cmake/circline-config.cmake.in"
  "${PROJECT_BINARY_DIR}/circline-config.cmake"
  INSTALL_DESTINATION "${CIRCLINE_CMAKE_DIR}")
# Before 1.0 a minor version may change the interface.
write_basic_package_version_file("${PROJECT_BINARY_DIR}/circline-config-version.cmake"
                                 COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/circline-config.cmake"
              "${PROJECT_BINARY_DIR}/circline-config-version.cmake"
        DESTINATION "${CIRCLINE_CMAKE_DIR}")
