# Flags of all code: strict warnings; no contraction and no fast-math, for the same bits on every machine. Ignoring floating-point
# traps and errno lets compilers vectorise loops and changes no result.
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
  if(CMAKE_C_COMPILER_ID MATCHES Clang) # C programs link C++ objects
    add_link_options(-fsanitize-link-c++-runtime)
    link_libraries(stdc++)
  endif()
endif()
if(VSH_FUZZ) # coverage for libFuzzer; vptr checks fail for OpenVDB's classes, whose types differ in each library
  add_compile_options(-fsanitize=fuzzer-no-link -fno-sanitize=vptr)
  add_compile_options(
    $<$<COMPILE_LANGUAGE:CXX>:-fsanitize-ignorelist=${PROJECT_SOURCE_DIR}/tests/suppressions/fuzz.txt>)
endif()

function(vsh_set_flags target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wformat=2 -Wundef -Wpointer-arith -Wcast-qual
    -ffp-contract=off -fno-trapping-math -fno-math-errno $<$<COMPILE_LANGUAGE:C>:-Wstrict-prototypes -Wmissing-prototypes -Wvla>
    $<$<BOOL:${VSH_WERROR}>:-Werror>)
endfunction()

# C in src casts every conversion that may change a number, except between signed and unsigned sizes and indices.
function(vsh_set_source_flags target)
  vsh_set_flags(${target})
  target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:C>:-Wconversion -Wno-sign-conversion>)
endfunction()

# Callers have stacks of 1 MiB.
set(VSH_LARGEST_FRAME 262144)
set_source_files_properties(${PROJECT_SOURCE_DIR}/src/shade/shadow_rays.c PROPERTIES COMPILE_OPTIONS -Wno-frame-larger-than)
function(vsh_limit_frames target)
  if(NOT VSH_SANITIZE)
    target_compile_options(${target} PRIVATE $<$<AND:$<COMPILE_LANGUAGE:C>,$<CONFIG:Release>>:-Wframe-larger-than=${VSH_LARGEST_FRAME}>)
  endif()
endfunction()

# Each kernel is one source, built for each instruction set and chosen at run time. Per set: lanes marched together, lanes of a vector.
set(VSH_KERNEL_base 16 4)
set(VSH_KERNEL_few 4 4)
set(VSH_KERNEL_avx2 16 8 -mavx2)
set(VSH_KERNEL_avx512 16 16 -mavx512f -mavx512dq -mavx512vl)

function(vsh_add_kernels target)
  set(kinds base few)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    list(APPEND kinds avx2 avx512)
  endif()
  foreach(kind ${kinds})
    set(flags ${VSH_KERNEL_${kind}})
    list(POP_FRONT flags lanes width)
    vsh_add_kernel(${target} lanes_${kind} shade/kernel/lanes.inc "${flags}"
                   "#define KERNEL_NAME vshi_kernel_${kind}\n#define MARCH_LANES ${lanes}\n#define MARCH_WIDTH ${width}\n")
    if(NOT kind STREQUAL few)
      math(EXPR half "${width} / 2")
      vsh_add_kernel(${target} windows_${kind} shade/kernel/windows.inc "${flags}" "#define WINDOW_NAME vshi_windows_${kind}\n#define WINDOW_WIDTH ${half}\n")
      vsh_add_kernel(${target} leaf_${kind} levelset/kernel/leaf.inc "${flags}" "#define LEAF_NAME vshi_leaf_${kind}\n")
      vsh_add_kernel(${target} feet_${kind} field/kernel/feet.inc "${flags}" "#define FEET_NAME vshi_feet_${kind}\n#define FEET_WIDTH ${width}\n")
    endif()
  endforeach()
endfunction()

# vsh_add_kernel(TARGET NAME SOURCE FLAGS DEFINITIONS)
function(vsh_add_kernel target name source flags definitions)
  set(file ${PROJECT_BINARY_DIR}/kernels/${name}.c)
  file(CONFIGURE OUTPUT ${file} CONTENT "${definitions}#include \"${source}\"\n")
  target_sources(${target} PRIVATE ${file})
  set_source_files_properties(${file} PROPERTIES COMPILE_OPTIONS "-O3;-Wno-frame-larger-than;${flags}"
                              OBJECT_DEPENDS ${PROJECT_SOURCE_DIR}/src/${source})
endfunction()
