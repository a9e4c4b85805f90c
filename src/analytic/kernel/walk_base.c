#define WALK_NAME vshi_walk_base
#include "analytic/kernel/walk.inc"
