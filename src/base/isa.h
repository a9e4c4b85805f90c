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
int32_t vshi_isa_resolve(int32_t isa);

#ifdef __cplusplus
}
#endif
#endif
