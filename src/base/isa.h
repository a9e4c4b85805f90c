/* Instruction sets: their names, and what this machine has of them. */
#ifndef VSHI_ISA_H
#define VSHI_ISA_H

#include "base/error.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { VSHI_ISA_COUNT = VSH_ISA_AVX512 + 1 };

/* VSH_ERROR_ARGUMENT where `isa` is none, or this machine lacks it: the message says what. */
vsh_result vshi_isa_check(int32_t isa, vsh_error *error);

/* What VSH_ISA_BEST stands for here; others as they are. */
VSHI_SHARED int32_t vshi_isa_resolve(int32_t isa);

/* The kernel `name`_base, `name`_avx2 or `name`_avx512 of a VSH_ISA_…. */
#if defined(__x86_64__)
#define VSHI_KERNEL_OF(name, isa)                                                                            \
    (vshi_isa_resolve(isa) == VSH_ISA_AVX512 ? &name##_avx512                                                \
     : vshi_isa_resolve(isa) == VSH_ISA_AVX2 ? &name##_avx2                                                  \
                                             : &name##_base)
#else
#define VSHI_KERNEL_OF(name, isa) ((void)(isa), &name##_base)
#endif

#ifdef __cplusplus
}
#endif
#endif
