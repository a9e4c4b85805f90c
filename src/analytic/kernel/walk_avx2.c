#define WALK_NAME vshi_walk_avx2
#include "analytic/kernel/walk.inc"
