/* Noise on two charts of one surface, stitched: for hashes of what seams are made. */
#ifndef TESTS_STITCHED_H
#define TESTS_STITCHED_H

#include "baked.h"

/* A square in two charts, one of them turned, in an image of 48 × 48. */
static inline void add_stitched(const vsh_run *run, bits *b) {
    static const float corners[24] = {0, 0, 0, 1, 0, 0, 1, 2, 0, 0, 2, 0, 1, 0, 0, 2, 0, 0, 2, 2, 0, 1, 2, 0};
    static const float uvs[16] = {0.05f, 0.07f, 0.37f, 0.07f, 0.37f, 0.81f, 0.05f, 0.81f,
                                  0.50f, 0.20f, 0.67f, 0.06f, 0.96f, 0.63f, 0.79f, 0.77f};
    static const uint32_t indices[12] = {0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7};
    const vsh_mesh mesh = {
        .positions = corners, .uvs = uvs, .indices = indices, .vertex_count = 8, .triangle_count = 4};
    enum { STITCHED = 48, STITCHED_TEXELS = STITCHED * STITCHED };
    static float open[STITCHED_TEXELS], light[3 * STITCHED_TEXELS];
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = STITCHED;
    uint32_t random = 1;
    for (size_t i = 0; i < 3 * STITCHED_TEXELS; ++i) {
        random = random * 1664525u + 1013904223u;
        light[i] = (float)(random >> 8) * 0x1p-24f;
        open[i / 3] = light[i];
    }
    const vsh_lightmap map = {.ao = open, .irradiance = light};
    vsh_charts *charts = NULL;
    vsh_error error;
    check(vsh_charts_create(&mesh, 1, &options, run, NULL, &charts, &error), &error);
    check(vsh_lightmap_stitch(charts, &map, 0, NULL, run, NULL, &error), &error);
    vsh_charts_free(charts);
    add_floats(b, open, STITCHED_TEXELS);
    add_floats(b, light, 3 * STITCHED_TEXELS);
}

#endif
