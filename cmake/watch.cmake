# Tests, and the sanitizers that watch them in every test run.
#
# Our sources, but for those that are compiled against OpenVDB's headers, and the tests are compiled once more with each
# sanitizer; the tests run as NAME, address.NAME and thread.NAME, and the command line's with a vdbshade that is made of
# those objects. tools/sanitize compiles everything with them.
if(VSH_WATCH AND NOT VSH_SANITIZE)
  set(VSH_WATCHES address thread)
endif()
set(VSH_WATCH_address address,undefined)
set(VSH_WATCH_thread thread)

# `address` leaves out what takes more than a minute with it, and what is compiled against OpenVDB's or OpenImageIO's
# headers; `thread` is for what has threads of ours meet. tools/sanitize leaves out nothing.
set(VSH_WATCH_address_NOT
    test_alone test_band test_bits test_claims test_grid test_grid_mesh test_image_errors test_lattice test_magnitudes test_relations test_share # minutes
    test_bitflips test_grid_file test_grid_values test_image_picture test_image_png test_reader test_reader_checks test_scene_grids
    test_volume_file)
set(VSH_WATCH_address_CLI accuracy casters channels flat hostile info input masks output provenance regress usage view voxelize)
set(VSH_WATCH_thread_ONLY test_compare test_host test_layers test_lightmap test_texels)

set(suppressions ${PROJECT_SOURCE_DIR}/tests/suppressions)
set(watched ${PROJECT_SOURCE_DIR}/tests/watched.sh) # runs a test again where a sanitizer itself crashed
set(VSH_WATCH_address_ENVIRONMENT
    "ASAN_OPTIONS=detect_leaks=1:strict_string_checks=1:detect_stack_use_after_return=1:allocator_may_return_null=1:exitcode=99"
    "LSAN_OPTIONS=suppressions=${suppressions}/lsan.txt:print_suppressions=0"
    "UBSAN_OPTIONS=suppressions=${suppressions}/ubsan.txt:print_stacktrace=1" VSH_SLOWER=10)
# Libraries that were not built with the sanitizer are not judged for their calls of free, memcpy and the like.
set(VSH_WATCH_thread_ENVIRONMENT
    "TSAN_OPTIONS=suppressions=${suppressions}/tsan.txt:ignore_noninstrumented_modules=1:history_size=7:allocator_may_return_null=1:exitcode=99"
    VSH_SLOWER=10)

# What TBB's headers expand into is not watched by `thread`: the scheduler, which is not seen, orders what it does on its
# callers' stacks, and a later use of such a stack would seem to race with it. What the loops call is watched.
set_source_files_properties(${PROJECT_SOURCE_DIR}/src/extern/tbb.cpp PROPERTIES COMPILE_OPTIONS -fno-sanitize=thread)

# There are hundreds of test programs, each of all the objects: lld links one in a tenth of the time.
include(CheckLinkerFlag)
check_linker_flag(CXX -fuse-ld=lld VSH_LLD)

function(vsh_watch target watch)
  target_compile_options(${target} PRIVATE -O1 -g1 -fsanitize=${VSH_WATCH_${watch}} ${VSH_SANITIZE_FLAGS}
                         $<$<COMPILE_LANGUAGE:C>:-Wno-frame-larger-than>)
  target_link_options(${target} PRIVATE -fsanitize=${VSH_WATCH_${watch}})
endfunction()

# vsh_add_watched(NAME SOURCE…): object libraries SANITIZER.NAME, compiled as NAME is and with the sanitizer.
function(vsh_add_watched name)
  foreach(watch ${VSH_WATCHES})
    vsh_add_objects(${watch}.${name} ${ARGN})
    vsh_watch(${watch}.${name} ${watch})
    set_target_properties(${watch}.${name} PROPERTIES EXCLUDE_FROM_ALL ON)
  endforeach()
endfunction()

vsh_add_watched(vdbshade_objects ${VSH_SOURCES})
vsh_add_watched(vdbshade_cli_objects ${VSH_CLI_SOURCES})
vsh_add_watched(vdbshade_importers_objects ${VSH_IMPORTERS_SOURCES})
foreach(watch ${VSH_WATCHES})
  vsh_add_kernels(${watch}.vdbshade_objects)
endforeach()

# vsh_add_program(NAME WATCH SOURCES … FOLDERS … LIBRARIES … WRAP …): a program of the library's own objects and other
# libraries; FOLDERS are those of headers, calls in WRAP are sent through it by the linker. With WATCH, not "", it and
# those of the libraries that exist as WATCH.LIBRARY are compiled with that sanitizer.
function(vsh_add_program name watch)
  cmake_parse_arguments(PARSE_ARGV 2 given "" "" "SOURCES;FOLDERS;LIBRARIES;WRAP")
  add_executable(${name} ${given_SOURCES})
  vsh_set_flags(${name})
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>) # more takes longer than it saves
  if(VSH_LLD)
    target_link_options(${name} PRIVATE -fuse-ld=lld)
  endif()
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/src ${given_FOLDERS})
  target_compile_definitions(${name} PRIVATE VSH_ASSETS="${PROJECT_SOURCE_DIR}/assets"
                             VSH_MODELS="${PROJECT_SOURCE_DIR}/tests/models"
                             VSH_DOCS="${PROJECT_SOURCE_DIR}/docs")
  foreach(library vdbshade_objects vdbshade_importers_objects ${given_LIBRARIES})
    if(watch AND TARGET ${watch}.${library})
      set(library ${watch}.${library})
    endif()
    target_link_libraries(${name} PRIVATE ${library})
  endforeach()
  target_link_libraries(${name} PRIVATE vdbshade_openvdb_objects vsh::openvdb vsh::assimp vsh::draco vsh::dependencies)
  add_dependencies(${name} vdbshade_oiio) # which is loaded, not linked
  set_target_properties(${name} PROPERTIES LINKER_LANGUAGE CXX)
  foreach(call ${given_WRAP})
    target_link_options(${name} PRIVATE LINKER:--wrap=${call})
  endforeach()
  if(watch)
    vsh_watch(${name} ${watch})
  endif()
endfunction()

# vsh_set_watched(TEST WATCH): how a test of a program with that sanitizer is run.
function(vsh_set_watched test watch)
  # kernels that place memory at random further than the runtime of an older compiler can follow
  set_property(TEST ${test} PROPERTY SKIP_REGULAR_EXPRESSION "Sanitizer: unexpected memory mapping"
               "Shadow memory range interleaves with an existing memory mapping")
  set_property(TEST ${test} APPEND PROPERTY ENVIRONMENT ${VSH_WATCH_${watch}_ENVIRONMENT}
               LD_LIBRARY_PATH=${PROJECT_BINARY_DIR}) # of the module: with a sanitizer no RUNPATH leads there
endfunction()

# vsh_add_test(NAME SOURCES … [ARGUMENTS …] …): such a program, run as a test with ARGUMENTS; and again with each
# sanitizer whose lists above have it.
function(vsh_add_test name)
  cmake_parse_arguments(PARSE_ARGV 1 given "" "" "SOURCES;FOLDERS;LIBRARIES;WRAP;ARGUMENTS")
  set(parts SOURCES ${given_SOURCES} FOLDERS ${given_FOLDERS} LIBRARIES ${given_LIBRARIES} WRAP ${given_WRAP})
  vsh_add_program(${name} "" ${parts})
  add_test(NAME ${name} COMMAND ${name} ${given_ARGUMENTS})
  foreach(watch ${VSH_WATCHES})
    if(name IN_LIST VSH_WATCH_${watch}_ONLY OR (NOT VSH_WATCH_${watch}_ONLY AND NOT name IN_LIST VSH_WATCH_${watch}_NOT))
      vsh_add_program(${watch}.${name} ${watch} ${parts})
      add_test(NAME ${watch}.${name} COMMAND ${watched} $<TARGET_FILE:${watch}.${name}> ${given_ARGUMENTS})
      vsh_set_watched(${watch}.${name} ${watch})
    endif()
  endforeach()
endfunction()

# vsh_add_cli_test(NAME FILE): a Bats file that runs the command line, as a test cli_NAME; and again with each sanitizer
# whose list above has it. What it compiles, it compiles as the library is.
function(vsh_add_cli_test name file)
  set(environment "ASSETS=${PROJECT_SOURCE_DIR}/assets" "DOCS=${PROJECT_SOURCE_DIR}/docs" "CC=${CMAKE_C_COMPILER}")
  add_test(NAME cli_${name} COMMAND ${VSH_BATS} ${file})
  set(flags "")
  if(VSH_SANITIZE)
    set(flags "-fsanitize=${VSH_SANITIZE}")
    if(CMAKE_C_COMPILER_ID MATCHES Clang) # see cmake/flags.cmake
      string(APPEND flags " -fsanitize-link-c++-runtime -lstdc++")
    endif()
  endif()
  set_property(TEST cli_${name} PROPERTY ENVIRONMENT ${environment} "VDBSHADE=$<TARGET_FILE:vdbshade_cli>" "CFLAGS=${flags}")
  foreach(watch ${VSH_WATCHES})
    if(name IN_LIST VSH_WATCH_${watch}_CLI)
      if(NOT TARGET ${watch}.vdbshade_cli)
        vsh_add_program(${watch}.vdbshade_cli ${watch} SOURCES ${VSH_CLI_MAIN}
                        LIBRARIES vdbshade_cli_objects vdbshade_help_pages vsh::jansson)
        set_target_properties(${watch}.vdbshade_cli PROPERTIES OUTPUT_NAME vdbshade RUNTIME_OUTPUT_DIRECTORY ${watch})
      endif()
      add_test(NAME ${watch}.cli_${name} COMMAND ${watched} ${VSH_BATS} ${file})
      set_property(TEST ${watch}.cli_${name} PROPERTY ENVIRONMENT ${environment}
                   "VDBSHADE=$<TARGET_FILE:${watch}.vdbshade_cli>")
      vsh_set_watched(${watch}.cli_${name} ${watch})
    endif()
  endforeach()
endfunction()
