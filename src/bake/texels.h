/* Charts and texels, as the bake sees them. */
#ifndef VSHI_BAKE_TEXELS_H
#define VSHI_BAKE_TEXELS_H

#include "bake/tile.h"

#include <vdbshade/bake.h>

struct vsh_charts {
    vsh_charts_info info;
    vshi_charts sorted;
    int32_t padding;
    bool fills;         /* what is beyond the padding too */
    int32_t ao_spacing; /* 1 where texels have several samples */
    bool tangents;
    bool smooth;      /* a mesh has normals, which may not be those of its triangles */
    double centre[3]; /* of the meshes' box, world units: 32 bits tell places from there apart */
    vsh_shade_options shade;
    uint64_t *samples;    /* [tiles]: of each */
    unsigned char *sheet; /* [triangles of all meshes]: 1 where it has air on both sides, so that the field
                             holds its shell */
};

/* Warns of faults in a mesh's UVs, one line for each kind. `file` is the mesh's, or "". */
void vshi_warn_mesh_uvs(const char *file, const vsh_mesh *mesh, size_t index, const vsh_uv_report *uv,
                        const vsh_run *run);

struct vsh_texels {
    vshi_samples samples;
};

#endif
