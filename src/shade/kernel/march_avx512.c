#include "shade/kernel/march.h"
#define MARCH_NAME vshi_march_avx512
#define MARCH_WIDTH 16
#include "shade/kernel/lanes.inc"
