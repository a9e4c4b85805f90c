/* What a part keeps of texels near its ends (bake/ao_cut.h): where their rays begin and what they met. AO,
 * the sky, and what is made of them, are finished by it. Rows follow each other in memory as in files, each
 * of them the arrays of its kinds. */
#ifndef VSHI_BAKE_AO_KEPT_H
#define VSHI_BAKE_AO_KEPT_H

#include "bake/ao_cut.h"

#include <stddef.h>

/* Kinds of what is kept beside places and normals, as bits. */
enum {
    VSHI_KEEPS_AO = 1,
    VSHI_KEEPS_SKY = 2,
    VSHI_KEEPS_OPEN = 4,    /* with AO, of bent normals */
    VSHI_KEEPS_TANGENT = 8, /* with these, of tangent space */
    VSHI_KEEPS_ALL = 15
};

/* What the rays of a texel came to. */
typedef struct vshi_ao_shot {
    float shot;     /* share of its own rays that are free */
    int32_t rays;   /* of them; 0: none */
    uint32_t level; /* vshi_ao_share's; 0: the texel has no rays, and no normal either */
    /* What holds it against the casters (bake/field_error.h): VSHI_AO_EVEN_… and how many samples it stands
     * for; how many of each of two sets of rays to them are free, 16 bits each. 0: nothing does. */
    uint32_t held[2];
} vshi_ao_shot;

_Static_assert(sizeof(vshi_ao_shot) == 20, "it is written as it is");

/* The first rays of both sets are all hidden, all free. */
#define VSHI_AO_EVEN_HIDDEN UINT32_C(0x80000000)
#define VSHI_AO_EVEN_FREE UINT32_C(0x40000000)
#define VSHI_AO_HELD_WEIGHT UINT32_C(0x3fffffff)

/* A row of texels; NULL: what is not of its kinds. */
typedef struct vshi_ao_kept {
    unsigned char *position; /* [width][3] doubles, at any address: where rays begin */
    float *normal;           /* [width][3] */
    vshi_ao_shot *ao, *sky;  /* [width] */
    float *open;             /* [width][3]: vshi_ao_task's bent, of a texel's own rays */
    float *tangent;          /* [width][4]: vsh_texels' */
} vshi_ao_kept;

enum { VSHI_KEPT_POSITION = 3 * sizeof(double) }; /* bytes */

/* Bytes of a texel, a multiple of 4. */
size_t vshi_ao_kept_bytes(uint32_t kinds);

/* Row `row` of those in `memory`. */
vshi_ao_kept vshi_ao_kept_row(uint32_t kinds, size_t width, void *memory, size_t row);

/* Whether a row can be what a bake kept whose texels share AO by `spacing`, and samples are held against the
 * casters by vshi_field_error_rays(). */
bool vshi_ao_kept_is_sound(const vshi_ao_kept *kept, size_t width, int32_t spacing, int32_t held_rays);

/* Whether a texel's value was left: it was not known without rays. */
bool vshi_ao_is_left(const vshi_ao_shot *shot);

/* Where what a band of a cut's rows keeps is put. */
typedef struct vshi_ao_keep {
    const vshi_ao_cut *cut;
    int32_t width;
    int32_t first, end; /* rows of the band */
    void *memory;       /* those of them that are kept; NULL: none is, and nothing is left */
    bool sky;           /* of the sky's rays, not of AO's */
} vshi_ao_keep;

/* Zeroes it. */
void vshi_ao_keep_clear(const vshi_ao_keep *keep);

/* False where a row of texels is not kept. */
bool vshi_ao_keep_row(const vshi_ao_keep *keep, int32_t row, vshi_ao_kept *kept);

/* What the rays of a texel came to whose value is left; NULL: it is not. */
vshi_ao_shot *vshi_ao_keep_left(const vshi_ao_keep *keep, int32_t column, int32_t row);

#endif
