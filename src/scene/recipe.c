/* Casters are told apart by what was loaded of them, not by their files: a model's new texture makes no field
 * stale unless its alpha cuts out what casts, and another unit or selection does. A .vdb, which a field makes
 * unneeded, is hashed as it lies. */
#include "scene/recipe.h"
#include "scene/occluders.h"

#include "base/digest.h"
#include "base/hash.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/numbers.h"
#include "base/parallel.h"
#include "base/try.h"
#include "outline/outline.h"
#include "scene/assets.h"
#include "spheres/sphere_tree.h"

#include <inttypes.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LINE = 512, GRAIN = 4096 };

static const char *const kinds[] = {"mesh", "sdf", "vdb", "heightfield", "spheres", "mask", "text"};
static const char *const units[] = {"triangles", "nodes", "", "triangles", "of them", "points", "points"};

/* Two hashes of a row of words. */
typedef struct row {
    uint64_t a, b;
} row;

static row begin_row(uint64_t seed) {
    return (row){vshi_mix(seed + 1), vshi_mix(~seed)};
}

static void add_word(row *r, uint64_t word) {
    r->a = vshi_mix(r->a ^ word);
    r->b = vshi_mix(r->b + word * UINT64_C(0x9e3779b97f4a7c15));
}

static void add_number(row *r, double number) {
    uint64_t word;
    memcpy(&word, &number, sizeof word);
    add_word(r, word);
}

static void add_numbers(row *r, const double *numbers, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        add_number(r, numbers[i]);
    }
}

static void add_row(vshi_caster_print *print, const row *r) {
    print->sum[0] += r->a;
    print->sum[1] += r->b;
}

/* --- triangles */

typedef struct looking {
    const vsh_mesh *mesh;
    row begin; /* of the mesh: every triangle's row begins so */
    _Atomic uint64_t sum[2];
} looking;

/* Sums know no order, so that none of threads or of files shows. */
static void look(void *user, size_t begin, size_t end) {
    looking *l = user;
    uint64_t sum[2] = {0, 0};
    for (size_t t = begin; t < end; ++t) {
        const uint32_t *corners = l->mesh->indices + 3 * t;
        row r = l->begin;
        for (int c = 0; c < 3; ++c) {
            uint64_t words[2] = {0, 0};
            memcpy(words, l->mesh->positions + 3 * (size_t)corners[c], 3 * sizeof(float));
            add_word(&r, words[0]);
            add_word(&r, words[1]);
            if (l->mesh->mask != NULL) {
                uint64_t uv;
                memcpy(&uv, l->mesh->mask_uvs + 2 * (size_t)corners[c], sizeof uv);
                add_word(&r, uv);
            }
        }
        sum[0] += r.a;
        sum[1] += r.b;
    }
    atomic_fetch_add(&l->sum[0], sum[0]);
    atomic_fetch_add(&l->sum[1], sum[1]);
}

/* What cuts a mesh out: its texture's alpha, and how that is looked up. */
static void add_mask(row *r, const vsh_alpha_mask *mask) {
    const size_t size = (size_t)mask->width * (size_t)mask->height;
    add_word(r, (uint64_t)(uint32_t)mask->width << 32 | (uint32_t)mask->height);
    add_word(r, (uint64_t)(uint32_t)mask->wrap[0] << 32 | (uint32_t)mask->wrap[1]);
    add_numbers(r, mask->uv_transform, 6);
    add_number(r, mask->alpha_cutoff);
    add_number(r, mask->base_alpha);
    for (size_t i = 0; i < size; i += sizeof(uint64_t)) {
        uint64_t word = 0;
        memcpy(&word, mask->alpha + i, size - i < sizeof word ? size - i : sizeof word);
        add_word(r, word);
    }
}

static vsh_result print_meshes(const vsh_mesh *meshes, size_t count, vshi_job *job, vshi_caster_print *print,
                               vsh_error *error) {
    const vsh_alpha_mask *last = NULL; /* objects of one material often follow each other */
    row cut = {0, 0};
    for (size_t m = 0; m < count; ++m) {
        looking l = {.mesh = &meshes[m], .begin = begin_row((uint64_t)meshes[m].solidity)};
        if (meshes[m].transform != NULL) {
            add_numbers(&l.begin, meshes[m].transform, 12);
        }
        if (meshes[m].mask != NULL && meshes[m].mask != last) {
            last = meshes[m].mask;
            cut = begin_row(0);
            add_mask(&cut, last);
        }
        if (meshes[m].mask != NULL) {
            add_word(&l.begin, cut.a);
            add_word(&l.begin, cut.b);
        }
        VSHI_TRY(vshi_parallel_for(job, meshes[m].triangle_count, GRAIN, 0, look, &l, error));
        print->sum[0] += atomic_load(&l.sum[0]);
        print->sum[1] += atomic_load(&l.sum[1]);
        print->count += meshes[m].triangle_count;
    }
    return VSH_OK;
}

/* --- what else casts */

static void print_sdf(const vsh_caster *caster, vshi_caster_print *print) {
    for (size_t i = 0; i < caster->sdf.node_count; ++i) {
        const vsh_sdf_node *n = &caster->sdf.nodes[i];
        row r = begin_row(i);
        add_word(&r, (uint64_t)(uint32_t)n->shape);
        add_word(&r, (uint64_t)(uint32_t)n->left << 32 | (uint32_t)n->right);
        add_numbers(&r, n->size, 3);
        add_number(&r, n->radius);
        add_number(&r, n->minor_radius);
        add_number(&r, n->rounding);
        add_number(&r, n->smoothing);
        add_number(&r, n->scale);
        add_numbers(&r, n->rotation, 4);
        add_numbers(&r, n->translation, 3);
        add_row(print, &r);
    }
    print->count = caster->sdf.node_count;
}

static void print_outline(const vsh_outline *outline, double thickness, vshi_caster_print *print) {
    row r = begin_row(outline->contour_count);
    add_number(&r, thickness);
    for (size_t i = 0; i <= outline->contour_count; ++i) {
        add_word(&r, outline->starts[i]);
    }
    print->count = outline->starts[outline->contour_count];
    for (size_t i = 0; i < print->count; ++i) {
        add_number(&r, outline->points[i].x);
        add_number(&r, outline->points[i].y);
    }
    add_row(print, &r);
}

static void print_spheres(const vsh_spheres *spheres, vshi_caster_print *print) {
    vsh_spheres_info info;
    vsh_spheres_get_info(spheres, &info);
    print->count = info.count;
    for (size_t i = 0; i < info.count; ++i) {
        row r = begin_row(i);
        add_numbers(&r, spheres->sphere[i], 4);
        add_row(print, &r);
    }
}

static vsh_result print_caster(const vsh_scene *scene, const vsh_assets *assets, size_t i, vshi_job *job,
                               vshi_caster_print *print, vsh_error *error) {
    const vsh_caster *caster = &scene->casters[i];
    size_t count = 0;
    const vsh_mesh *meshes = vsh_assets_caster(assets, i, &count);
    if (vshi_caster_is_direct(scene, caster)) {
        return VSH_OK;
    }
    if (caster->type == VSH_CASTER_VDB) {
        VSHI_TRY(vshi_file_digest(caster->path, print->digest, job, error));
    } else if (caster->type == VSH_CASTER_SDF) {
        print_sdf(caster, print);
    } else if (vshi_assets_spheres(assets, i) != NULL) {
        print_spheres(vshi_assets_spheres(assets, i), print);
    } else if (vshi_assets_outline(assets, i) != NULL) {
        print_outline(vshi_assets_outline(assets, i), caster->thickness, print);
    }
    VSHI_TRY(print_meshes(meshes, count, job, print, error));
    if (count == 0 && caster->type != VSH_CASTER_SPHERES) { /* where theirs is not in what was loaded */
        row r = begin_row(0);
        add_numbers(&r, caster->transform, 12);
        for (const char *c = caster->type == VSH_CASTER_VDB ? caster->grid : NULL; c != NULL && *c != '\0';
             ++c) {
            add_word(&r, (unsigned char)*c);
        }
        add_row(print, &r);
    }
    return VSH_OK;
}

vsh_result vshi_caster_prints_make(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                                   vshi_caster_prints *prints, vsh_error *error) {
    vsh_result result = VSH_OK;
    VSHI_TRY(
        vshi_allocate((void **)&prints->list, scene->caster_count, sizeof *prints->list, "casters", error));
    prints->count = scene->caster_count;
    vshi_job *job = vshi_job_begin(run, "hash", scene->caster_count);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "casters: the system refused memory");
    }
    for (size_t i = 0; i < scene->caster_count; ++i) {
        VSHI_TRY_DONE(print_caster(scene, assets, i, job, &prints->list[i], error));
        if (vshi_job_advance(job, 1)) {
            VSHI_TRY_DONE(vshi_job_fail_cancelled(job, error));
        }
    }
done:
    vshi_job_end(job);
    return result;
}

void vshi_caster_prints_free(vshi_caster_prints *prints) {
    free(prints->list);
    prints->list = NULL;
}

/* --- lines */

bool vshi_scene_voxels_named(const vsh_scene *scene, const vsh_scene_layer *layer) {
    return scene->voxels_named != 0 || scene->grid.voxel_size > 0.0 ||
           scene->grid.resolution != vsh_grid_options_default().resolution ||
           (layer != NULL && (layer->voxel_size > 0.0 || layer->resolution > 0));
}

static vsh_result add(vshi_attributes *lines, const char *name, const char *value, vsh_error *error) {
    return vshi_attributes_add(lines, name, value)
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_MEMORY, "field: the system refused memory");
}

static vsh_result add_size(vshi_attributes *lines, const char *name, double value, vsh_error *error) {
    char text[LINE];
    snprintf(text, sizeof text, "%.17g", value);
    return add(lines, name, text, error);
}

static vsh_result add_caster(vshi_attributes *lines, const vsh_caster *caster, const vsh_scene_layer *layer,
                             const vshi_caster_print *print, size_t number, vsh_error *error) {
    char name[64], what[LINE / 2], text[LINE];
    snprintf(name, sizeof name, "caster_%zu", number);
    if (caster->type == VSH_CASTER_VDB) {
        snprintf(what, sizeof what, "vdb sha256:%s", print->digest);
    } else {
        snprintf(what, sizeof what, "%s, %" PRIu64 " %s", kinds[caster->type], print->count,
                 units[caster->type]);
    }
    snprintf(text, sizeof text, "%s%s, %016" PRIx64 "%016" PRIx64, what,
             vshi_caster_in_layer(caster, layer) ? "" : ", in another layer", print->sum[0], print->sum[1]);
    return add(lines, name, text, error);
}

vsh_result vshi_recipe_make(const vsh_scene *scene, const vshi_caster_prints *prints,
                            const vsh_scene_layer *layer, int32_t resolution, vshi_attributes *lines,
                            vsh_error *error) {
    VSHI_NUMBERS;
    const bool own = layer != NULL && (layer->voxel_size != 0.0 || layer->resolution != 0);
    const double voxel_size = own ? layer->voxel_size : scene->grid.voxel_size;
    const int32_t voxels = resolution != VSH_RESOLUTION_NAMED      ? resolution
                           : own                                   ? layer->resolution
                           : vshi_scene_keeps_voxels(scene, layer) ? 0
                                                                   : scene->grid.resolution;
    if (voxel_size > 0.0) {
        VSHI_TRY(add_size(lines, "voxel_size", voxel_size, error));
    } else {
        VSHI_TRY(add_size(lines, "resolution", voxels, error));
    }
    VSHI_TRY(add_size(lines, "half_width", scene->grid.half_width, error));
    VSHI_TRY(add_size(lines, "shell_thickness", scene->grid.shell_thickness, error));
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        const bool meshes = caster->type == VSH_CASTER_MESH;
        if (!vshi_caster_is_direct(scene, caster) && (meshes || vshi_caster_in_layer(caster, layer))) {
            VSHI_TRY(add_caster(lines, caster, layer, &prints->list[i], i, error));
        }
    }
    return VSH_OK;
}

/* --- comparing */

static const char *value_of(const vsh_attribute *list, size_t count, const char *name) {
    for (size_t i = 0; i < count; ++i) {
        if (strcmp(list[i].name, name) == 0) {
            return list[i].value;
        }
    }
    return NULL;
}

/* " (tower.obj)" of a line of a caster. */
static void name_file(const vsh_scene *scene, const char *line, char *text, size_t size) {
    size_t number;
    text[0] = '\0';
    if (sscanf(line, "caster_%zu", &number) == 1 && number < scene->caster_count &&
        scene->casters[number].path != NULL) {
        snprintf(text, size, " (%s)", scene->casters[number].path);
    }
}

static vsh_result stale(const vsh_scene *scene, const char *path, const char *line, const char *was,
                        const char *is, vsh_error *error) {
    char file[256];
    name_file(scene, line, file, sizeof file);
    if (was == NULL || is == NULL) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: is stale: made %s %s%s%s%s: make it anew", path,
                         is == NULL ? "with" : "without", line, file, was != NULL ? ", " : "",
                         was != NULL ? was : "");
    }
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: is stale: %s%s was %s, and is %s here: make it anew", path,
                     line, file, was, is);
}

static bool is_meant(const char *line, bool casters) {
    return !casters || strncmp(line, "caster_", 7) == 0;
}

vsh_result vshi_recipe_compare(const vsh_scene *scene, const char *path, const vsh_attribute *kept,
                               size_t kept_count, const vshi_attributes *lines, bool casters,
                               vsh_error *error) {
    for (size_t i = 0; i < lines->count; ++i) {
        const vsh_attribute *line = &lines->list[i];
        /* as good as always they stand at the same place */
        const bool here = i < kept_count && strcmp(kept[i].name, line->name) == 0;
        const char *was = here ? kept[i].value : value_of(kept, kept_count, line->name);
        if (is_meant(line->name, casters) && (was == NULL || strcmp(was, line->value) != 0)) {
            return stale(scene, path, line->name, was, line->value, error);
        }
    }
    for (size_t i = 0; i < kept_count && kept_count > lines->count; ++i) {
        if (is_meant(kept[i].name, casters) && value_of(lines->list, lines->count, kept[i].name) == NULL) {
            return stale(scene, path, kept[i].name, kept[i].value, NULL, error);
        }
    }
    return VSH_OK;
}
