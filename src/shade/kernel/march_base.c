#include "shade/kernel/march.h"
#define KERNEL_NAME vshi_kernel_base
#define MARCH_LANES 16
#define MARCH_WIDTH 4
#include "shade/kernel/lanes.inc"
