/* A scene's fields to a file. */
#include "base/clock.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "scene/kept_field.h"
#include "scene/occluders.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/scene_field.h>

/* Farther than any light or receiver: all levels that a field can have. Those that are beyond its box take
 * some 40 kB each. */
static const double ANY_REACH = 1e250;

/* Voxels along the longest side of a trial. */
enum { TRIAL_RESOLUTION = 96 };

typedef struct saving {
    const vsh_scene *scene;
    const vsh_assets *assets;
    vsh_run run;
    bool trial;
    vshi_caster_prints prints;
    vsh_kept_field *kept; /* these four: [capacity] */
    vsh_field **fields;
    vsh_voxels **bands;
    vshi_attributes *recipes;
    size_t count;
    vshi_attributes attributes;
    vsh_scene_field_report report;
} saving;

/* A light and AO stand for those that are to come: what shapes the field is how the casters are known. */
static vsh_scene lit_scene(const vsh_scene *scene) {
    static const vsh_light sun = {.name = "sun"};
    vsh_scene lit = *scene;
    if (lit.light_count == 0 && !lit.ao && vsh_planes_shaded(&lit.planes) == 0) {
        lit.lights = &sun;
        lit.light_count = 1;
    }
    return lit;
}

/* Voxels of a layer's casters, as vsh_scene_resolution() tells them. */
static vsh_result choose_resolution(const saving *s, const vsh_scene_layer *layer, int32_t *resolution,
                                    vsh_error *error) {
    const vsh_scene lit = lit_scene(s->scene);
    *resolution = vsh_scene_resolution(&lit, s->assets, layer, 0.0);
    if (*resolution != VSH_RESOLUTION_NAMED && !vsh_scene_marches(&lit, layer)) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s%s are traced as triangles, without voxels: there is no field to keep; "
                         "--resolution, --voxel-size or a --method that marches asks for one",
                         layer != NULL ? "the casters in layer " : "the casters",
                         layer != NULL ? layer->name : "");
    }
    return VSH_OK;
}

/* Has a trial made of fewer voxels: returns how many times more there are along a side, or where that is not
 * known yet less their size. */
static double make_smaller(const saving *s, const vsh_scene_layer *layer, vsh_scene *scene,
                           vsh_scene_layer *small) {
    const bool own = layer != NULL && (layer->voxel_size != 0.0 || layer->resolution != 0);
    const int32_t voxels = own ? layer->resolution : scene->grid.resolution;
    const double voxel_size = own ? layer->voxel_size : scene->grid.voxel_size;
    if (!s->trial || (voxel_size == 0.0 && voxels <= TRIAL_RESOLUTION)) {
        return 1.0; /* as they are, or a level set's own */
    }
    scene->grid.voxel_size = 0.0;
    scene->grid.resolution = TRIAL_RESOLUTION;
    if (layer != NULL) {
        *small = *layer;
        small->voxel_size = 0.0;
        small->resolution = TRIAL_RESOLUTION;
    }
    return voxel_size > 0.0 ? -voxel_size : (double)voxels / TRIAL_RESOLUTION;
}

static vsh_result make_field(saving *s, const vsh_scene_layer *layer, vsh_error *error) {
    int32_t resolution;
    VSHI_TRY(choose_resolution(s, layer, &resolution, error));
    const double start = vshi_seconds();
    vsh_scene scene = *s->scene;
    vsh_scene_layer small;
    scene.grid.resolution = resolution != VSH_RESOLUTION_NAMED ? resolution : scene.grid.resolution;
    double finer = make_smaller(s, layer, &scene, &small);
    vsh_grid *grid = NULL;
    VSHI_TRY(vsh_scene_layer_casters(&scene, s->assets, layer != NULL && finer != 1.0 ? &small : layer,
                                     &s->run, &grid, error));
    const double voxelized = vshi_seconds();
    vsh_grid_info voxels;
    vsh_grid_get_info(grid, &voxels);
    finer = finer < 0.0 ? fmax(1.0, voxels.voxel_size / -finer) : finer;
    vsh_field_options options = vsh_field_options_default();
    options.reach = ANY_REACH;
    vsh_field **field = &s->fields[s->count];
    vsh_voxels **band = &s->bands[s->count];
    vsh_result result = vsh_field_create(grid, &options, &s->run, field, error);
    if (result == VSH_OK && !s->trial) {
        result = vsh_voxels_from_grid(grid, 0.0, &s->run, band, error);
    }
    vsh_grid_free(grid);
    VSHI_TRY(result);
    vsh_field_info info;
    vsh_field_get_info(*field, &info);
    const double more = finer * finer; /* surfaces: voxels grow with the square */
    vsh_scene_field_report *r = &s->report;
    r->active_voxels += (uint64_t)((double)voxels.active_voxels * more);
    r->grid_bytes += (uint64_t)((double)voxels.bytes * more);
    r->field_bytes += (uint64_t)((double)info.bytes * more);
    r->voxelize_s += (voxelized - start) * more;
    r->field_s += (vshi_seconds() - voxelized) * more;
    r->finest = r->fields == 0 ? info.voxel_size / finer : fmin(r->finest, info.voxel_size / finer);
    ++r->fields;
    s->run.memory_held += info.bytes;
    vsh_kept_field *kept = &s->kept[s->count];
    vshi_attributes *recipe = &s->recipes[s->count++];
    VSHI_TRY(vshi_recipe_make(s->scene, &s->prints, layer, resolution, recipe, error));
    *kept = vsh_kept_field_default();
    kept->name = layer != NULL ? layer->name : "";
    kept->field = *field;
    kept->half_width = voxels.half_width;
    kept->grid_bytes = voxels.bytes;
    kept->origin = recipe->list;
    kept->origin_count = recipe->count;
    kept->band = *band;
    return s->trial ? VSH_OK : vshi_scene_warn_lost(s->scene, s->assets, layer, *field, &s->run, error);
}

static vsh_result make_fields(saving *s, vsh_error *error) {
    const size_t capacity = s->scene->layer_count + 1;
    VSHI_TRY(vshi_allocate((void **)&s->kept, capacity, sizeof *s->kept, "fields", error));
    VSHI_TRY(vshi_allocate((void **)&s->fields, capacity, sizeof *s->fields, "fields", error));
    VSHI_TRY(vshi_allocate((void **)&s->bands, capacity, sizeof *s->bands, "bands", error));
    VSHI_TRY(vshi_allocate((void **)&s->recipes, capacity, sizeof *s->recipes, "fields", error));
    if (!s->trial) {
        VSHI_TRY(vshi_caster_prints_make(s->scene, s->assets, &s->run, &s->prints, error));
    } else {
        VSHI_TRY(vshi_allocate((void **)&s->prints.list, s->scene->caster_count, sizeof *s->prints.list,
                               "casters", error));
    }
    for (size_t i = 0; i < capacity; ++i) {
        const vsh_scene_layer *layer = i > 0 ? &s->scene->layers[i - 1] : NULL;
        if (vshi_layer_is_voxelised(s->scene, layer)) {
            VSHI_TRY(make_field(s, layer, error));
        }
    }
    return s->count > 0
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT, "field: the scene has no casters that are voxelised");
}

static vsh_result write_fields(saving *s, const char *path, const vsh_scene_field_options *options,
                               vsh_error *error) {
    const double start = vshi_seconds();
    for (size_t i = 0; i < options->attribute_count; ++i) {
        if (!vshi_attributes_add(&s->attributes, options->attributes[i].name, options->attributes[i].value)) {
            return vshi_fail(error, VSH_ERROR_MEMORY, "field: the system refused memory");
        }
    }
    VSHI_TRY(vshi_kept_field_name_voxels(s->scene, &s->attributes, error));
    VSHI_TRY(vsh_field_file_write(path, s->kept, s->count, s->attributes.list, s->attributes.count, &s->run,
                                  error));
    s->report.write_s = vshi_seconds() - start;
    return VSH_OK;
}

static void free_saving(saving *s) {
    for (size_t i = 0; i < s->count; ++i) {
        vshi_attributes_free(&s->recipes[i]);
    }
    for (size_t i = 0; s->fields != NULL && i <= s->scene->layer_count; ++i) {
        vsh_field_free(s->fields[i]);
    }
    for (size_t i = 0; s->bands != NULL && i <= s->scene->layer_count; ++i) {
        vsh_voxels_free(s->bands[i]);
    }
    vshi_attributes_free(&s->attributes);
    vshi_caster_prints_free(&s->prints);
    free(s->recipes);
    free(s->bands);
    free(s->fields);
    free(s->kept);
}

/* `path` NULL: a trial. */
static vsh_result save(const vsh_scene *scene, const vsh_assets *assets, const char *path,
                       const vsh_scene_field_options *options, const vsh_run *run,
                       vsh_scene_field_report *report, size_t report_size, vsh_error *error) {
    VSHI_NEEDS(scene);
    VSHI_NEEDS(assets);
    vsh_scene own = *scene;
    own.field = NULL;
    saving s = {.scene = &own, .assets = assets, .trial = path == NULL};
    vsh_scene_field_options o = vsh_scene_field_options_default();
    VSHI_TRY(vshi_options_resolve(options, &o, sizeof o, "vsh_scene_field_options", error));
    VSHI_NEEDS_OF(o.attribute_count, o.attributes);
    VSHI_TRY(vshi_run_resolve(run, &s.run, error));
    vsh_result result;
    VSHI_TRY_DONE(make_fields(&s, error));
    if (path != NULL) {
        VSHI_TRY_DONE(write_fields(&s, path, &o, error));
    }
    if (report != NULL) {
        vshi_give(report, report_size, &s.report, sizeof s.report);
    }
done:
    free_saving(&s);
    return result;
}

vsh_result vsh_scene_save_field_sized(const vsh_scene *scene, const vsh_assets *assets, const char *path,
                                      const vsh_scene_field_options *options, const vsh_run *run,
                                      vsh_scene_field_report *report, size_t report_size, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(path);
    return save(scene, assets, path, options, run, report, report_size, error);
}

vsh_result vsh_scene_field_forecast_sized(const vsh_scene *scene, const vsh_assets *assets,
                                          const vsh_run *run, vsh_scene_field_report *report,
                                          size_t report_size, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(report);
    return save(scene, assets, NULL, NULL, run, report, report_size, error);
}
