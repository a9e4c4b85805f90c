/* Unwrapping of any triangles: an atlas in which every corner is its mesh's, or a reason. The coordinates are
 * few, so that vertices, edges and triangles fall on each other. */
#include "fuzz.h"

#include <vdbshade/lightmap.h>

#include <math.h>

enum { MOST_MESHES = 3, MOST_VERTICES = 48, MOST_TRIANGLES = 64 };

typedef struct arrays {
    float positions[3 * MOST_VERTICES], normals[3 * MOST_VERTICES], uvs[2 * MOST_VERTICES];
    uint32_t indices[3 * MOST_TRIANGLES];
    double transform[12];
} arrays;

static float number(fuzz_input *input) {
    return 0.25f * (float)(int8_t)fuzz_byte(input);
}

static vsh_mesh take_mesh(fuzz_input *input, arrays *a) {
    const uint8_t how = fuzz_byte(input);
    vsh_mesh mesh = {
        .name = "a", .positions = a->positions, .indices = a->indices, .transform = a->transform};
    mesh.vertex_count = fuzz_byte(input) % (MOST_VERTICES + 1);
    mesh.triangle_count = fuzz_byte(input) % (MOST_TRIANGLES + 1);
    for (size_t i = 0; i < 3 * mesh.vertex_count; ++i) {
        a->positions[i] = number(input);
        a->normals[i] = (how & 1) != 0 ? number(input) : 0.0f;
    }
    for (size_t i = 0; (how & 2) != 0 && i < 2 * mesh.vertex_count; ++i) {
        a->uvs[i] = (float)fuzz_byte(input) / 128.0f;
    }
    const size_t range = mesh.vertex_count + ((how & 4) != 0); /* one may be out of range */
    for (size_t i = 0; i < 3 * mesh.triangle_count; ++i) {
        a->indices[i] = range > 0 ? (uint32_t)(fuzz_byte(input) % range) : 0;
    }
    for (int i = 0; i < 12; ++i) {
        a->transform[i] = (how & 8) != 0 ? (double)number(input) : (double)(i % 5 == 0);
    }
    if ((how & 16) != 0) { /* floats of any bits */
        fuzz_fill(input, a->positions, sizeof a->positions[0] * 3);
    }
    mesh.normals = (how & 1) != 0 ? a->normals : NULL;
    mesh.uvs = (how & 2) != 0 ? a->uvs : NULL;
    return mesh;
}

static void check_mesh(const vsh_atlas *atlas, const vsh_mesh *mesh, size_t index) {
    const vsh_atlas_mesh placed = vsh_atlas_mesh_view(atlas, index);
    FUZZ_REQUIRE(placed.triangle_count == mesh->triangle_count);
    for (size_t v = 0; v < placed.vertex_count; ++v) {
        FUZZ_REQUIRE(placed.sources[v] < mesh->vertex_count);
        for (size_t k = 0; k < 2; ++k) {
            FUZZ_REQUIRE(placed.uvs[2 * v + k] >= 0.0f && placed.uvs[2 * v + k] <= 1.0f);
        }
    }
    vsh_atlas_info info;
    vsh_atlas_get_info(atlas, &info);
    for (size_t t = 0; t < placed.triangle_count; ++t) {
        const uint32_t *corners = placed.indices + 3 * t, chart = placed.charts[t];
        for (size_t k = 0; k < 3; ++k) {
            FUZZ_REQUIRE(corners[k] < placed.vertex_count);
            FUZZ_REQUIRE(placed.sources[corners[k]] == mesh->indices[3 * t + k]);
        }
        if (chart == VSH_NO_CHART) {
            continue;
        }
        FUZZ_REQUIRE(chart < info.charts && vsh_atlas_charts(atlas)[chart].mesh == index);
        const float *a = placed.uvs + 2 * (size_t)corners[0], *b = placed.uvs + 2 * (size_t)corners[1],
                    *c = placed.uvs + 2 * (size_t)corners[2];
        FUZZ_REQUIRE(((double)b[0] - (double)a[0]) * ((double)c[1] - (double)a[1]) >=
                     ((double)b[1] - (double)a[1]) * ((double)c[0] - (double)a[0]));
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static arrays all[MOST_MESHES];
    fuzz_input input = {data, size};
    vsh_mesh meshes[MOST_MESHES];
    vsh_unwrap_options options = vsh_unwrap_options_default();
    const uint8_t how = fuzz_byte(&input);
    const size_t count = 1 + fuzz_byte(&input) % MOST_MESHES;
    options.width = 1 + fuzz_byte(&input);
    options.height = 1 + fuzz_byte(&input);
    options.max_pages = 1 + fuzz_byte(&input) % 8;
    options.padding = fuzz_byte(&input) % 8;
    options.keep_uvs = (how & 1) != 0 ? VSH_UNWRAP_KEEP : VSH_UNWRAP_ALWAYS;
    options.texels_per_unit = (how & 2) != 0 ? (double)fuzz_byte(&input) / 8.0 : 0.0;
    options.max_stretch = 1.01 + (double)fuzz_byte(&input) / 64.0;
    for (size_t i = 0; i < count; ++i) {
        meshes[i] = take_mesh(&input, &all[i]);
    }
    if ((how & 4) != 0 && count > 1) { /* an instance */
        const double *transform = meshes[1].transform;
        meshes[1] = meshes[0];
        meshes[1].transform = transform;
    }
    const vsh_run run = fuzz_run();
    vsh_atlas *atlas;
    FUZZ_MAKE(atlas, vsh_unwrap(meshes, count, &options, &run, &atlas, fuzz_error()));
    for (size_t i = 0; atlas != NULL && i < count; ++i) {
        check_mesh(atlas, &meshes[i], i);
    }
    vsh_atlas_info info = {.charts = 0};
    if (atlas != NULL) {
        vsh_atlas_get_info(atlas, &info);
    }
    for (size_t i = 0; i < info.charts; ++i) {
        const vsh_atlas_chart *chart = &vsh_atlas_charts(atlas)[i];
        FUZZ_REQUIRE(chart->page < info.pages && chart->min[0] >= 0 && chart->min[1] >= 0);
        FUZZ_REQUIRE(chart->max[0] <= options.width && chart->max[1] <= options.height);
    }
    vsh_atlas_free(atlas);
    return 0;
}
