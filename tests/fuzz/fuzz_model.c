/* Mesh files pass our scanners, Assimp and our checks. The first byte chooses the format. A file that is read
 * must be a mesh that vsh_mesh_check() accepts, and can be written with light. */
#include "fuzz.h"

#include <vdbshade/scene.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void check(const vsh_model *model) {
    for (size_t i = 0; i < vsh_model_mesh_count(model); ++i) {
        const vsh_mesh mesh = vsh_model_mesh(model, i, -1);
        vsh_mesh_report report;
        FUZZ_REQUIRE(fuzz_check_plain(vsh_mesh_check(&mesh, &report, fuzz_error())) == VSH_OK &&
                     mesh.triangle_count > 0);
    }
}

/* Every corner is a vertex of its own, and the first triangle of each mesh lies on another page. */
static void light(const char *path, const vsh_model *model, const vsh_run *run) {
    static const uint32_t pages[] = {0, 1};
    const size_t count = vsh_model_mesh_count(model);
    size_t most = 0;
    for (size_t i = 0; i < count; ++i) {
        const size_t triangles = vsh_model_mesh(model, i, 0).triangle_count;
        most = triangles > most ? triangles : most;
    }
    vsh_lit_mesh *meshes = calloc(count, sizeof *meshes);
    float *uvs = calloc(6 * most, sizeof *uvs);
    uint32_t *indices = calloc(3 * most, sizeof *indices), *charts = calloc(most, sizeof *charts);
    for (size_t i = 0; i < 6 * most; ++i) {
        uvs[i] = (float)(i % 1021) / 1021.0f;
    }
    for (size_t i = 0; i < 3 * most; ++i) {
        indices[i] = (uint32_t)i;
    }
    charts[0] = 1;
    for (size_t i = 0; i < count; ++i) { /* each corner is a copy of the vertex that it indexes */
        const vsh_mesh mesh = vsh_model_mesh(model, i, 0);
        meshes[i] = (vsh_lit_mesh){
            uvs, mesh.indices, indices, charts, 3 * mesh.triangle_count, mesh.triangle_count, 0, -1, NULL};
    }
    char output[1024];
    snprintf(output, sizeof output, "%s/lit.glb", fuzz_folder());
    vsh_lit_options options = vsh_lit_options_default();
    options.chart_pages = pages;
    options.chart_count = 2;
    const vsh_result result =
        fuzz_check_plain(vsh_lit_write(path, model, meshes, &options, output, run, fuzz_error()));
    FUZZ_REQUIRE((unlink(output) == 0) == (result == VSH_OK));
    free(charts);
    free(indices);
    free(uvs);
    free(meshes);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const char *const names[] = {"a.obj", "a.ply", "a.stl", "a.gltf", "a.glb", "a.fbx", "a.dae"};
    if (size == 0) {
        return 0;
    }
    const char *name = names[data[0] % (sizeof names / sizeof names[0])];
    const char *path = fuzz_file(name, data + 1, size - 1);
    const vsh_run run = fuzz_run();
    vsh_model *model;
    if (FUZZ_MAKE(model, vsh_model_read(path, &run, &model, fuzz_error())) == VSH_OK) {
        check(model);
        light(path, model, &run);
    }
    vsh_model_free(model);
    return 0;
}
