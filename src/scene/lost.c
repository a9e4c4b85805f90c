/* Casters that are thinner than voxels: named, where what is baked depends on them. */
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "scene/occluders.h"

#include <stdio.h>
#include <stdlib.h>

/* Of a mesh's area: less is told of none. Edges sharper than a voxel are lost everywhere. */
static const double TOLD = 0.005;
/* Voxels that hold a part are so much smaller than it is thick. */
static const double HELD = 0.8;

static void warn(const vsh_caster *caster, const vsh_mesh *mesh, const vsh_lost *lost, double voxel_size,
                 const vsh_run *run) {
    char share[32], help[64] = "finer ones may hold it";
    snprintf(share, sizeof share, "%.2g %%", 100.0 * lost->share);
    if (lost->thickness > 0.0) {
        snprintf(help, sizeof help, "voxels of %.2g hold most of it", HELD * lost->thickness);
    }
    vshi_warn(run,
              "%s: mesh '%s': %s of its area is thinner than 1.25 voxels of %.3g and casts nothing; "
              "%s, and --method exact needs none",
              caster->path, mesh->name != NULL ? mesh->name : "", share, voxel_size, help);
}

/* Finds what is lost of one caster's meshes, a second time with triangles where something is. */
static vsh_result find(const vsh_mesh *meshes, size_t count, const vsh_field *field, const vsh_run *run,
                       vsh_lost *lost, vsh_error *error) {
    VSHI_TRY(vsh_field_find_lost(field, meshes, count, NULL, lost, error));
    bool any = false;
    for (size_t m = 0; m < count; ++m) {
        any = any || lost[m].share >= TOLD;
    }
    if (!any) {
        return VSH_OK;
    }
    vsh_triangles *triangles = NULL;
    VSHI_TRY(vsh_triangles_create(meshes, count, run, &triangles, error));
    const vsh_result result = vsh_field_find_lost(field, meshes, count, triangles, lost, error);
    vsh_triangles_free(triangles);
    return result;
}

static vsh_result look(const vsh_caster *caster, const vsh_mesh *meshes, size_t count, const vsh_field *field,
                       const vsh_run *run, vsh_error *error) {
    void *memory;
    VSHI_TRY(vshi_allocate(&memory, count, sizeof(vsh_lost), "lost casters", error));
    vsh_result result = VSH_OK;
    vsh_lost *lost = memory;
    vsh_field_info info;
    vsh_field_get_info(field, &info);
    VSHI_TRY_DONE(find(meshes, count, field, run, lost, error));
    for (size_t m = 0; m < count; ++m) {
        if (lost[m].share >= TOLD) {
            warn(caster, &meshes[m], &lost[m], info.voxel_size, run);
        }
    }
done:
    free(lost);
    return result;
}

static void warn_one_sided(const vsh_caster *caster, const vsh_mesh *meshes, size_t count,
                           const vsh_run *run) {
    size_t one_sided = 0;
    for (size_t m = 0; m < count; ++m) {
        one_sided += meshes[m].one_sided != 0;
    }
    if (one_sided > 0) {
        vshi_warn(run,
                  "%s: %zu of %zu meshes are one-sided, but voxels cast to both sides; --method exact and "
                  "--ao-method exact let light through their backs",
                  caster->path, one_sided, count);
    }
}

vsh_result vshi_scene_warn_lost(const vsh_scene *scene, const vsh_assets *assets,
                                const vsh_scene_layer *layer, const vsh_field *field, const vsh_run *run,
                                vsh_error *error) {
    if (run->warning == NULL || !vsh_scene_marches(scene, layer)) {
        return VSH_OK;
    }
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        size_t count = 0;
        const vsh_mesh *meshes = vsh_assets_caster(assets, i, &count);
        if (count == 0 || caster->type != VSH_CASTER_MESH || !vshi_caster_in_layer(caster, layer)) {
            continue;
        }
        warn_one_sided(caster, meshes, count, run);
        VSHI_TRY(look(caster, meshes, count, field, run, error));
    }
    return VSH_OK;
}
