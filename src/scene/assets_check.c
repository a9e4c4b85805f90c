/* What is odd about a scene's meshes. */
#include "base/job.h"
#include "base/try.h"
#include "scene/assets.h"

#include <stdlib.h>
#include <string.h>

/* A message about arrays, with the file that they came from. */
static vsh_result name_file(const char *path, vsh_result result, vsh_error *error) {
    if (error != NULL) {
        const vsh_error of_mesh = *error;
        vshi_fail(error, result, "%s: %s", path, of_mesh.message);
    }
    return result;
}

/* Counts the triangles of zero area, which everything skips. What is open is told by the voxeliser. */
static vsh_result check_file(const char *path, const vsh_mesh *meshes, size_t count, const vsh_run *run,
                             vsh_error *error) {
    size_t *skipped = calloc(count + 1, sizeof *skipped), sound = 0;
    if (skipped == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    vsh_result result = VSH_OK;
    for (size_t i = 0; i < count; ++i) {
        vsh_mesh_report report;
        result = vsh_mesh_check(&meshes[i], &report, error);
        if (result != VSH_OK) {
            result = name_file(path, result, error);
            goto done;
        }
        skipped[i] = report.degenerate_triangles;
        sound += meshes[i].triangle_count - skipped[i];
    }
    if (sound == 0) {
        result = vshi_fail(error, VSH_ERROR_INPUT, "%s: every triangle has zero area", path);
        goto done;
    }
    for (size_t i = 0; i < count; ++i) {
        if (skipped[i] > 0) {
            vshi_warn(run, "%s: mesh '%s': %zu triangles of zero area are skipped", path,
                      meshes[i].name != NULL ? meshes[i].name : "", skipped[i]);
        }
    }
done:
    free(skipped);
    return result;
}

/* Whether one of the first casters and receivers is of that file, too. */
static bool is_seen(const vsh_scene *scene, size_t casters, size_t receivers, const char *path) {
    for (size_t i = 0; i < casters; ++i) {
        if (scene->casters[i].type == VSH_CASTER_MESH && strcmp(scene->casters[i].path, path) == 0) {
            return true;
        }
    }
    for (size_t i = 0; i < receivers; ++i) {
        if (strcmp(scene->receivers[i].path, path) == 0) {
            return true;
        }
    }
    return false;
}

vsh_result vshi_assets_check(const vsh_assets *assets, const vsh_scene *scene, const vsh_run *run,
                             vsh_error *error) {
    size_t count;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        if (caster->type == VSH_CASTER_MESH && !is_seen(scene, i, 0, caster->path)) {
            const vsh_mesh *meshes = vsh_assets_caster(assets, i, &count);
            VSHI_TRY(check_file(caster->path, meshes, count, run, error));
        }
    }
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        const vsh_receiver *receiver = &scene->receivers[i];
        if (receiver->type == VSH_RECEIVER_MESH && !is_seen(scene, scene->caster_count, i, receiver->path)) {
            const vsh_mesh *meshes = vsh_assets_receiver(assets, i, &count);
            VSHI_TRY(check_file(receiver->path, meshes, count, run, error));
        }
    }
    return VSH_OK;
}
