# Pages of the C interface, if Doxygen is installed. The test `api` checks that every symbol has a comment.
find_program(VSH_DOXYGEN doxygen)
mark_as_advanced(VSH_DOXYGEN)
configure_file(cmake/Doxyfile.in Doxyfile @ONLY)
if(VSH_DOXYGEN)
  file(GLOB headers CONFIGURE_DEPENDS include/vdbshade/*.h)
  add_custom_command(OUTPUT ${PROJECT_BINARY_DIR}/api/done
                     COMMAND ${CMAKE_COMMAND} -E rm -rf ${PROJECT_BINARY_DIR}/api
                     COMMAND ${CMAKE_COMMAND} -E make_directory ${PROJECT_BINARY_DIR}/api
                     COMMAND ${VSH_DOXYGEN} ${PROJECT_BINARY_DIR}/Doxyfile
                     COMMAND ${CMAKE_COMMAND} -E touch ${PROJECT_BINARY_DIR}/api/done
                     DEPENDS ${headers} cmake/doxygen.awk cmake/Doxyfile.in VERBATIM)
  add_custom_target(api ALL DEPENDS ${PROJECT_BINARY_DIR}/api/done)
  install(DIRECTORY ${PROJECT_BINARY_DIR}/api/html/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/api COMPONENT documentation)
endif()
