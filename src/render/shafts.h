/* Light shafts: a thin, even fog in the box around what is seen. */
#ifndef VSHI_SHAFTS_H
#define VSHI_SHAFTS_H

#include "base/vec.h"
#include "render/grid.h"
#include "trace/sampler.h"

#include <vdbshade/query.h>

enum { VSHI_TILE = 8, VSHI_TILE_SAMPLES = VSHI_TILE * VSHI_TILE, VSHI_MOST_LIGHTS = 256 };

typedef struct vshi_shafts {
    const vsh_query *query;
    const vsh_light *lights;
    size_t light_count;
    const vsh_run *run;
    const vshi_sampler *sampler; /* blue noise */
    vshi_vec low, high;          /* the fog's box */
    double extinction;           /* per world unit; 0: no fog */
    int32_t steps;
} vshi_shafts;

/* A ray of a tile, up to where it ends. */
typedef struct vshi_shaft_ray {
    vshi_vec origin, direction; /* unit */
    double end;                 /* world units, may be infinite */
    uint32_t texel;             /* of the mask */
} vshi_shaft_ray;

/* Puts the fog before what the rays of a tile brought back. Errors: as vsh_query_points(). */
vsh_result vshi_shafts_add(const vshi_shafts *shafts, size_t count, const vshi_shaft_ray *rays,
                           vshi_seen **seen, vsh_shade_stats *stats, vsh_error *error);

#endif
