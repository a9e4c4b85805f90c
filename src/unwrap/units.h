/* The units of a surface as a graph: what each is like, and which meet. */
#ifndef VSHI_UNWRAP_UNITS_H
#define VSHI_UNWRAP_UNITS_H

#include "base/job.h"
#include "unwrap/cut_mesh.h"

typedef struct vshi_unit_shape {
    vshi_vec normal; /* unit, of the unit and what is around it: noise of a scan stays out */
    vshi_vec centre;
    double area;
    double perimeter; /* where it meets others */
} vshi_unit_shape;

typedef struct vshi_units {
    const vshi_cut_mesh *surface;
    uint32_t count;
    vshi_unit_shape *units;
    uint32_t *begin; /* [count + 1] in `sides` */
    uint32_t *sides; /* that lead to another unit, by unit */
} vshi_units;

/* Errors: VSH_ERROR_MEMORY. Free with vshi_units_free(), after a failure too. */
vsh_result vshi_units_make(const vshi_cut_mesh *surface, vshi_units *units, vsh_error *error);
void vshi_units_free(vshi_units *units);

/* The unit beyond side vshi_units.sides[i]. */
static inline uint32_t vshi_units_beyond(const vshi_units *units, uint32_t side) {
    return units->surface->unit[units->surface->partner[side] / 3];
}

static inline double vshi_side_length(const vshi_cut_mesh *s, uint32_t side) {
    return vshi_length(
        vshi_sub(s->place[s->mesh->indices[side]], s->place[s->mesh->indices[vshi_next_side(side)]]));
}

/* --- charts grown over a surface */

/* Gives each unit the number of its chart, owner[units->count], and tells how many there are. A chart hangs
 * together, and its normals are within some 60° of their mean. Advances the job by the units' triangles.
 * Errors: VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_grow_charts(const vshi_units *units, vshi_job *job, uint32_t *owner, uint32_t *chart_count,
                            vsh_error *error);

#endif
