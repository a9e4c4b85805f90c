/* What casts, of what a benchmark made by hand: as long as the block that it stands in. */
#ifndef BENCH_CASTS_H
#define BENCH_CASTS_H

#include "shade/occluders.h"

#define bench_casts(casters) (&(const vsh_occluders){.field = (casters)})
#define bench_traced(casters, meshes) (&(const vsh_occluders){.field = (casters), .triangles = (meshes)})
#define bench_layered(casters, beside)                                                                       \
    (&(const vsh_occluders){.field = (casters), .layers = (beside), .layer_count = 1})

#endif
