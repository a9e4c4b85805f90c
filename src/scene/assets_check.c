/* What is odd about a scene's meshes. */
#include "base/job.h"
#include "base/try.h"
#include "mesh/mesh_set.h"
#include "scene/assets.h"

#include <string.h>

/* Tells of the triangles of zero area, which everything skips. What is open is told by the voxeliser. */
static vsh_result check_file(const char *path, const vsh_mesh *meshes, size_t count, const vsh_run *run,
                             vsh_error *error) {
    size_t sound = 0;
    for (size_t i = 0; i < count; ++i) {
        sound += meshes[i].triangle_count - meshes[i].checked->report.degenerate_triangles;
    }
    if (sound == 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: every triangle has zero area", path);
    }
    for (size_t i = 0; i < count; ++i) {
        const size_t skipped = meshes[i].checked->report.degenerate_triangles;
        if (skipped > 0) {
            vshi_note(run, "%s: mesh '%s': %zu triangles of zero area are skipped", path,
                      meshes[i].name != NULL ? meshes[i].name : "", skipped);
        }
    }
    return VSH_OK;
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
