#define WALK_NAME vshi_walk_base
#include "heightfield/kernel/walk.inc"
