/* What the bake knows of texels beyond the public view. */
#ifndef VSHI_BAKE_TEXELS_H
#define VSHI_BAKE_TEXELS_H

#include <vdbshade/bake.h>

/* The samples of a texel follow each other; texels come tile by tile (8 × 8), tiles row by row. */
struct vsh_texels {
    vsh_texels_info info;
    int32_t padding;
    int32_t ao_spacing;      /* 1 where texels have several samples */
    vsh_shade_options shade; /* those given with the lightmap's size */
    size_t count;            /* samples */
    double *position;        /* [count][3] */
    float *normal;           /* [count][3] */
    float *geometric;        /* [count][3] */
    uint32_t *texel;         /* [count] */
    uint32_t *mesh;          /* [count]: index of the mesh */
    size_t mesh_count;
    unsigned char *open; /* [mesh_count]: the mesh bounds no solid, so that the field holds its shell */
};

#endif
