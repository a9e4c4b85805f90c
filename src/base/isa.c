#include "base/isa.h"

/* What of a set this machine lacks, or NULL. */
static const char *lacking(int32_t isa) {
#if defined(__x86_64__)
    if (isa == VSH_ISA_AVX2) {
        return __builtin_cpu_supports("avx2") ? NULL : "AVX2";
    }
    if (isa == VSH_ISA_AVX512) {
        return !__builtin_cpu_supports("avx512f")    ? "AVX-512F"
               : !__builtin_cpu_supports("avx512dq") ? "AVX-512DQ"
               : !__builtin_cpu_supports("avx512vl") ? "AVX-512VL"
                                                     : NULL;
    }
    return NULL;
#else
    return isa > VSH_ISA_BASE ? "x86-64" : NULL;
#endif
}

int32_t vsh_isa_available(int32_t isa) {
    return vsh_get_name(VSH_NAMES_ISA, isa) != NULL && lacking(isa) == NULL;
}

vsh_result vshi_isa_check(int32_t isa, vsh_error *error) {
    if (vsh_get_name(VSH_NAMES_ISA, isa) == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "isa %d is out of range 0 … %d", isa, VSHI_ISA_COUNT - 1);
    }
    if (lacking(isa) != NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "isa %s: this machine has no %s",
                         vsh_get_name(VSH_NAMES_ISA, isa), lacking(isa));
    }
    return VSH_OK;
}

int32_t vshi_isa_resolve(int32_t isa) {
    if (isa != VSH_ISA_BEST) {
        return isa;
    }
    int32_t best = VSHI_ISA_COUNT - 1;
    while (lacking(best) != NULL) {
        --best;
    }
    return best;
}
