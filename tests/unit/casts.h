/* Occluders made of a test's own parts. They live as long as the block around them. */
#pragma once

#include "shade/occluders.h"

#define occluders_of(casters) (&(const vsh_occluders){.field = (casters)})
#define occluders_traced(casters, meshes) (&(const vsh_occluders){.field = (casters), .triangles = (meshes)})
#define occluders_with(casters, beside, count)                                                               \
    (&(const vsh_occluders){.field = (casters), .layers = (beside), .layer_count = (count)})
