/* Meshes with lightmaps on them, rasterised at a picture's samples. */
#ifndef VSHI_LIT_H
#define VSHI_LIT_H

#include "base/job.h"
#include "render/grid.h"
#include "shade/lift.h"

typedef struct vshi_lit vshi_lit;

/* Whether the options' lit meshes are whole, but for what their lightmaps hold. Errors: VSH_ERROR_ARGUMENT,
 * VSH_ERROR_INPUT, naming the mesh. */
vsh_result vshi_lit_check(const vsh_render_options *options, vsh_error *error);

/* Bytes that those of checked options take at most. */
double vshi_lit_bytes(const vsh_render_options *options);

/* Makes those of checked options ready; *lit is NULL where there are none. Lights and options must outlive
 * it. Errors: VSH_ERROR_INPUT where a lightmap lacks a channel, VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_create(const vsh_render_options *options, const vsh_light *lights, size_t light_count,
                           const vshi_sample_grid *grid, vshi_lit **lit, vsh_error *error);
void vshi_lit_free(vshi_lit *lit); /* NULL does nothing */

enum { VSHI_LIT_STRIP = 64 }; /* columns that one thread rasterises */

/* What the samples of some rows see, [rows × columns]. */
typedef struct vshi_lit_band {
    int32_t first_row, rows;
    double *depth;      /* infinite: nothing */
    uint32_t *triangle; /* that is there */
} vshi_lit_band;

/* Fills strip `strip` of a band. */
void vshi_lit_raster(const vshi_lit *lit, const vshi_lit_band *band, size_t strip);

/* Whether a triangle has no lightmap, so that what falls on it is to be asked for at its points. */
bool vshi_lit_is_bare(const vshi_lit *lit, uint32_t triangle);

/* Where a ray meets a triangle. The normals point towards the eye. */
typedef struct vshi_lit_point {
    vshi_lift_point point;
    const double *color; /* [3] */
} vshi_lit_point;

vshi_lit_point vshi_lit_meet(const vshi_lit *lit, uint32_t triangle, vshi_vec ray);

/* The box around all triangles; low > high where there are none. */
void vshi_lit_bounds(const vshi_lit *lit, vshi_vec *low, vshi_vec *high);

/* Light that comes from a triangle with a lightmap along a ray, and its unit normal towards the eye. */
void vshi_lit_shade(const vshi_lit *lit, uint32_t triangle, vshi_vec ray, float color[3], float normal[3]);

#endif
