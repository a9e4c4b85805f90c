/* The surface of a field's finest level as quads: what rays on the field are traced against. */
#ifndef VSHI_FIELD_SURFACE_H
#define VSHI_FIELD_SURFACE_H

#include "field/level.h"

/* Corners lie on the edges of the finest level's trilinear cells, exactly where these read the height; each
 * quad lies in one cell. A triangle is a quad whose last two corners are one. In a face of a cell that the
 * surface crosses twice corners are joined as the face's own hyperbola joins them, so that neighbours agree
 * and the surface is closed (Nielson and Hamann, "The asymptotic decider", 1991). Bricks share no corner, but
 * theirs that meet are the same to the bit. */

/* Finds the surface at field->grown and makes it field->surface, for rays; NULL where the field reads nothing
 * so low. `budget` counts all memory but the surface's. Errors: as vshi_surface_quads_make();
 * VSH_ERROR_UNSUPPORTED where Embree cannot be loaded. */
vsh_result vshi_field_add_surface(vsh_field *field, vshi_budget budget, vshi_job *job, vsh_error *error);

/* The quads of the surface. Their corners may go around either way. */
typedef struct vshi_surface_quads {
    float *corners;  /* [corner_count][3], field space */
    uint32_t *quads; /* [quad_count][4] */
    size_t corner_count, quad_count;
} vshi_surface_quads;

/* The surface where the finest level reads `height`, finest voxels, within its band. Free it with
 * vshi_surface_quads_free(), after an error too. Errors: VSH_ERROR_LIMIT (the run's; more than 2^32 corners),
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_surface_quads_make(const vsh_field *field, double height, const vsh_run *run,
                                   vshi_surface_quads *quads, vsh_error *error);
void vshi_surface_quads_free(vshi_surface_quads *quads);

/* The surface where the finest level reads 0 as a mesh that looks outwards, refined where the quads are off
 * it. */
typedef struct vshi_surface_mesh {
    float *positions;  /* [vertex_count][3], field space */
    uint32_t *indices; /* [triangle_count][3] */
    size_t vertex_count, triangle_count;
    double transform[12]; /* field space to world */
} vshi_surface_mesh;

/* Free it with vshi_surface_mesh_free(), after an error too. Errors: as vshi_surface_quads_make(). */
vsh_result vshi_surface_mesh_make(const vsh_field *field, const vsh_run *run, vshi_surface_mesh *mesh,
                                  vsh_error *error);
void vshi_surface_mesh_free(vshi_surface_mesh *mesh);

/* Whether a place of field space is outside of field->surface for certain: farther from it than a quad may be
 * off what the cell reads. */
bool vshi_surface_clears(const vsh_field *field, vshi_vec place);

#endif
