/* The pyramid: levels of voxels 1, 2, 4 … finest voxels wide, each a narrow band in flat bricks.
 *
 * Field space is the finest level's index space: lengths are finest voxels, lattice point (i, j, k) of level
 * l lies at 2^l (i, j, k). A brick holds 8³ cells of a level as 9³ values (one plane of apron on the far
 * sides), z fastest, so that a trilinear sample is one look-up of the brick and four loads of two neighbours
 * each. Blocks away from the surface share one of two constant bricks, so the look-up never branches.
 *
 * Values are 16-bit multiples of a level's quantum, a power of two: for a band of 3 voxels 2^-13 voxel, of 6
 * 2^-12. Rounding is then all that is lost, and a cell interpolates to the same bits as its floats would. */
#ifndef VSHI_FIELD_H
#define VSHI_FIELD_H

#include "base/vec.h"

#include <stdbool.h>
#include <stdint.h>
#include <vdbshade/field.h>

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
    uint64_t first_value; /* of this level in vsh_field.values; its first brick is all +band, its second all
                           * -band */
    uint64_t brick_count; /* with these two */
    float scale;          /* 2^level: voxel size, finest voxels */
    float band;           /* finest voxels, a multiple of `quantum`; values are clamped to ± band */
    float quantum;        /* a step of the values, finest voxels */
    float rounding;       /* how far rounding may have moved a value, here and on the levels below, finest
                           * voxels */
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
    double grown;           /* by how much casters are grown for rays, voxels */
    vsh_triangles *surface; /* of the finest level, as much grown, field space (surface.h): only for
                             * vshi_triangles_blocked(). NULL: rays are marched */
};

/* Trilinear sample of one level at a field-space position; ± band where nothing is nearer, +band outside the
 * level's blocks. Where `gradient` is not NULL, it is the cell's own, per finest voxel. */
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
    const uint64_t block = ((uint64_t)(cell[0] >> 3) * (uint64_t)level->size[1] + (uint64_t)(cell[1] >> 3)) *
                               (uint64_t)level->size[2] +
                           (uint64_t)(cell[2] >> 3);
    const int16_t *v = field->values + field->index[level->first_index + block] +
                       (cell[0] & 7) * VSHI_STRIDE_X + (cell[1] & 7) * VSHI_STRIDE_Y + (cell[2] & 7);
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

/* A cell whose far corners are clamped to the band reads up to √3 voxels short, but only within half a voxel
 * of the band: this much of a band is left to the next level, voxels. */
#define VSHI_BAND_EDGE 0.5f

/* Error of a trilinear sample, voxels: the distance is 1-Lipschitz and a cell's centre is √3/2 from its
 * corners. */
#define VSHI_SLACK 0.87f
/* A distance is semiconcave away from the surface: its second derivatives are at most 1/d (Cannarsa and
 * Sinestrari, "Semiconcave functions", 2004). So Jensen's inequality bounds a trilinear sample's excess by
 * half the mean square distance to the corners, 3/8 voxel², over the least d in the cell. */
#define VSHI_CURVATURE 0.375f
/* How far a value of a coarse level may be above the distance at its own place, voxels of the level. Coarse
 * values are distances to surface points that were found, which are not always the nearest. The finest
 * level's are exact but for vshi_level.rounding. Values within solids may be off by twice as much: where
 * solids overlap, a finest value may be the distance to a triangle inside the union, which a coarse level
 * does not know. Checked on all voxels of the cloister at 512 voxels: 19 of 5.4 million free balls were too
 * large within solids, by up to 0.25 voxels, and none of 12.7 million outside. */
#define VSHI_NODE 0.3f

/* Whether a sample of a level is beyond what that level resolves. */
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

/* The same for callers who march by it: beyond the finest band |distance| is a lower bound. Where `gradient`
 * is not NULL, it points the way in which the distance grows; zero beyond the reach. */
float vshi_field_lower_bound(const vsh_field *field, const float p[3], float gradient[3]);

/* World position to field space, in double precision. */
static inline vshi_vec vshi_to_field(const vsh_field *field, const double position[3]) {
    return vshi_transform_point(field->to_field, vshi_vec_of(position));
}

/* And back: to_field is a turn over the voxel size, so its inverse is its transpose times the square. */
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

/* A field without casters, in which everything is free. Start offsets are measured in its voxel size, world
 * units, 1e-12 … 1e12; distances are a lower bound beyond all reach; its bounds are 0. Free it with
 * vsh_field_free(). Errors: VSH_ERROR_ARGUMENT, VSH_ERROR_MEMORY. */
vsh_result vshi_field_create_empty(double voxel_size, vsh_field **field, vsh_error *error);

static inline bool vshi_field_is_empty(const vsh_field *field) {
    return field->bounds_min[0] > field->bounds_max[0];
}

/* What stands for casters that are traced only: their box, and distances of 0 everywhere, which prove neither
 * that anything is free nor that it is solid. Lengths are told in voxels of this size, world units, 1e-12 …
 * 1e12, though there are none. Free it with vsh_field_free(). Errors: VSH_ERROR_ARGUMENT, VSH_ERROR_MEMORY.
 */
vsh_result vshi_field_create_unknown(double voxel_size, const double low[3], const double high[3],
                                     vsh_field **field, vsh_error *error);

#endif
