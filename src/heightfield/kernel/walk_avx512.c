#define WALK_NAME vshi_walk_avx512
#include "heightfield/kernel/walk.inc"
