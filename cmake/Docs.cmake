# The documentation's site: guides and the reference of all public headers, by Doxygen, where it is
# there; nothing is downloaded. Warnings are errors, and what is public needs a comment.
find_program(CIRCLINE_DOXYGEN doxygen)
mark_as_advanced(CIRCLINE_DOXYGEN)
if(CIRCLINE_DOXYGEN)
  circline_public_headers(headers)
  file(GLOB guides CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/docs/guide/*.md"
                                     "${PROJECT_SOURCE_DIR}/docs/*.md")
  set(site_input ${headers} ${guides})
  list(TRANSFORM site_input REPLACE "(.+)" "\"\\1\"")
  list(JOIN site_input " " site_input)
  configure_file(docs/site/Doxyfile.in Doxyfile @ONLY)
  add_custom_target(circline_site VERBATIM
    COMMAND "${CMAKE_COMMAND}" -E make_directory "${PROJECT_BINARY_DIR}/site"
    COMMAND "${CIRCLINE_DOXYGEN}" "${PROJECT_BINARY_DIR}/Doxyfile"
    # What pages point to by its place in the sources.
    COMMAND sh -c "cp -r docs/pictures docs/examples \"$1/html\" && cp -r docs/examples docs/example.cc estimators ransac refine \"$1\""
            sh "${PROJECT_BINARY_DIR}/site"
    WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}")
endif()
