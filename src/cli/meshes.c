#include "meshes.h"

#include "message.h"
#include "warnings.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int warn_file(const char *path, const vsh_mesh *meshes, size_t count) {
    size_t *skipped = calloc(count, sizeof *skipped);
    if (skipped == NULL) {
        cli_say("%s: the system refused memory", path);
        return CLI_LIMIT;
    }
    size_t sound = 0;
    int code = CLI_OK;
    for (size_t i = 0; i < count && code == CLI_OK; ++i) {
        vsh_mesh_report report;
        vsh_error error;
        if (vsh_mesh_check(&meshes[i], &report, &error) != VSH_OK) {
            code = cli_fail_of(path, &error);
            break;
        }
        skipped[i] = report.degenerate_triangles;
        sound += meshes[i].triangle_count - skipped[i];
    }
    if (code == CLI_OK && sound == 0) {
        code = cli_usage("%s: every triangle has zero area", path);
    }
    for (size_t i = 0; i < count && code == CLI_OK; ++i) {
        if (skipped[i] > 0) {
            cli_warn("%s: mesh '%s': %zu triangles of zero area are skipped", path,
                     meshes[i].name != NULL ? meshes[i].name : "", skipped[i]);
        }
    }
    free(skipped);
    return code;
}

static bool seen(const vsh_scene *scene, size_t casters, size_t receivers, const char *path) {
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

int cli_warn_meshes(const vsh_scene *scene, const vsh_assets *assets) {
    int code = CLI_OK;
    for (size_t i = 0; i < scene->caster_count && code == CLI_OK; ++i) {
        size_t count;
        const vsh_mesh *meshes = vsh_assets_caster(assets, i, &count);
        if (scene->casters[i].type == VSH_CASTER_MESH && !seen(scene, i, 0, scene->casters[i].path)) {
            code = warn_file(scene->casters[i].path, meshes, count);
        }
    }
    for (size_t i = 0; i < scene->receiver_count && code == CLI_OK; ++i) {
        size_t count;
        const vsh_mesh *meshes = vsh_assets_receiver(assets, i, &count);
        if (scene->receivers[i].type == VSH_RECEIVER_MESH &&
            !seen(scene, scene->caster_count, i, scene->receivers[i].path)) {
            code = warn_file(scene->receivers[i].path, meshes, count);
        }
    }
    return code;
}

int cli_load_assets(const vsh_scene *scene, const vsh_run *run, vsh_assets **assets) {
    vsh_error error;
    return vsh_assets_load(scene, run, assets, &error) == VSH_OK ? cli_warn_meshes(scene, *assets)
                                                                 : cli_fail_of(NULL, &error);
}
