#include "shade/kernel/march.h"
#define MARCH_NAME vshi_march_base
#include "shade/kernel/lanes.inc"
