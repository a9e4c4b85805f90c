/* The field: a pyramid of narrow bands in flat bricks, made from a grid, that shadow marching samples. */
#ifndef VDBSHADE_FIELD_H
#define VDBSHADE_FIELD_H

#include "grid.h"
#include "trace.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Free it with vsh_field_free(). It does not need its grid any more. */
typedef struct vsh_field vsh_field;

/* How a field is made. */
typedef struct vsh_field_options {
    size_t struct_size;
    double reach;    /* largest distance from a surface that must be told apart, world units, finite, > 0:
                      * tangent of the widest light's half angle times the longest ray, or the AO distance
                      * (vsh_scene_reach()); 0: four times the diagonal of the solid's box */
    int32_t surface; /* nonzero: extract the surface of the finest level, where the library has Embree: rays
                      * of adaptive are traced against it instead of being marched. Values are as near to the
                      * casters, not the same. Pays from about two rays an active voxel on; some 30 bytes an
                      * active voxel */
    double grown; /* voxels that casters are grown by for rays, 0 … 1. A trilinear sample over a convex edge
                   * is too large, by up to 0.44 voxels, so what is voxelised seems smaller than it is. 0:
                   * voxels are the definition, as those of a file */
} vsh_field_options;

static inline vsh_field_options vsh_field_options_default(void) {
    /* Through a roof of slats of 3.3 voxels AO's rays see 0.047 too much with 0, 0.0004 with this. */
    vsh_field_options options = {sizeof(vsh_field_options), 0.0, 0, 0.15};
    return options;
}

/* Makes the field of a grid; free it with vsh_field_free(). Time and memory follow the surface's area; each
 * level above the finest adds about a quarter of the one below. Errors:
 * - VSH_ERROR_ARGUMENT: a reach that is negative or not finite, options, run;
 * - VSH_ERROR_INPUT: a grid without a surface;
 * - VSH_ERROR_LIMIT: run->memory_limit, for the surface too; more blocks or bricks of 8³ voxels than 32 bits
 *   count (about 2^31 and 2.9 million);
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_field_create(const vsh_grid *grid, const vsh_field_options *options,
                                    const vsh_run *run, vsh_field **field, vsh_error *error);
VSH_API void vsh_field_free(vsh_field *field); /* NULL does nothing */

/* Signed distance, world units, negative inside, at `count` world positions ([count][3]) into
 * distances[count]. Within the finest band it is the trilinear sample of the grid. Beyond the band a ray can
 * march by it: its size never exceeds the true distance, of which it is about 0.7 to 0.95 within the reach.
 * Positions that are not finite give NaN. Runs on the calling thread. */
VSH_API void vsh_field_sample(const vsh_field *field, size_t count, const double *positions,
                              float *distances);

/* What a field comes to. */
typedef struct vsh_field_info {
    double voxel_size;    /* of the finest level, world units */
    double reach;         /* that the coarsest level resolves, world units */
    double bounds_min[3]; /* of the solid, world units */
    double bounds_max[3];
    double shell_thickness; /* of sheets in it, world units; 0: none */
    int32_t levels;         /* of the pyramid, the finest one too */
    uint64_t bricks;        /* of 8³ cells, over all levels */
    uint64_t bytes;         /* in memory */
    uint64_t
        active_voxels; /* of the grid that it was made from: bytes / active_voxels are those of a voxel */
} vsh_field_info;

/* Cannot fail. */
VSH_API void vsh_field_get_info(const vsh_field *field, vsh_field_info *info);

/* What of a mesh a field does not hold: its voxels are too coarse for it, and nothing that marches against
 * them sees it. */
typedef struct vsh_lost {
    double share;     /* of the mesh's area, 0 … 1 */
    double thickness; /* of nine tenths of it at least, world units: voxels of 0.8 times that hold it. 0: not
                         known */
    uint64_t triangles; /* that have such places, among those that were looked at */
} vsh_lost;

/* Looks at some 16,000 places of the meshes that the field was made of, for whether there is a solid there:
 * lost[mesh_count]. `triangles`, of the same meshes, tell how thin the lost parts are, and edges of thick
 * ones, which voxels cut, from them; may be NULL. Takes some milliseconds, on the calling thread. Errors:
 * VSH_ERROR_ARGUMENT (field, meshes or lost NULL), VSH_ERROR_INPUT (as vsh_mesh_check()), VSH_ERROR_MEMORY.
 */
VSH_API vsh_result vsh_field_find_lost(const vsh_field *field, const vsh_mesh *meshes, size_t mesh_count,
                                       const vsh_triangles *triangles, vsh_lost *lost, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
