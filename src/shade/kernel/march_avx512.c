#include "shade/kernel/march.h"
#define MARCH_NAME vshi_march_avx512
#include "shade/kernel/lanes.inc"
