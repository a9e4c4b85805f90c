# How everything is compiled: strict warnings, no contraction and no fast-math (the same bits on every machine).
# Compilers turn loops into vectors only where they need not care for floating-point traps and errno; neither changes
# a result.
set(CMAKE_C_STANDARD 11)
set(CMAKE_C_STANDARD_REQUIRED ON)
set(CMAKE_CXX_STANDARD 17)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_C_VISIBILITY_PRESET hidden)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

set(VSH_SANITIZE_FLAGS -fno-omit-frame-pointer -fno-sanitize-recover=all)
if(VSH_SANITIZE)
  add_compile_options(-fsanitize=${VSH_SANITIZE} ${VSH_SANITIZE_FLAGS})
  add_link_options(-fsanitize=${VSH_SANITIZE})
  if(CMAKE_C_COMPILER_ID MATCHES Clang) # programs in C link what is in C++
    add_link_options(-fsanitize-link-c++-runtime)
    link_libraries(stdc++)
  endif()
endif()
if(VSH_FUZZ) # what an input reaches is counted; OpenVDB's classes have types of their own in each library
  add_compile_options(-fsanitize=fuzzer-no-link -fno-sanitize=vptr)
  add_compile_options(
    $<$<COMPILE_LANGUAGE:CXX>:-fsanitize-ignorelist=${PROJECT_SOURCE_DIR}/tests/suppressions/fuzz.txt>)
endif()

function(vsh_set_flags target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wformat=2 -Wundef -Wpointer-arith -Wcast-qual
    -ffp-contract=off -fno-trapping-math -fno-math-errno $<$<COMPILE_LANGUAGE:C>:-Wstrict-prototypes -Wmissing-prototypes -Wvla>
    $<$<BOOL:${VSH_WERROR}>:-Werror>)
endfunction()

# In the C of src each number that may change by a conversion is cast; signs apart, as sizes and indices meet everywhere.
function(vsh_set_source_flags target)
  vsh_set_flags(${target})
  target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:C>:-Wconversion -Wno-sign-conversion>)
endfunction()

# The marching kernels are one source, built once for each instruction set and chosen at run time.
set(VSH_KERNEL_base_FLAGS "")
set(VSH_KERNEL_few_FLAGS "")
set(VSH_KERNEL_avx2_FLAGS -mavx2)
set(VSH_KERNEL_avx512_FLAGS -mavx512f -mavx512dq -mavx512vl)

function(vsh_add_kernels target)
  set(folder ${PROJECT_SOURCE_DIR}/src/shade/kernel)
  set(kinds base few)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    list(APPEND kinds avx2 avx512)
  endif()
  target_sources(${target} PRIVATE ${folder}/march.c)
  foreach(kind ${kinds})
    target_sources(${target} PRIVATE ${folder}/march_${kind}.c)
    set_source_files_properties(${folder}/march_${kind}.c PROPERTIES
                                COMPILE_OPTIONS "-O3;${VSH_KERNEL_${kind}_FLAGS}"
                                OBJECT_DEPENDS ${folder}/lanes.inc)
  endforeach()
  set(folder ${PROJECT_SOURCE_DIR}/src/heightfield/kernel)
  list(REMOVE_ITEM kinds few)
  foreach(kind ${kinds})
    target_sources(${target} PRIVATE ${folder}/walk_${kind}.c)
    set_source_files_properties(${folder}/walk_${kind}.c PROPERTIES
                                COMPILE_OPTIONS "-O3;${VSH_KERNEL_${kind}_FLAGS}"
                                OBJECT_DEPENDS ${folder}/walk.inc)
  endforeach()
endfunction()
