# Test programs link the library's objects, so they can call internal functions.

# Code from TBB's headers is built without the thread sanitizer. TBB's scheduler is not instrumented, so its use of callers' stacks would
# look like races. The functions that loops call are instrumented.
set_source_files_properties(${PROJECT_SOURCE_DIR}/src/base/tbb.cpp PROPERTIES COMPILE_OPTIONS -fno-sanitize=thread)

# Over a hundred test programs link all objects; lld takes a tenth of the time.
include(CheckLinkerFlag)
check_linker_flag(CXX -fuse-ld=lld VSH_LLD)

# vsh_add_program(NAME SOURCES … FOLDERS … LIBRARIES … WRAP …): FOLDERS have headers. The linker redirects calls in WRAP to
# __wrap_CALL() of the test.
function(vsh_add_program name)
  cmake_parse_arguments(PARSE_ARGV 1 given "" "" "SOURCES;FOLDERS;LIBRARIES;WRAP")
  add_executable(${name} ${given_SOURCES})
  vsh_set_flags(${name})
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>) # more optimisation costs more than it saves
  target_compile_options(${name} PRIVATE -Wno-unused-parameter) # cmocka passes a state that few tests need
  if(VSH_LLD)
    target_link_options(${name} PRIVATE -fuse-ld=lld)
  endif()
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/src ${given_FOLDERS})
  target_compile_definitions(${name} PRIVATE VSH_ASSETS="${PROJECT_SOURCE_DIR}/assets"
                             VSH_MODELS="${PROJECT_SOURCE_DIR}/tests/models"
                             VSH_DOCS="${PROJECT_SOURCE_DIR}/docs")
  target_link_libraries(${name} PRIVATE vdbshade_objects vdbshade_importers_objects ${given_LIBRARIES}
                        vdbshade_openvdb_objects vsh::openvdb vsh::assimp vsh::draco vsh::dependencies)
  add_dependencies(${name} vdbshade_oiio) # loaded, not linked
  set_target_properties(${name} PROPERTIES LINKER_LANGUAGE CXX)
  foreach(call ${given_WRAP})
    target_link_options(${name} PRIVATE LINKER:--wrap=${call})
  endforeach()
endfunction()

# vsh_add_test(NAME SOURCES … [ARGUMENTS …] …): adds such a program as a test, run with ARGUMENTS.
function(vsh_add_test name)
  cmake_parse_arguments(PARSE_ARGV 1 given "" "" "SOURCES;FOLDERS;LIBRARIES;WRAP;ARGUMENTS")
  vsh_add_program(${name} SOURCES ${given_SOURCES} FOLDERS ${given_FOLDERS} LIBRARIES ${given_LIBRARIES}
                  WRAP ${given_WRAP})
  add_test(NAME ${name} COMMAND ${name} ${given_ARGUMENTS})
endfunction()

# vsh_add_cli_test(NAME FILE): adds a Bats file as the test cli_NAME. It compiles programs with the library's sanitizer.
function(vsh_add_cli_test name file)
  add_test(NAME cli_${name} COMMAND ${VSH_BATS} ${file})
  set(flags "")
  if(VSH_SANITIZE)
    set(flags "-fsanitize=${VSH_SANITIZE}")
    if(CMAKE_C_COMPILER_ID MATCHES Clang) # see cmake/flags.cmake
      string(APPEND flags " -fsanitize-link-c++-runtime -lstdc++")
    endif()
  endif()
  set_property(TEST cli_${name} PROPERTY ENVIRONMENT "ASSETS=${PROJECT_SOURCE_DIR}/assets" "DOCS=${PROJECT_SOURCE_DIR}/docs"
               "CC=${CMAKE_C_COMPILER}" "VDBSHADE=$<TARGET_FILE:vdbshade_cli>" "CFLAGS=${flags}")
endfunction()
