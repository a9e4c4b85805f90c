/* What the bake knows of texels and charts beyond the public view. */
#ifndef VSHI_BAKE_TEXELS_H
#define VSHI_BAKE_TEXELS_H

#include "bake/ao_cut.h"
#include "bake/charts.h"
#include "shade/shade.h"

#include <vdbshade/bake.h>

/* A row of tiles, rasterised. */
typedef struct vshi_tile_row {
    size_t samples;
    size_t texels; /* covered */
    size_t edges;  /* of those, with one that is not beside it in its tile */
} vshi_tile_row;

struct vsh_charts {
    vsh_charts_info info;
    vshi_charts sorted;
    int32_t padding;
    bool fills;         /* what is beyond the padding too, where a lightmap is whole */
    int32_t ao_spacing; /* 1 where texels have several samples */
    bool tangents;
    bool smooth; /* a mesh has normals, which may not be those of its triangles */
    vsh_shade_options shade;
    vshi_tile_row *rows;  /* [sorted.rows] */
    unsigned char *sheet; /* [triangles of all meshes]: it has air on both sides, so that the field holds its
                             shell */
};

/* Bytes of one sample in texels. */
static inline size_t vshi_sample_bytes(bool tangents) {
    return 3 * sizeof(double) + (tangents ? 13 : 9) * sizeof(float) + 2 * sizeof(uint32_t);
}

/* vsh_charts_create() with all that is checked, but for the memory of samples: VSH_ERROR_LIMIT where there
 * are more than the run's limit allows beside the charts, if `limited`. */
vsh_result vshi_charts_make(const vsh_mesh *meshes, size_t mesh_count, const vsh_lightmap_options *options,
                            const vsh_run *run, bool limited, vsh_uv_report *uv_reports, vsh_charts **charts,
                            vsh_error *error);

/* Rows of texels that a band holds: its own, those beside it that its padding is copied from, and those below
 * them whose rays their AO shares. */
typedef struct vshi_band {
    size_t own_begin, own_end;   /* tile rows */
    size_t held_begin, held_end; /* the same */
    size_t laid_begin, laid_end; /* of those, the ones that have samples */
    int32_t own_first, own_rows; /* rows of texels */
    int32_t first, rows;         /* the same, held */
} vshi_band;

/* `cut`: of a part that the rows are of (bake/part.h), which hold none to copy from; NULL: of none. Errors:
 * VSH_ERROR_ARGUMENT. */
vsh_result vshi_band_set(const vsh_charts *charts, int32_t first_row, int32_t rows, const vshi_ao_cut *cut,
                         vshi_band *band, vsh_error *error);

/* vsh_charts_band_bytes(), of rows of a part too. */
uint64_t vshi_charts_band_bytes(const vsh_charts *charts, int32_t first_row, int32_t rows,
                                const vshi_ao_cut *cut, const vsh_lightmap *lightmap, size_t light_count);

/* Rows of tiles that the AO of rows begin … end - 1 depends on, where texels share it, of `all`: those of its
 * lattice's squares (8 × 8 spacings) and of the squares beside these, and whether these end there. */
static inline void vshi_ao_rows(int32_t spacing, size_t all, size_t *begin, size_t *end) {
    const size_t square = (size_t)spacing, first = *begin / square, last = (*end + square - 1) / square + 1;
    *begin = first > 0 ? (first - 1) * square : 0;
    *end = last * square < all ? last * square + 1 : all;
}

/* What vsh_bake_lightmap() takes beside field, texels and planes, bytes: the most it holds at a time. */
typedef struct vshi_bake_need {
    double samples;      /* held */
    int32_t width, rows; /* the same, texels */
    bool traced;         /* rays against triangles */
    bool smooth;         /* as of the charts */
    bool values, errors, irradiance, bent, tint;
    bool windows; /* AO by the texels around */
    bool fills;   /* what is beyond the padding */
    int32_t threads;
} vshi_bake_need;

double vshi_bake_bytes(const vshi_bake_need *need);

/* The samples of a texel follow each other; texels come tile by tile (8 × 8), tiles row by row. */
struct vsh_texels {
    vsh_texels_info info; /* of the band's own rows */
    vshi_band band;
    vshi_ao_cut cut; /* of a part */
    int32_t padding;
    bool fills;              /* what is beyond it too */
    int32_t ao_spacing;      /* as of the charts */
    vsh_shade_options shade; /* those given with the lightmap's size */
    bool smooth;             /* as of the charts */
    size_t count;            /* samples */
    uint64_t whole;          /* samples of the whole lightmap, all its bands */
    size_t *row_start;       /* [held tile rows + 1]: first sample of each */
    double *position;        /* [count][3] */
    float *normal;           /* [count][3] */
    float *geometric;        /* [count][3] */
    float *lift;             /* [count][3]: of the position off its triangle, world units */
    uint32_t *texel;         /* [count]: vsh_texel() in the whole lightmap */
    uint32_t *mesh;          /* [count]: index of the mesh, and VSHI_SAMPLE_…: vshi_sample_mesh() */
    float *tangent;          /* [count][4]: of the triangle, unit, and its handedness; NULL: not asked for */
    size_t mesh_count;
};

/* In a sample's mesh: its triangle is a sheet. */
#define VSHI_SAMPLE_SHEET UINT32_C(0x80000000)
/* Whose texel's middle is beside its chart: it stands on the chart's border, which may lie in other surfaces.
 */
#define VSHI_SAMPLE_BORDER UINT32_C(0x40000000)
enum { VSHI_MOST_MESHES = 0x3fffffff };

static inline uint32_t vshi_sample_mesh(const vsh_texels *texels, size_t sample) {
    return texels->mesh[sample] & ~(VSHI_SAMPLE_SHEET | VSHI_SAMPLE_BORDER);
}

static inline bool vshi_sample_is_sheet(const vsh_texels *texels, size_t sample) {
    return (texels->mesh[sample] & VSHI_SAMPLE_SHEET) != 0;
}

static inline bool vshi_sample_is_border(const vsh_texels *texels, size_t sample) {
    return (texels->mesh[sample] & VSHI_SAMPLE_BORDER) != 0;
}

/* Place of a sample's texel in the whole lightmap, and among those that are held. */
static inline size_t vshi_sample_place(const vsh_texels *texels, size_t sample) {
    return vsh_texel_place(texels->texel[sample], texels->info.width);
}

static inline size_t vshi_sample_held(const vsh_texels *texels, size_t sample) {
    return vshi_sample_place(texels, sample) - (size_t)texels->band.first * (size_t)texels->info.width;
}

/* Texels that are held. */
static inline size_t vshi_texels_held(const vsh_texels *texels) {
    return (size_t)texels->band.rows * (size_t)texels->info.width;
}

/* Whether rows beside the band's own are held. */
static inline bool vshi_texels_hold_more(const vsh_texels *texels) {
    return texels->band.own_begin > texels->band.held_begin || texels->band.own_end < texels->band.held_end;
}

#endif
