#include "shade/kernel/march.h"
#define KERNEL_NAME vshi_kernel_few
#define MARCH_LANES 4
#define MARCH_WIDTH 4
#include "shade/kernel/lanes.inc"
