# How everything is compiled: strict warnings, no contraction and no fast-math (the same bits on every machine).
set(CMAKE_C_STANDARD 11)
set(CMAKE_C_STANDARD_REQUIRED ON)
set(CMAKE_CXX_STANDARD 17)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_C_VISIBILITY_PRESET hidden)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

if(VSH_SANITIZE)
  add_compile_options(-fsanitize=${VSH_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${VSH_SANITIZE})
endif()

function(vsh_set_flags target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wformat=2 -Wundef -Wpointer-arith -Wcast-qual
    -ffp-contract=off $<$<COMPILE_LANGUAGE:C>:-Wstrict-prototypes -Wmissing-prototypes -Wvla>
    $<$<BOOL:${VSH_WERROR}>:-Werror>)
endfunction()

# The marching kernels are one source, built once for each instruction set and chosen at run time.
function(vsh_add_kernels target)
  set(source ${PROJECT_SOURCE_DIR}/src/shade/kernel/march.inc.c)
  if(NOT EXISTS ${source})
    return()
  endif()
endfunction()
