#include "shade/kernel/march.h"

#include "base/isa.h"

const vshi_kernel *vshi_kernel_of(int32_t isa) {
    return VSHI_KERNEL_OF(vshi_kernel, isa);
}
