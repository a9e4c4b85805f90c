#define WALK_NAME vshi_walk_avx512
#include "analytic/kernel/walk.inc"
