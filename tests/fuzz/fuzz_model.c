/* Mesh files, the whole way: our scanners, Assimp, our checks. The first byte chooses the format. What is
 * read must be a mesh that vsh_mesh_check() takes. */
#include "fuzz.h"

#include <vdbshade/mesh.h>

#include <stdlib.h>
#include <string.h>

static void check(const vsh_model *model) {
    for (size_t i = 0; i < vsh_model_mesh_count(model); ++i) {
        const vsh_mesh mesh = vsh_model_mesh(model, i, -1);
        vsh_mesh_report report;
        vsh_error error;
        const vsh_result result = vsh_mesh_check(&mesh, &report, fuzz_error(&error));
        fuzz_ended(result, &error, result == VSH_OK ? &report : NULL);
        if (result != VSH_OK || mesh.triangle_count == 0) {
            abort();
        }
    }
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
    vsh_error error;
    const vsh_result result = vsh_model_read(path, &run, &model, fuzz_error(&error));
    fuzz_ended(result, &error, model);
    if (result == VSH_OK) {
        check(model);
    }
    vsh_model_free(model);
    return 0;
}
