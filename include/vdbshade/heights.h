/* Heightfields: terrains as meshes to be traced or voxelised, or as they are, to be marched. */
#ifndef VDBSHADE_HEIGHTS_H
#define VDBSHADE_HEIGHTS_H

#include "mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { VSH_MAX_HEIGHTS_SIDE = 65536 };

/* Heights on a regular grid, as a closed solid: a view, nothing is copied or owned. In local space y is up;
 * sample (row, column) stands at x = size[0] (column / (columns - 1) - 1/2), z = size[1] (row / (rows - 1) -
 * 1/2), y = height × value, so that row 0 is at -z and the corner samples are the solid's corners. A cell
 * between four samples is two triangles, cut from its least row and column to its greatest. Vertical sides go
 * down to a flat bottom, `base` under the lowest sample. */
typedef struct vsh_heights_source {
    const char *name;        /* for messages, as a file's path; may be NULL */
    int32_t columns;         /* along x, 2 … VSH_MAX_HEIGHTS_SIDE */
    int32_t rows;            /* along z, likewise */
    const float *values;     /* [rows][columns], finite */
    double size[2];          /* along x and z, local units, 1e-12 … 1e12 */
    double height;           /* of a value of 1, local units, -1e12 … 1e12; 0 is flat */
    double base;             /* local units, > 0 … 1e12; 0: a twentieth of the longer of size */
    const double *transform; /* [12], local to world, three rows of four, any of rotation, translation,
                                mirroring and one scale (vsh_model_from_heights: as vsh_mesh); NULL: none */
} vsh_heights_source;

/* What vsh_model_from_heights() makes. */
enum {
    VSH_HEIGHTS_SOLID = 0, /* the whole closed surface, without UVs: a caster */
    VSH_HEIGHTS_SURFACE = 1 /* the top alone: a receiver. UVs span 0 … 1, u along x and v against z, so that a
                               lightmap's row 0 lies over row 0 of the heights; normals are those of the
                               heights' central differences */
};

/* A model of one mesh. Free it with vsh_model_free(). Errors:
 * - VSH_ERROR_ARGUMENT: source, values or model NULL, sizes out of range, what is none of the above, run;
 * - VSH_ERROR_INPUT: a value that is not finite, or not once scaled, by its row and column;
 * - VSH_ERROR_LIMIT: more than 2^32 - 1 vertices, run->memory_limit (a solid takes 36 bytes a sample, a
 *   surface 56);
 * - VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_model_from_heights(const vsh_heights_source *source, int32_t what, const vsh_run *run,
                                          vsh_model **model, vsh_error *error);

/* A heightfield that is marched as it is, for the shadow methods hard and classic (vsh_layer.heights).
 * Immutable; may be shared by threads. */
typedef struct vsh_heights vsh_heights;

/* Copies the heights. Free the result with vsh_heights_free(). Errors:
 * - VSH_ERROR_ARGUMENT: source, values or heights NULL, sizes out of range, a transform that is not finite,
 *   shears, scales unevenly or flattens, run;
 * - VSH_ERROR_INPUT: a value that is not finite, or not once scaled, by its row and column;
 * - VSH_ERROR_LIMIT: run->memory_limit (4 bytes a sample);
 * - VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_heights_create(const vsh_heights_source *source, const vsh_run *run,
                                      vsh_heights **heights, vsh_error *error);
VSH_API void vsh_heights_free(vsh_heights *heights); /* NULL does nothing */

/* What a heightfield comes to. */
typedef struct vsh_heights_info {
    int32_t columns;      /* samples along x */
    int32_t rows;         /* samples along z */
    double lowest;        /* samples, local units */
    double highest;       /* the same */
    double bounds_min[3]; /* world box of the solid */
    double bounds_max[3];
    uint64_t bytes; /* in memory */
} vsh_heights_info;

/* Cannot fail. */
VSH_API void vsh_heights_get_info(const vsh_heights *heights, vsh_heights_info *info);

#ifdef __cplusplus
}
#endif
#endif
