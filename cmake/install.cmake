# What `cmake --install` puts where. The library is shared and its dependencies are private to it, so a program that
# uses it looks for nothing else. CMake package and pkg-config file both find themselves: the prefix may be moved.
include(CMakePackageConfigHelpers)

install(TARGETS vdbshade EXPORT vdbshade-targets
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
        INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(TARGETS vdbshade_oiio vdbshade_openvdb LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})

# The program stands elsewhere, seen from the library, than in the build folder, and so is linked once more.
cmake_path(IS_ABSOLUTE CMAKE_INSTALL_LIBDIR absolute)
if(absolute)
  set(VSH_LIBRARY_RPATH ${CMAKE_INSTALL_LIBDIR})
else()
  set(VSH_LIBRARY_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
endif()
add_executable(vdbshade_cli_installed $<TARGET_OBJECTS:vdbshade_cli>)
target_link_libraries(vdbshade_cli_installed PRIVATE $<TARGET_PROPERTY:vdbshade_cli,LINK_LIBRARIES>)
set_target_properties(vdbshade_cli_installed PROPERTIES
                      OUTPUT_NAME vdbshade RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/installed
                      INSTALL_RPATH "${VSH_LIBRARY_RPATH}" BUILD_WITH_INSTALL_RPATH ON LINKER_LANGUAGE C)
install(TARGETS vdbshade_cli_installed RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS vdbshade_reader RUNTIME DESTINATION ${VSH_READER_DIR})
install(FILES LICENSE docs/licences.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY src/bindings/blender/vdbshade_bake DESTINATION ${CMAKE_INSTALL_DATADIR}/vdbshade/blender FILES_MATCHING PATTERN "*.py")
install(DIRECTORY include/vdbshade DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")

set(VSH_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/vdbshade)
install(EXPORT vdbshade-targets NAMESPACE vdbshade:: DESTINATION ${VSH_PACKAGE_DIR})
configure_package_config_file(cmake/vdbshade-config.cmake.in vdbshade-config.cmake
                              INSTALL_DESTINATION ${VSH_PACKAGE_DIR} NO_SET_AND_CHECK_MACRO)
# Below 1.0 a minor version may change the interface.
write_basic_package_version_file(vdbshade-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/vdbshade-config.cmake
              ${CMAKE_CURRENT_BINARY_DIR}/vdbshade-config-version.cmake
        DESTINATION ${VSH_PACKAGE_DIR})

# Folders that were given as absolute paths stay so; the others are found from where the .pc file lies.
set(VSH_PC_DIR ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
foreach(kind LIBDIR INCLUDEDIR)
  cmake_path(IS_ABSOLUTE CMAKE_INSTALL_${kind} absolute)
  if(absolute)
    set(VSH_PC_${kind} ${CMAKE_INSTALL_${kind}})
  else()
    set(VSH_PC_${kind} "\${prefix}/${CMAKE_INSTALL_${kind}}")
  endif()
endforeach()
cmake_path(IS_ABSOLUTE CMAKE_INSTALL_LIBDIR absolute)
if(absolute)
  set(VSH_PC_PREFIX ${CMAKE_INSTALL_PREFIX})
else()
  file(RELATIVE_PATH VSH_PC_UP "/prefix/${VSH_PC_DIR}" "/prefix")
  string(REGEX REPLACE "/$" "" VSH_PC_UP ${VSH_PC_UP})
  set(VSH_PC_PREFIX "\${pcfiledir}/${VSH_PC_UP}")
endif()
configure_file(cmake/vdbshade.pc.in vdbshade.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/vdbshade.pc DESTINATION ${VSH_PC_DIR})
