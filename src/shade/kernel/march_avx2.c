#include "shade/kernel/march.h"
#define MARCH_NAME vshi_march_avx2
#define MARCH_WIDTH 8
#include "shade/kernel/lanes.inc"
