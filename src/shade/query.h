/* Shadow, AO and distances at points, by a handle that is made once for a field, lights and options. */
#ifndef VSHI_QUERY_H
#define VSHI_QUERY_H

#include "base/job.h"
#include "field/field.h"
#include "shade/ao.h"
#include "shade/layers.h"
#include "shade/shadow.h"

#include <stdbool.h>
#include <string.h>
#include <vdbshade/query.h>

struct vsh_query {
    size_t light_count;
    vsh_light *lights;          /* [light_count] */
    vshi_shadow_shader *shadow; /* [light_count] */
    vshi_ao_shader ao;
};

/* vsh_query_create(), or (sphere) a query whose AO is the free share of all directions around a point, each
 * counting alike, and takes no normals. Errors: VSH_ERROR_ARGUMENT, also for taps, which go along a normal.
 */
vsh_result vshi_query_create(const vsh_occluders *occluders, const vsh_light *lights, size_t light_count,
                             const vsh_shade_options *options, bool sphere, vsh_query **query,
                             vsh_error *error);

enum { VSHI_QUERY_BALLS = 64 };

/* What is known of one light at all points of `count` balls of free space, world units, at most
 * VSHI_QUERY_BALLS: VSHI_PROVED_FREE where a query without normals answers 1 at each, VSHI_PROVED_FULL where
 * it answers 0, else VSHI_UNPROVED. */
void vshi_query_prove(const vsh_query *query, int32_t isa, size_t light, size_t count,
                      const double (*centre)[3], const double *radius, int8_t *proof, vsh_shade_stats *stats);

/* --- points of a caller's arrays, packed or strided, of doubles or floats, as one thing to read */

typedef struct vshi_view {
    size_t count;
    const char *positions, *normals, *texels; /* the last two may be NULL */
    size_t position_stride, normal_stride, texel_stride;
    bool floats; /* positions are floats */
} vshi_view;

static inline void vshi_view_position(const vshi_view *view, size_t i, double position[3]) {
    const char *at = view->positions + i * view->position_stride;
    if (view->floats) {
        float p[3];
        memcpy(p, at, sizeof p);
        for (int axis = 0; axis < 3; ++axis) {
            position[axis] = (double)p[axis];
        }
    } else {
        memcpy(position, at, 3 * sizeof *position);
    }
}

/* --- points in the order of a curve that fills space */

/* Whether shading points first … first + count - 1 in the curve's order pays: whether those that follow each
 * other are mostly too far apart to share proofs. Looks at a few of them. */
bool vshi_order_pays(const vsh_field *field, const vshi_view *view, size_t first, size_t count);

/* Orders points first … first + count - 1, at most VSH_QUERY_BATCH of them, on the job's threads: the lowest
 * bits of order[i], VSHI_ORDER_POINT, are a point's number from `first`. Points in one place keep their
 * order; points that are not finite come last. `order` has room for twice as many. Errors:
 * VSH_ERROR_CANCELLED, VSH_ERROR_MEMORY, VSH_ERROR_INTERNAL. */
enum { VSHI_ORDER_POINT = VSH_QUERY_BATCH - 1 };
vsh_result vshi_order_points(vshi_job *job, const vsh_field *field, const vshi_view *view, size_t first,
                             size_t count, uint64_t *order, vsh_error *error);

#endif
