/* Where the rays of a lightmap's samples begin, and which samples can be shaded at all. */
#ifndef VSHI_BAKE_ORIGINS_H
#define VSHI_BAKE_ORIGINS_H

#include "bake/texels.h"
#include "shade/lift.h"

enum { VSHI_ORIGIN_BLOCK = 1024 }; /* samples that are worked on together */

/* The valid samples, close-packed in the order of the texels' samples. */
typedef struct vshi_origins {
    size_t count;
    double *position; /* [count][3]: start offset above the triangle, where marches begin; world units */
    double *start;    /* [count][3]: where the rays of the channel at hand begin, set by vshi_origins_lift();
                         NULL where that is `position` */
    float *normal;    /* [count][3]: smooth; decides shadow */
    float *face;      /* [count][3]: of the triangle; NULL where all normals are those of the triangles */
    uint32_t *texel;  /* [count]: as vsh_points.texels; a texel's further samples get numbers of their own */
    uint8_t *valid;   /* [all samples]: 1 where the sample is among them */
    size_t blocks;    /* of all samples */
    size_t *before;   /* [blocks + 1]: valid samples before each block */
    vshi_point_rows rows; /* of tiles, the band's own counted */
    size_t *row_start;    /* [rows.count + 1] */
    uint8_t *needed;      /* [rows.count]: VSHI_ROW_… */
} vshi_origins;

/* What is baked of the samples. */
typedef struct vshi_origins_for {
    bool lights, ao;
} vshi_origins_for;

/* What a tile row that is held is for: nothing, and its samples count as invalid; to tell those of other rows
 * what is around them; for its values. */
enum { VSHI_ROW_LEFT_OUT = 0, VSHI_ROW_BESIDE, VSHI_ROW_WANTED };

/* Called once it is known which samples are valid, with all of them: sets rows[] to VSHI_ROW_… of each tile
 * row held. */
typedef vsh_result vshi_origins_keep(void *user, const vshi_origins *origins, uint8_t *rows,
                                     vsh_error *error);

/* Bytes that the origin of a sample takes at most. */
double vshi_origins_sample_bytes(bool traced, bool smooth);

/* Lifts each sample along its geometric normal by the start offset, and by half a shell's thickness where its
 * mesh is open. A sample is invalid inside a solid or behind a wall of
 * the casters: where there are triangles, by rays against them (see vshi_inside()); where a field is marched,
 * also if it ends up inside the field's solid, or all but. The layers are looked at as well. Free with
 * vshi_origins_free() also after an error. Errors: VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_origins_create(const vsh_occluders *occluders, const vsh_texels *texels,
                               const vsh_shade_options *options, vshi_origins_for what,
                               vshi_origins_keep *keep, void *user, const vsh_run *run, vshi_origins *origins,
                               vsh_error *error);
/* The sample's position on its triangle. */
static inline vshi_vec vshi_sample_foot(const vsh_texels *texels, size_t sample) {
    return vshi_sub(vshi_vec_of(texels->position + 3 * sample), vshi_vec_off(texels->lift + 3 * sample));
}

static inline vshi_lift_point vshi_sample_lift_point(const vsh_texels *texels, size_t sample) {
    return (vshi_lift_point){vshi_sample_foot(texels, sample), vshi_vec_off(texels->lift + 3 * sample),
                             vshi_vec_off(texels->geometric + 3 * sample),
                             vshi_vec_off(texels->normal + 3 * sample)};
}

/* Sets origins->start, where the rays to a light begin: on the triangles if `traced`, else at
 * origins->position; plus the lift. Errors: VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_origins_lift(const vshi_lifter *lifter, const vsh_texels *texels, bool traced,
                             const vsh_run *run, vshi_origins *origins, vsh_error *error);
void vshi_origins_free(vshi_origins *origins);

#endif
