/* The pyramid: levels of voxels 1, 2, 4 … finest voxels wide, each a narrow band in flat bricks.
 *
 * Field space is the finest level's index space: lengths are finest voxels, lattice point (i, j, k) of level
 * l lies at 2^l (i, j, k). A brick holds 8³ cells of a level as 9³ values (with one more plane on the far
 * sides), z fastest. So a trilinear sample is one look-up of the brick and four loads of two neighbours each.
 * Blocks away from the surface share one of two constant bricks, so the look-up never branches.
 *
 * Values are 16-bit multiples of a level's quantum, a power of two: 2^-13 voxel for a band of 3 voxels, 2^-12
 * for 6. Only rounding is lost, and a cell interpolates to the same bits as its floats would. */
#pragma once

#include "base/job.h"
#include "base/vec.h"
#include "trace/trace.h"

#include <stdbool.h>
#include <stdint.h>
#include <vdbshade/occluders.h>

typedef struct vshi_field_options {
    double reach;    /* largest distance from a surface that the field resolves, world units, finite. 0: four
                      * times the diagonal of the solid's box */
    int32_t surface; /* nonzero: extract the surface of the finest level, if the library has Embree. Adaptive
                        then traces its rays against it instead of marching. Values are as accurate as marched
                        ones, but not equal to them. Pays from about two rays an active voxel on, and costs
                        some 30 bytes an active voxel */
    double grown; /* voxels by which casters grow for rays, 0 … 1. A trilinear sample over a convex edge is
                   * too large, by up to 0.44 voxels, so voxelised casters seem smaller than they are. 0: the
                   * voxels define the caster, as those of a file do */
} vshi_field_options;

static inline vshi_field_options vshi_field_options_default(void) {
    /* Through a roof of slats of 3.3 voxels AO's rays see 0.047 too much with 0, 0.0004 with this. */
    vshi_field_options options = {0.0, 0, 0.15};
    return options;
}

/* Makes the field of a grid; free it with vshi_field_free(). Time and memory follow the surface's area. Each
 * level above the finest adds about a quarter of the one below. Errors:
 * - VSH_ERROR_ARGUMENT: a reach that is negative or not finite, options, run;
 * - VSH_ERROR_INPUT: a grid without a surface;
 * - VSH_ERROR_LIMIT: run->memory_limit, for the surface too. More blocks or bricks of 8³ voxels than 32 bits
 *   count (about 2^31 and 2.9 million);
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_field_create(const vsh_grid *grid, const vshi_field_options *options, const vsh_run *run,
                             vsh_field **field, vsh_error *error);
void vshi_field_free(vsh_field *field); /* NULL does nothing */

/* The parts of a mesh that a field's voxels are too coarse to hold. A march does not see them. */
typedef struct vshi_lost {
    double share;     /* of the mesh's area, 0 … 1 */
    double thickness; /* of at least nine tenths of them, world units: voxels of 0.8 times that hold them. 0:
                         not known */
} vshi_lost;

/* Tests some 16,000 places of the checked meshes of a field for a solid, into lost[mesh_count]. `triangles`
 * of the same meshes measure the lost parts, and tell thin parts from the edges of thick ones, which voxels
 * cut; may be NULL. Runs some milliseconds on the calling thread. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_field_find_lost(const vsh_field *field, const vsh_mesh *meshes, size_t mesh_count,
                                const vshi_triangles *triangles, vshi_lost *lost, vsh_error *error);

enum {
    VSHI_MAX_LEVELS = 48,
    VSHI_BRICK_CELLS = 8, /* along an edge */
    VSHI_BRICK_EDGE = 9,  /* values along an edge */
    VSHI_STRIDE_X = 81,
    VSHI_STRIDE_Y = 9,
    VSHI_BRICK_VALUES = 729,
    VSHI_VALUE_MOST = INT16_MAX
};

typedef struct vshi_level {
    int32_t origin[3];    /* lattice coordinates of the first brick's first value; multiples of 8 */
    int32_t size[3];      /* bricks along each axis; z fastest */
    uint64_t first_index; /* of this level in vsh_field.index */
    uint64_t first_value; /* of this level in vsh_field.values; the first brick is all +band, the second all
                           * -band */
    uint64_t brick_count; /* these two included */
    float scale;          /* 2^level: voxel size, finest voxels */
    float band;           /* finest voxels, a multiple of `quantum`; values are clamped to ± band */
    float quantum;        /* a step of the values, finest voxels */
    float rounding;       /* largest rounding of a value, levels below included, finest voxels */
} vshi_level;

struct vsh_field {
    double to_field[12]; /* world to field space */
    double voxel_size;   /* finest, world units */
    double shell_thickness;
    float bounds_min[3]; /* box around the surface, field space */
    float bounds_max[3];
    double world_min[3];
    double world_max[3];
    int32_t *index;  /* offset in `values` of each block's brick; all levels */
    int16_t *values; /* bricks; all levels; multiples of the level's quantum, negative inside */
    uint64_t value_count;
    uint64_t active_voxels; /* of the grid */
    bool unknown;           /* see vshi_field_create_unknown() */
    int32_t level_count;
    vshi_level levels[VSHI_MAX_LEVELS];
    double grown;            /* growth of casters for rays, voxels */
    vshi_triangles *surface; /* of the finest level, grown, field space (surface.h), for
                              * vshi_triangles_blocked() only. NULL: rays are marched */
};

/* Number of block (x, y, z) of a level. */
static inline size_t vshi_block_index(const int32_t size[3], int32_t x, int32_t y, int32_t z) {
    return ((size_t)x * (size_t)size[1] + (size_t)y) * (size_t)size[2] + (size_t)z;
}

/* Lattice coordinates of a block's first value. */
static inline void vshi_block_corner(const int32_t origin[3], const int32_t size[3], size_t block,
                                     int32_t corner[3]) {
    const size_t plane = (size_t)size[1] * (size_t)size[2];
    corner[0] = origin[0] + 8 * (int32_t)(block / plane);
    corner[1] = origin[1] + 8 * (int32_t)(block % plane / (size_t)size[2]);
    corner[2] = origin[2] + 8 * (int32_t)(block % (size_t)size[2]);
}

/* The first value of a cell in its brick; cells count from the level's origin. */
static inline const int16_t *vshi_level_cell(const vsh_field *field, const vshi_level *level,
                                             const int32_t cell[3]) {
    const size_t block = vshi_block_index(level->size, cell[0] >> 3, cell[1] >> 3, cell[2] >> 3);
    return field->values + field->index[level->first_index + block] + (cell[0] & 7) * VSHI_STRIDE_X +
           (cell[1] & 7) * VSHI_STRIDE_Y + (cell[2] & 7);
}

/* Trilinear sample of one level at a field-space position: at most ± band, and +band outside the level's
 * blocks. `gradient`, if not NULL, is the cell's own, per finest voxel. */
static inline float vshi_level_sample(const vsh_field *field, int32_t l, const float p[3],
                                      float gradient[3]) {
    const vshi_level *level = &field->levels[l];
    const float inverse = 1.0f / level->scale;
    float f[3];
    int32_t cell[3];
    for (int axis = 0; axis < 3; ++axis) {
        const float x = p[axis] * inverse - (float)level->origin[axis];
        if (!(x >= 0.0f && x < (float)(VSHI_BRICK_CELLS * level->size[axis]))) {
            if (gradient != NULL) {
                gradient[0] = gradient[1] = gradient[2] = 0.0f;
            }
            return level->band;
        }
        cell[axis] = (int32_t)x;
        f[axis] = x - (float)cell[axis];
    }
    const int16_t *v = vshi_level_cell(field, level, cell);
    const float d00 = (float)(v[1] - v[0]), d01 = (float)(v[10] - v[9]);
    const float d10 = (float)(v[82] - v[81]), d11 = (float)(v[91] - v[90]);
    const float z00 = (float)v[0] + d00 * f[2];
    const float z01 = (float)v[9] + d01 * f[2];
    const float z10 = (float)v[81] + d10 * f[2];
    const float z11 = (float)v[90] + d11 * f[2];
    const float y0 = z00 + (z01 - z00) * f[1];
    const float y1 = z10 + (z11 - z10) * f[1];
    if (gradient != NULL) {
        const float d0 = d00 + (d01 - d00) * f[1];
        const float d1 = d10 + (d11 - d10) * f[1];
        const float step = level->quantum * inverse;
        gradient[0] = (y1 - y0) * step;
        gradient[1] = ((z01 - z00) + ((z11 - z10) - (z01 - z00)) * f[0]) * step;
        gradient[2] = (d0 + (d1 - d0) * f[0]) * step;
    }
    return (y0 + (y1 - y0) * f[0]) * level->quantum;
}

/* A cell with far corners clamped to the band reads up to √3 voxels short, but only within half a voxel of
 * the band. So the next level covers this much of a band, voxels. */
#define VSHI_BAND_EDGE 0.5f

/* Error of a trilinear sample, voxels: the distance is 1-Lipschitz and a cell's centre is √3/2 from its
 * corners. */
#define VSHI_SLACK 0.87f
/* A distance is semiconcave away from the surface: its second derivatives are at most 1/d (Cannarsa and
 * Sinestrari, "Semiconcave functions", 2004). So Jensen's inequality bounds a trilinear sample's excess by
 * half the mean square distance to the corners, 3/8 voxel², over the least d in the cell. */
#define VSHI_CURVATURE 0.375f
/* Largest excess of a coarse value over the distance at its place, voxels of the level. Coarse values are
 * distances to known surface points, which are not always the nearest. The finest values are exact, except
 * for vshi_level.rounding. The excess may be twice as large in solids: where solids overlap, a finest value
 * may be the distance to a triangle inside the union, which a coarse level does not know. Measured on all
 * voxels of the cloister at 512 voxels: 19 of 5.4 million free balls were too large in solids, by up to 0.25
 * voxels, and none of 12.7 million outside. */
#define VSHI_NODE 0.3f

/* Whether a sample is beyond the range that its level resolves. */
static inline bool vshi_level_saturated(const vshi_level *level, float h) {
    const float resolved = level->band - VSHI_BAND_EDGE * level->scale;
    return h >= resolved || h <= -resolved;
}

/* Signed distance at a field-space position from the finest level that resolves it, finest voxels. Coarser
 * levels' samples can be too large: see vshi_field_lower_bound(). */
static inline float vshi_field_distance(const vsh_field *field, const float p[3]) {
    float h = 0.0f;
    for (int32_t l = 0; l < field->level_count; ++l) {
        h = vshi_level_sample(field, l, p, NULL);
        if (!vshi_level_saturated(&field->levels[l], h)) {
            break;
        }
    }
    return h;
}

/* Signed distance for marching: like vshi_field_distance(), but beyond the finest band |distance| is a lower
 * bound. `gradient`, if not NULL, points to where the distance grows; zero beyond the reach. */
float vshi_field_lower_bound(const vsh_field *field, const float p[3], float gradient[3]);

/* World position to field space, in double precision. */
static inline vshi_vec vshi_to_field(const vsh_field *field, const double position[3]) {
    return vshi_transform_point(field->to_field, vshi_vec_of(position));
}

/* Field space to world. to_field is a rotation divided by the voxel size, so its inverse is its transpose
 * times the voxel size squared. */
static inline vshi_vec vshi_direction_to_world(const vsh_field *field, vshi_vec d) {
    const double *m = field->to_field;
    return vshi_unit((vshi_vec){m[0] * d.x + m[4] * d.y + m[8] * d.z, m[1] * d.x + m[5] * d.y + m[9] * d.z,
                                m[2] * d.x + m[6] * d.y + m[10] * d.z});
}

static inline vshi_vec vshi_to_world(const vsh_field *field, vshi_vec p) {
    const double *m = field->to_field, square = field->voxel_size * field->voxel_size;
    const vshi_vec d = {p.x - m[3], p.y - m[7], p.z - m[11]};
    return vshi_scale((vshi_vec){m[0] * d.x + m[4] * d.y + m[8] * d.z, m[1] * d.x + m[5] * d.y + m[9] * d.z,
                                 m[2] * d.x + m[6] * d.y + m[10] * d.z},
                      square);
}

/* Makes a field without casters, in which everything is free. Start offsets count its voxels, whose size is
 * in world units, 1e-12 … 1e12. Distances exceed all reach, and the bounds are an empty box. Free it with
 * vshi_field_free(). Errors: VSH_ERROR_ARGUMENT, VSH_ERROR_MEMORY. */
vsh_result vshi_field_create_empty(double voxel_size, vsh_field **field, vsh_error *error);

static inline bool vshi_field_is_empty(const vsh_field *field) {
    return field->bounds_min[0] > field->bounds_max[0];
}

/* Makes a field for casters that are only traced. It has their box, and distances of 0, which prove nothing.
 * Lengths are in voxels of the given size, world units, 1e-12 … 1e12. Free it with vshi_field_free(). Errors:
 * VSH_ERROR_ARGUMENT, VSH_ERROR_MEMORY. */
vsh_result vshi_field_create_unknown(double voxel_size, const double low[3], const double high[3],
                                     vsh_field **field, vsh_error *error);

/* --- memory */

/* A run with its memory limit, and the memory in use: the grid, the field so far, the caller's arrays. */
typedef struct vshi_field_budget {
    const vsh_run *run;
    double held; /* bytes */
} vshi_field_budget;

/* Bytes of the field's bricks and indices. */
static inline double vshi_field_bytes(const vsh_field *field) {
    double bytes = sizeof *field + (double)field->value_count * sizeof *field->values;
    for (int32_t l = 0; l < field->level_count; ++l) {
        const int32_t *size = field->levels[l].size;
        bytes += (double)size[0] * size[1] * size[2] * sizeof *field->index;
    }
    return bytes;
}

/* --- the surface of the finest level as quads, against which rays are traced (surface.c)
 *
 * Corners lie on the edges of the finest level's trilinear cells, exactly at the height. Each quad lies in
 * one cell; a triangle is a quad whose last two corners are the same. Where the surface crosses a cell's face
 * twice, corners are joined like the face's own hyperbola, so that neighbours agree and the surface is closed
 * (Nielson and Hamann, "The asymptotic decider", 1991). Bricks share no corners, but corners that meet are
 * equal to the bit. */

/* Makes field->surface, the surface at field->grown, for rays. NULL if no value of the field is as low as
 * that. `budget` counts all memory except for the surface's. Errors: as vshi_surface_quads_make();
 * VSH_ERROR_UNSUPPORTED if Embree cannot be loaded. */
vsh_result vshi_field_add_surface(vsh_field *field, vshi_field_budget budget, vshi_job *job,
                                  vsh_error *error);

/* The quads of the surface. Their corners may run either way. */
typedef struct vshi_surface_quads {
    float *corners;  /* [corner_count][3], field space */
    uint32_t *quads; /* [quad_count][4] */
    size_t corner_count, quad_count;
} vshi_surface_quads;

/* Makes the surface where the finest level is `height`, finest voxels, within its band. Free it with
 * vshi_surface_quads_free(), even after an error. Errors: VSH_ERROR_LIMIT (the run's; more than 2^32
 * corners), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_surface_quads_make(const vsh_field *field, double height, const vsh_run *run,
                                   vshi_surface_quads *quads, vsh_error *error);
void vshi_surface_quads_free(vshi_surface_quads *quads);

/* The surface where the finest level is 0, as a mesh that faces outwards, refined where quads are off the
 * surface. */
typedef struct vshi_surface_mesh {
    float *positions;  /* [vertex_count][3], field space */
    uint32_t *indices; /* [triangle_count][3] */
    size_t vertex_count, triangle_count;
    double transform[12]; /* field space to world */
} vshi_surface_mesh;

/* Free it with vshi_surface_mesh_free(), even after an error. Errors: as vshi_surface_quads_make(). */
vsh_result vshi_surface_mesh_make(const vsh_field *field, const vsh_run *run, vshi_surface_mesh *mesh,
                                  vsh_error *error);
void vshi_surface_mesh_free(vshi_surface_mesh *mesh);

/* Whether a place of field space is certainly outside of field->surface: farther from it than a quad may
 * deviate from its cell's values. */
bool vshi_surface_clears(const vsh_field *field, vshi_vec place);
