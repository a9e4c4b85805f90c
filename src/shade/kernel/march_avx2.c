#include "shade/kernel/march.h"
#define KERNEL_NAME vshi_kernel_avx2
#define MARCH_LANES 16
#define MARCH_WIDTH 8
#include "shade/kernel/lanes.inc"
