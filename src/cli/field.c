#include "field.h"

#include "clock.h"
#include "lost.h"
#include "meshes.h"
#include "message.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Of a scene's extent: positions of floats are off by a hundredth of it. */
static const double FLOAT_STEPS = 1e-5;

cli_box cli_box_empty(void) {
    return (cli_box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

void cli_box_grow(cli_box *box, const vsh_texels_info *info) {
    for (int axis = 0; axis < 3 && info->samples > 0; ++axis) {
        box->min[axis] = fmin(box->min[axis], info->bounds_min[axis]);
        box->max[axis] = fmax(box->max[axis], info->bounds_max[axis]);
    }
}

/* Reach for receivers in `box`, or (NULL) for points within `within` of the casters' box. */
static double reach_of(const vsh_scene *scene, const vsh_grid *grid, const cli_box *box, double within) {
    if (box != NULL) {
        return vsh_scene_reach(scene, grid, box->min, box->max);
    }
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    double diagonal = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double side = info.bounds_max[axis] - info.bounds_min[axis];
        diagonal += side * side;
    }
    diagonal = sqrt(diagonal);
    cli_box around;
    const double margin = within > 0.0 ? within : CLI_WITHIN_DIAGONALS * diagonal;
    for (int axis = 0; axis < 3; ++axis) {
        around.min[axis] = info.bounds_min[axis] - margin;
        around.max[axis] = info.bounds_max[axis] + margin;
    }
    const double reach = vsh_scene_reach(scene, grid, around.min, around.max);
    /* the library's own default, where that is enough: a program that takes it gets the same bits */
    return reach > CLI_WITHIN_DIAGONALS * diagonal ? reach : vsh_field_options_default().reach;
}

/* What is made of one layer's casters, or (layer NULL) of those in none. */
typedef struct making {
    const vsh_scene *scene;
    const vsh_assets *assets;
    const cli_box *receivers;
    double within;
    const vsh_run *run;
    cli_field *made;
    const vsh_grid *grid; /* of the casters in no layer, where it is there already */
} making;

/* Adds up what fields and level sets take; sizes are those of the first. */
static void count(cli_field *made, const vsh_grid_info *grid, const vsh_field_info *info) {
    if (made->info.bytes == 0) {
        made->grid = *grid;
        made->info = *info;
        return;
    }
    made->grid.active_voxels += grid->active_voxels;
    made->grid.bytes += grid->bytes;
    made->info.bricks += info->bricks;
    made->info.bytes += info->bytes;
    made->info.active_voxels += info->active_voxels;
}

static int fail_in_layer(const vsh_scene_layer *layer, const vsh_error *error) {
    if (layer == NULL) {
        return cli_fail_of(NULL, error);
    }
    vsh_error placed = {error->code, ""};
    const size_t size = sizeof placed.message;
    const int written = snprintf(placed.message, size, "layer '%s': %s", layer->name, error->message);
    return cli_fail_of(NULL, written < (int)size ? &placed : error);
}

/* *field is NULL where there are no casters. */
static int make_one(const making *m, const vsh_scene_layer *layer, vsh_field **field) {
    const double start = cli_seconds();
    vsh_grid *grid = NULL;
    vsh_error error;
    *field = NULL;
    const vsh_grid *given = layer == NULL ? m->grid : NULL;
    vsh_run run = *m->run;
    run.memory_held += m->made->info.bytes; /* fields of layers before */
    if (given == NULL && vsh_scene_layer_casters(m->scene, m->assets, layer, &run, &grid, &error) != VSH_OK) {
        return fail_in_layer(layer, &error);
    }
    const vsh_grid *casters = given != NULL ? given : grid;
    if (casters == NULL) {
        return CLI_OK;
    }
    vsh_grid_info info;
    vsh_grid_get_info(casters, &info);
    const double voxelized = cli_seconds();
    vsh_field_options options = vsh_field_options_default();
    options.reach = reach_of(m->scene, casters, m->receivers, m->within);
    if (layer != NULL) {
        options.reach *= fmax(1.0, layer->shade.softness); /* lights are as much wider */
    }
    const vsh_result result = vsh_field_create(casters, &options, &run, field, &error);
    vsh_grid_free(grid); /* the field does not need it */
    if (result != VSH_OK) {
        return fail_in_layer(layer, &error);
    }
    vsh_field_info made;
    vsh_field_get_info(*field, &made);
    count(m->made, &info, &made);
    m->made->voxelize_s += voxelized - start;
    m->made->field_s += cli_seconds() - voxelized;
    return cli_lost_warn(m->scene, m->assets, layer, *field, info.voxel_size, m->run);
}

/* Whether exact methods trace a layer's triangles, or (NULL) those of casters in none. */
static bool traces(const vsh_scene *scene, const vsh_scene_layer *layer) {
    const int32_t given =
        layer != NULL && layer->shade.method >= 0 ? layer->shade.method : scene->shade.method;
    const int32_t can = vsh_scene_traceable(scene, layer) && vsh_triangles_available();
    const int32_t method = vsh_shadow_method_resolve(given, can);
    const int32_t ao_method = vsh_ao_method_resolve(scene->shade.ao_method, can);
    return (scene->light_count > 0 && (vsh_shadow_method_traits(method) & VSH_METHOD_TRIANGLES) != 0) ||
           (scene->ao && (vsh_ao_method_traits(ao_method) & VSH_METHOD_TRIANGLES) != 0 &&
            (layer == NULL || layer->shade.ao));
}

static int trace(const vsh_scene *scene, const vsh_assets *assets, const vsh_scene_layer *layer,
                 const vsh_run *run, vsh_triangles **triangles) {
    vsh_error error;
    *triangles = NULL;
    if (traces(scene, layer) && vsh_scene_triangles(scene, assets, layer, run, triangles, &error) != VSH_OK) {
        return cli_fail_of(NULL, &error);
    }
    return CLI_OK;
}

/* Casters without voxels, each shaded as its layer is. */
static void add_direct(const making *m) {
    cli_field *made = m->made;
    for (size_t i = 0; i < m->scene->caster_count; ++i) {
        const vsh_caster *caster = &m->scene->casters[i];
        if (!cli_caster_is_direct(caster)) {
            continue;
        }
        vsh_layer *layer = &made->layers[made->layer_count++];
        *layer = vsh_layer_default();
        for (size_t k = 0; caster->layer != NULL && k < m->scene->layer_count; ++k) {
            if (strcmp(m->scene->layers[k].name, caster->layer) == 0) {
                *layer = m->scene->layers[k].shade;
            }
        }
        layer->heights = vsh_assets_heights(m->assets, i);
        layer->spheres = vsh_assets_spheres(m->assets, i);
    }
}

static int make_layers(const making *m, size_t direct) {
    cli_field *made = m->made;
    const size_t most = m->scene->layer_count + direct;
    if (most > VSH_MAX_LAYERS) {
        return cli_usage("%zu layers and %zu casters that are not voxelised: at most %d together",
                         m->scene->layer_count, direct, VSH_MAX_LAYERS);
    }
    made->layers = calloc(most, sizeof *made->layers);
    made->owned = calloc(most, sizeof *made->owned);
    if (made->layers == NULL || made->owned == NULL) {
        return cli_out_of_memory("layers");
    }
    int code = CLI_OK;
    for (size_t i = 0; i < m->scene->layer_count && code == CLI_OK; ++i) {
        const vsh_scene_layer *of_scene = &m->scene->layers[i];
        cli_layer *own = &made->owned[made->layer_count];
        code = make_one(m, of_scene, &own->field);
        own->name = of_scene->name;
        if (own->field != NULL) {
            vsh_layer *layer = &made->layers[made->layer_count++];
            code = trace(m->scene, m->assets, of_scene, m->run, &own->triangles);
            *layer = of_scene->shade;
            layer->field = own->field;
            layer->triangles = own->triangles;
        }
    }
    add_direct(m);
    return code;
}

/* Of the finest layer, whose voxels start offsets are then measured in; beside casters without voxels alone,
 * whose surface is exact, as fine as a float tells positions of the scene apart. */
static double extent(const vsh_layer *layer) {
    vsh_heights_info heights;
    vsh_spheres_info spheres;
    const double *low = heights.bounds_min, *high = heights.bounds_max;
    if (layer->heights != NULL) {
        vsh_heights_get_info(layer->heights, &heights);
    } else {
        vsh_spheres_get_info(layer->spheres, &spheres);
        low = spheres.bounds_min;
        high = spheres.bounds_max;
    }
    return fmax(high[0] - low[0], fmax(high[1] - low[1], high[2] - low[2]));
}

static int make_empty(cli_field *made) {
    double finest = INFINITY;
    for (size_t i = 0; i < made->layer_count; ++i) {
        if (made->layers[i].field != NULL) {
            vsh_field_info info;
            vsh_field_get_info(made->layers[i].field, &info);
            finest = fmin(finest, info.voxel_size);
        }
    }
    for (size_t i = 0; i < made->layer_count && isinf(finest); ++i) {
        finest = fmin(fmax(FLOAT_STEPS * extent(&made->layers[i]), 1e-12), 1e12);
    }
    vsh_error error;
    return vsh_field_create_empty(finest, &made->field, &error) == VSH_OK ? CLI_OK
                                                                          : cli_fail_of(NULL, &error);
}

static int make(const making *m) {
    cli_field *made = m->made;
    *made = (cli_field){.field = NULL};
    int code = make_one(m, NULL, &made->field);
    size_t direct = 0;
    for (size_t i = 0; i < m->scene->caster_count; ++i) {
        direct += cli_caster_is_direct(&m->scene->casters[i]);
    }
    if (code == CLI_OK && m->scene->layer_count + direct > 0) {
        code = make_layers(m, direct);
    }
    if (code == CLI_OK && made->field == NULL && made->layer_count == 0) {
        cli_say("the scene has no casters");
        code = CLI_USAGE;
    }
    return code == CLI_OK && made->field == NULL ? make_empty(made) : code;
}

int cli_field_make(const vsh_scene *scene, const vsh_assets *assets, const cli_box *receivers,
                   const vsh_run *run, cli_field *made) {
    return make(&(making){scene, assets, receivers, 0.0, run, made, NULL});
}

int cli_field_make_of(const vsh_scene *scene, const vsh_assets *assets, const vsh_grid *grid,
                      const cli_box *receivers, const vsh_run *run, cli_field *made) {
    return make(&(making){scene, assets, receivers, 0.0, run, made, grid});
}

int cli_field_make_around(const vsh_scene *scene, const vsh_assets *assets, double within, const vsh_run *run,
                          cli_field *made) {
    return make(&(making){scene, assets, NULL, within, run, made, NULL});
}

void cli_field_free(cli_field *made) {
    for (size_t i = 0; i < made->layer_count; ++i) {
        vsh_field_free(made->owned[i].field);
        vsh_triangles_free(made->owned[i].triangles);
    }
    free(made->owned);
    free(made->layers);
    vsh_field_free(made->field);
    made->field = NULL;
    made->layers = NULL;
    made->owned = NULL;
    made->layer_count = 0;
}

/* Whether auto would have been exact. */
static bool misses_embree(const vsh_scene *scene) {
    const bool asked = (scene->light_count > 0 && scene->shade.method == VSH_SHADOW_AUTO) ||
                       (scene->ao && scene->shade.ao_method == VSH_AO_AUTO);
    return asked && vsh_scene_traceable(scene, NULL) != 0;
}

int cli_triangles_make(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                       vsh_triangles **triangles) {
    const int code = trace(scene, assets, NULL, run, triangles);
    vsh_error error;
    if (code == CLI_OK && !vsh_triangles_available() && misses_embree(scene)) {
        run->warning(run->user, "this build has no Embree to trace triangles with: adaptive takes the place "
                                "of exact, and its error is that of the voxels");
    }
    /* no caster outside of layers: none, where the library wants to be given those that there are */
    if (code == CLI_OK && *triangles == NULL && traces(scene, NULL) &&
        vsh_triangles_create(NULL, 0, run, triangles, &error) != VSH_OK) {
        return cli_fail_of(NULL, &error);
    }
    return code;
}
