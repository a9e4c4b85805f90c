#include "shade/kernel/march.h"

const vshi_kernel *vshi_kernel_best(void) {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl")) {
        return &vshi_kernel_avx512;
    }
    if (__builtin_cpu_supports("avx2")) {
        return &vshi_kernel_avx2;
    }
#endif
    return &vshi_kernel_base;
}
