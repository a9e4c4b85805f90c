#include "field/kernel/feet.h"

#include "base/isa.h"

const vshi_feet_kernel *vshi_feet_kernel_of(int32_t isa) {
    switch (vshi_isa_resolve(isa)) {
#if defined(__x86_64__)
    case VSH_ISA_AVX512:
        return &vshi_feet_avx512;
    case VSH_ISA_AVX2:
        return &vshi_feet_avx2;
#endif
    default:
        return &vshi_feet_base;
    }
}
