# The Python module: src/bindings/python/vdbshade and declarations that generate.py makes from the public headers and bindings.h.
# PYTHONPATH=FOLDER/python uses it from a build folder.
#
# Uses the system's Python, which has Debian's cffi and numpy, not the first one in PATH.
find_program(VSH_PYTHON_PROGRAM NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH DOC "Python with cffi")
find_program(VSH_PYTHON_PROGRAM NAMES python3)
execute_process(COMMAND ${VSH_PYTHON_PROGRAM} -c "import sys, cffi; print(f'python{sys.version_info[0]}.{sys.version_info[1]}')"
                OUTPUT_VARIABLE VSH_PYTHON_VERSION OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_VARIABLE missing RESULT_VARIABLE failed)
set(wanted ON)
if(failed AND NOT VSH_TESTS)
  set(wanted OFF)
endif()
option(VSH_PYTHON "Build the Python module, and install it" ${wanted})
if(NOT VSH_PYTHON)
  message(STATUS "No Python module (VSH_PYTHON=OFF): install python3-cffi, and configure with -DVSH_PYTHON=ON")
  return()
endif()
if(failed)
  message(FATAL_ERROR "VSH_PYTHON: ${VSH_PYTHON_PROGRAM} has no cffi (python3-cffi): ${missing}")
endif()

set(python ${PROJECT_SOURCE_DIR}/src/bindings/python)
set(private ${PROJECT_SOURCE_DIR}/src/bindings/bindings.h)
set(VSH_PYTHON_FOLDER ${PROJECT_BINARY_DIR}/python/vdbshade)
file(GLOB sources CONFIGURE_DEPENDS RELATIVE ${python}/vdbshade ${python}/vdbshade/*.py ${python}/vdbshade/*.pyi
     ${python}/vdbshade/py.typed)
file(GLOB public CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/include/vdbshade/*.h)
set(made ${VSH_PYTHON_FOLDER}/_abi.py ${VSH_PYTHON_FOLDER}/_version.py ${VSH_PYTHON_FOLDER}/types.py)
add_custom_command(OUTPUT ${made}
                   COMMAND ${VSH_PYTHON_PROGRAM} ${python}/generate.py ${PROJECT_SOURCE_DIR}/include ${private} ${VSH_PYTHON_FOLDER}
                   DEPENDS ${python}/generate.py ${public} ${private}
                   COMMENT "Declarations for Python" VERBATIM)
foreach(source ${sources})
  add_custom_command(OUTPUT ${VSH_PYTHON_FOLDER}/${source}
                     COMMAND ${CMAKE_COMMAND} -E copy ${python}/vdbshade/${source} ${VSH_PYTHON_FOLDER}/${source}
                     DEPENDS ${python}/vdbshade/${source} COMMENT "" VERBATIM)
  list(APPEND made ${VSH_PYTHON_FOLDER}/${source})
endforeach()
add_custom_target(vdbshade_python ALL DEPENDS ${made})
add_dependencies(vdbshade_python vdbshade ${VSH_MODULES} vdbshade_reader)

# The library's path relative to the package. Debian's Python has its packages in lib/python3, under /usr/local in a folder with its
# version.
function(vsh_write_location file library)
  file(CONFIGURE OUTPUT ${file} CONTENT "# Written when vdbshade is built: where the library is, from here.\nLIBRARY = \"${library}\"\n")
endfunction()
vsh_write_location(${VSH_PYTHON_FOLDER}/_location.py ../../libvdbshade.so.${VSH_SOVERSION})
if(CMAKE_INSTALL_PREFIX STREQUAL "/usr")
  set(packages lib/python3/dist-packages)
else()
  set(packages lib/${VSH_PYTHON_VERSION}/dist-packages)
endif()
set(VSH_PYTHON_DIR ${packages} CACHE STRING "Where the Python module is installed, from the prefix")
if(IS_ABSOLUTE "${VSH_PYTHON_DIR}" OR IS_ABSOLUTE "${CMAKE_INSTALL_LIBDIR}")
  set(library ${CMAKE_INSTALL_FULL_LIBDIR}/libvdbshade.so.${VSH_SOVERSION})
else()
  file(RELATIVE_PATH library "/${VSH_PYTHON_DIR}/vdbshade" "/${CMAKE_INSTALL_LIBDIR}/libvdbshade.so.${VSH_SOVERSION}")
endif()
vsh_write_location(${PROJECT_BINARY_DIR}/installed/_location.py ${library})
list(REMOVE_ITEM made ${VSH_PYTHON_FOLDER}/_location.py)
install(FILES ${made} ${PROJECT_BINARY_DIR}/installed/_location.py DESTINATION ${VSH_PYTHON_DIR}/vdbshade
  COMPONENT python)
