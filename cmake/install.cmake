# Installation by component: library, development, program, documentation. Users of the shared library need none of its
# dependencies. The CMake package and the pkg-config file use relative paths, so the prefix may be moved.
include(CMakePackageConfigHelpers)

install(TARGETS vdbshade EXPORT vdbshade-targets
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT development
        INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
if(VSH_MODULES)
  install(TARGETS ${VSH_MODULES} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/vdbshade COMPONENT library)
endif()

# The installed program has another relative path to the library than the build's, so it is linked again.
cmake_path(IS_ABSOLUTE CMAKE_INSTALL_LIBDIR absolute)
if(absolute)
  set(VSH_LIBRARY_RPATH ${CMAKE_INSTALL_LIBDIR})
else()
  set(VSH_LIBRARY_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
endif()
add_executable(vdbshade_cli_installed $<TARGET_OBJECTS:vdbshade_cli> ${VSH_CLI_OBJECTS})
target_link_libraries(vdbshade_cli_installed PRIVATE $<TARGET_PROPERTY:vdbshade_cli,LINK_LIBRARIES>)
set_target_properties(vdbshade_cli_installed PROPERTIES
                      OUTPUT_NAME vdbshade RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/installed
                      INSTALL_RPATH "${VSH_LIBRARY_RPATH}" BUILD_WITH_INSTALL_RPATH ON LINKER_LANGUAGE C)
install(TARGETS vdbshade_cli_installed RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
install(TARGETS vdbshade_reader RUNTIME DESTINATION ${VSH_READER_DIR} COMPONENT library)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT library)
install(DIRECTORY src/bindings/blender/vdbshade_bake DESTINATION ${CMAKE_INSTALL_DATADIR}/vdbshade/blender COMPONENT program
        FILES_MATCHING PATTERN "*.py")
install(DIRECTORY include/vdbshade DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development FILES_MATCHING PATTERN "*.h")
install(FILES README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT documentation)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT documentation FILES_MATCHING PATTERN "*.md" PATTERN "*.png")
install(DIRECTORY examples assets DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT documentation)

# The static library includes level sets and importers; images other than EXR and PNG stay in their module. Its users link its
# dependencies by name, so the linker searches its usual folders.
option(VSH_STATIC "Build the static library too" ON)
if(VSH_STATIC AND NOT VSH_SANITIZE)
  add_library(vdbshade_static STATIC)
  vsh_set_source_flags(vdbshade_static)
  target_compile_definitions(vdbshade_static PRIVATE VSH_BUILD VSHI_SOVERSION="${VSH_SOVERSION}")
  target_include_directories(vdbshade_static PRIVATE src include)
  foreach(objects ${VSH_STATIC_PARTS})
    target_sources(vdbshade_static PRIVATE $<TARGET_OBJECTS:${objects}>)
  endforeach()
  if(NOT VSH_OPENVDB)
    target_sources(vdbshade_static PRIVATE ${VSH_OPENVDB_CALLS})
  endif()
  if(NOT VSH_ASSIMP)
    target_sources(vdbshade_static PRIVATE ${VSH_IMPORTERS_CALLS})
  endif()
  foreach(found openvdb half png assimp draco meshoptimizer jansson nettle sleef seccomp)
    if(NOT TARGET vsh::${found}) # left out
      continue()
    endif()
    cmake_path(GET VSH_${found}_LIBRARY FILENAME file)
    string(REGEX REPLACE "^lib(.*)\\.(so|a|dylib)$" "\\1" file ${file})
    list(APPEND VSH_STATIC_NEEDS ${file})
  endforeach()
  list(APPEND VSH_STATIC_NEEDS tbb OpenEXRCore freetype z)
  list(APPEND VSH_STATIC_NEEDS stdc++ ${CMAKE_DL_LIBS} pthread m)
  set_target_properties(vdbshade_static PROPERTIES OUTPUT_NAME vdbshade EXPORT_NAME static INTERFACE_LINK_LIBRARIES "${VSH_STATIC_NEEDS}")
  target_include_directories(vdbshade_static INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  install(TARGETS vdbshade_static EXPORT vdbshade-static-targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
          INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
endif()
list(TRANSFORM VSH_STATIC_NEEDS PREPEND "-l" OUTPUT_VARIABLE VSH_PC_PRIVATE)
list(JOIN VSH_PC_PRIVATE " " VSH_PC_PRIVATE)

set(VSH_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/vdbshade)
install(EXPORT vdbshade-targets NAMESPACE vdbshade:: DESTINATION ${VSH_PACKAGE_DIR} COMPONENT development)
if(TARGET vdbshade_static)
  install(EXPORT vdbshade-static-targets NAMESPACE vdbshade:: DESTINATION ${VSH_PACKAGE_DIR} COMPONENT development)
endif()
configure_package_config_file(cmake/vdbshade-config.cmake.in vdbshade-config.cmake
                              INSTALL_DESTINATION ${VSH_PACKAGE_DIR} PATH_VARS CMAKE_INSTALL_BINDIR NO_SET_AND_CHECK_MACRO)
# Below 1.0 a minor version may change the interface.
write_basic_package_version_file(vdbshade-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/vdbshade-config.cmake
              ${CMAKE_CURRENT_BINARY_DIR}/vdbshade-config-version.cmake
        DESTINATION ${VSH_PACKAGE_DIR} COMPONENT development)

# Absolute folders stay absolute; others are relative to the .pc file.
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
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/vdbshade.pc DESTINATION ${VSH_PC_DIR} COMPONENT development)
