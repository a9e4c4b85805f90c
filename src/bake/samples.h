/* Samples of texels, written into their arrays. */
#ifndef VSHI_BAKE_SAMPLES_H
#define VSHI_BAKE_SAMPLES_H

#include "bake/rows.h"
#include "bake/texels.h"
#include "mesh/smooth_surface.h"

/* Box of positions. */
typedef struct vshi_sample_box {
    double low[3], high[3];
} vshi_sample_box;

/* Writes samples one after the other; neighbours are nearly always of one triangle, which stays set up. */
typedef struct vshi_sample_writer {
    const vsh_charts *charts;
    vsh_texels *texels; /* NULL: only the box is found */
    const vshi_row *work;
    vshi_sample_box *box; /* NULL: it is not asked for */
    size_t next;
    uint32_t number; /* triangle + 1 that is set up; 0: none */
    vshi_surface surface;
    float tangent[4]; /* of it, where they are asked for */
} vshi_sample_writer;

/* Memory for texels->count samples, which vsh_texels_free() frees, after an error too. Errors:
 * VSH_ERROR_MEMORY. */
vsh_result vshi_samples_take(vsh_texels *texels, bool tangents, vsh_error *error);

/* `most` samples at most of texel (x, y) of the row's tile; returns how many there are. */
size_t vshi_samples_write(vshi_sample_writer *w, size_t x, size_t y, uint32_t texel, size_t most);

#endif
