#include "shade/kernel/march.h"
#define MARCH_NAME vshi_march_base
#define MARCH_WIDTH 4
#include "shade/kernel/lanes.inc"
