#include "shade/kernel/march.h"

vshi_march_fn *vshi_march_best(void) {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl")) {
        return vshi_march_avx512;
    }
    if (__builtin_cpu_supports("avx2")) {
        return vshi_march_avx2;
    }
#endif
    return vshi_march_base;
}
