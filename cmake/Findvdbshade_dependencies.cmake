# The libraries of tools/packages.txt, each as a target vsh::NAME. SYSTEM headers, so that compilers do not warn about them.
include(FindPackageHandleStandardArgs)
find_package(TBB REQUIRED CONFIG)
find_package(OpenEXR 3.1 REQUIRED CONFIG)
find_package(PkgConfig REQUIRED)
find_package(Freetype REQUIRED)
find_package(ZLIB REQUIRED)

function(vsh_find name header library)
  find_path(VSH_${name}_INCLUDE ${header})
  find_library(VSH_${name}_LIBRARY ${library})
  mark_as_advanced(VSH_${name}_INCLUDE VSH_${name}_LIBRARY)
  if(VSH_${name}_INCLUDE AND VSH_${name}_LIBRARY AND NOT TARGET vsh::${name})
    add_library(vsh::${name} UNKNOWN IMPORTED)
    set_target_properties(vsh::${name} PROPERTIES IMPORTED_LOCATION ${VSH_${name}_LIBRARY}
                          INTERFACE_INCLUDE_DIRECTORIES ${VSH_${name}_INCLUDE})
  endif()
endfunction()

set(optional "")
if(VSH_OPENVDB)
  vsh_find(openvdb openvdb/openvdb.h openvdb)
  list(APPEND optional VSH_openvdb_LIBRARY)
endif()
if(VSH_OPENIMAGEIO)
  vsh_find(openimageio OpenImageIO/imageio.h OpenImageIO)
  vsh_find(openimageio_util OpenImageIO/filesystem.h OpenImageIO_Util)
  list(APPEND optional VSH_openimageio_LIBRARY VSH_openimageio_util_LIBRARY)
endif()
if(VSH_ASSIMP)
  vsh_find(assimp assimp/cimport.h assimp)
  vsh_find(draco draco/compression/decode.h draco)
  list(APPEND optional VSH_assimp_LIBRARY VSH_draco_LIBRARY)
endif()
vsh_find(png png.h png)
vsh_find(meshoptimizer meshoptimizer.h meshoptimizer)
vsh_find(jansson jansson.h jansson)
vsh_find(seccomp seccomp.h seccomp)
vsh_find(nettle nettle/sha2.h nettle)
vsh_find(sleef sleef.h sleef)
vsh_find(half Imath/half.h Imath-3_1)

# three.js, which `view` embeds in its pages.
find_path(VSH_three_FOLDER three.min.js PATHS /usr/share/javascript/three)
mark_as_advanced(VSH_three_FOLDER)

find_package(embree 3 CONFIG REQUIRED)

find_package_handle_standard_args(vdbshade_dependencies REQUIRED_VARS VSH_png_LIBRARY VSH_meshoptimizer_LIBRARY
                                  VSH_jansson_LIBRARY VSH_seccomp_LIBRARY VSH_half_LIBRARY VSH_nettle_LIBRARY VSH_sleef_LIBRARY
                                  VSH_three_FOLDER ${optional})

if(NOT TARGET vsh::openexr)
  if(VSH_OPENVDB)
    set_property(TARGET vsh::openvdb PROPERTY INTERFACE_LINK_LIBRARIES TBB::tbb vsh::half)
  endif()
  if(VSH_OPENIMAGEIO)
    set_property(TARGET vsh::openimageio PROPERTY INTERFACE_LINK_LIBRARIES "vsh::openimageio_util;vsh::png;Imath::Imath")
  endif()
  add_library(vsh::openexr INTERFACE IMPORTED)
  target_link_libraries(vsh::openexr INTERFACE OpenEXR::OpenEXRCore)
  add_library(vsh::dependencies INTERFACE IMPORTED)
  target_link_libraries(vsh::dependencies INTERFACE TBB::tbb vsh::half vsh::openexr vsh::png vsh::meshoptimizer vsh::jansson
                                                    vsh::nettle vsh::sleef vsh::seccomp Freetype::Freetype ZLIB::ZLIB
                                                    ${CMAKE_DL_LIBS} m)
  # The headers, and the name by which src/trace/embree.c loads the library.
  get_target_property(config embree IMPORTED_CONFIGURATIONS)
  list(GET config 0 config)
  get_target_property(soname embree IMPORTED_SONAME_${config})
  target_include_directories(vsh::dependencies INTERFACE $<TARGET_PROPERTY:embree,INTERFACE_INCLUDE_DIRECTORIES>)
  target_compile_definitions(vsh::dependencies INTERFACE VSH_EMBREE="${soname}")
endif()
