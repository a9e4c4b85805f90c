#include "shade/kernel/march.h"
#define MARCH_NAME vshi_march_avx2
#include "shade/kernel/lanes.inc"
