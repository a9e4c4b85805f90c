#define WALK_NAME vshi_walk_avx2
#include "heightfield/kernel/walk.inc"
