#include "lost.h"

#include "message.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Of a mesh's area: less is told of none. Edges sharper than a voxel are lost everywhere. */
static const double TOLD = 0.005;
/* Voxels that hold a part are so much smaller than it is thick. */
static const double HELD = 0.8;

static bool is_in(const vsh_caster *caster, const vsh_scene_layer *layer) {
    return layer != NULL ? caster->layer != NULL && strcmp(caster->layer, layer->name) == 0
                         : caster->layer == NULL;
}

static void warn(const vsh_caster *caster, const vsh_mesh *mesh, const vsh_lost *lost, double voxel_size,
                 const vsh_run *run) {
    char line[1024], share[32], help[64] = "finer ones may hold it";
    snprintf(share, sizeof share, "%.2g %%", 100.0 * lost->share);
    if (lost->thickness > 0.0) {
        snprintf(help, sizeof help, "voxels of %.2g hold most of it", HELD * lost->thickness);
    }
    snprintf(line, sizeof line,
             "%s: mesh '%s': %s of its area is lost, thinner than 1.25 voxels of %.3g: nothing is cast "
             "there; %s, and --method exact needs none",
             caster->path, mesh->name != NULL ? mesh->name : "", share, voxel_size, help);
    run->warning(run->user, line);
}

/* Looks over one caster's meshes, a second time with triangles where something is lost. */
static int look(const vsh_caster *caster, const vsh_mesh *meshes, size_t count, const vsh_field *field,
                double voxel_size, const vsh_run *run) {
    vsh_lost *lost = calloc(count, sizeof *lost);
    vsh_triangles *triangles = NULL;
    vsh_error error;
    if (lost == NULL) {
        return cli_out_of_memory("lost casters");
    }
    vsh_result result = vsh_field_find_lost(field, meshes, count, NULL, lost, &error);
    bool any = false;
    for (size_t m = 0; m < count && result == VSH_OK; ++m) {
        any = any || lost[m].share >= TOLD;
    }
    if (any && vsh_triangles_available()) {
        result = vsh_triangles_create(meshes, count, run, &triangles, &error);
        result =
            result == VSH_OK ? vsh_field_find_lost(field, meshes, count, triangles, lost, &error) : result;
    }
    for (size_t m = 0; m < count && result == VSH_OK; ++m) {
        if (lost[m].share >= TOLD) {
            warn(caster, &meshes[m], &lost[m], voxel_size, run);
        }
    }
    vsh_triangles_free(triangles);
    free(lost);
    return result == VSH_OK ? CLI_OK : cli_fail_of(NULL, &error);
}

int cli_lost_warn(const vsh_scene *scene, const vsh_assets *assets, const vsh_scene_layer *layer,
                  const vsh_field *field, double voxel_size, const vsh_run *run) {
    int code = CLI_OK;
    if (run->warning == NULL || !vsh_scene_marches(scene, layer)) {
        return code;
    }
    for (size_t i = 0; i < scene->caster_count && code == CLI_OK; ++i) {
        size_t count = 0;
        const vsh_mesh *meshes = vsh_assets_caster(assets, i, &count);
        if (count > 0 && scene->casters[i].type == VSH_CASTER_MESH && is_in(&scene->casters[i], layer)) {
            code = look(&scene->casters[i], meshes, count, field, voxel_size, run);
        }
    }
    return code;
}
