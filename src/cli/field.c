#include "field.h"

#include "clock.h"
#include "message.h"

#include <math.h>
#include <stdbool.h>

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
        diagonal = hypot(diagonal, info.bounds_max[axis] - info.bounds_min[axis]);
    }
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

int cli_grid_make(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run, vsh_grid **grid,
                  cli_field *made) {
    const double start = cli_seconds();
    vsh_error error;
    *made = (cli_field){0};
    if (vsh_scene_casters(scene, assets, run, grid, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    vsh_grid_get_info(*grid, &made->grid);
    made->voxelize_s = cli_seconds() - start;
    return CLI_OK;
}

static int make_field(const vsh_scene *scene, const vsh_grid *grid, const cli_box *receivers, double within,
                      const vsh_run *run, cli_field *made) {
    const double start = cli_seconds();
    vsh_error error;
    vsh_field_options options = vsh_field_options_default();
    options.reach = reach_of(scene, grid, receivers, within);
    if (vsh_field_create(grid, &options, run, &made->field, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    vsh_field_get_info(made->field, &made->info);
    made->field_s = cli_seconds() - start;
    return CLI_OK;
}

int cli_field_of_grid(const vsh_scene *scene, const vsh_grid *grid, const cli_box *receivers,
                      const vsh_run *run, cli_field *made) {
    return make_field(scene, grid, receivers, 0.0, run, made);
}

static int make(const vsh_scene *scene, const vsh_assets *assets, const cli_box *receivers, double within,
                const vsh_run *run, cli_field *made) {
    vsh_grid *grid = NULL;
    int code = cli_grid_make(scene, assets, run, &grid, made);
    code = code == CLI_OK ? make_field(scene, grid, receivers, within, run, made) : code;
    vsh_grid_free(grid); /* the field does not need it */
    return code;
}

int cli_field_make(const vsh_scene *scene, const vsh_assets *assets, const cli_box *receivers,
                   const vsh_run *run, cli_field *made) {
    return make(scene, assets, receivers, 0.0, run, made);
}

int cli_field_make_around(const vsh_scene *scene, const vsh_assets *assets, double within, const vsh_run *run,
                          cli_field *made) {
    return make(scene, assets, NULL, within, run, made);
}

int cli_triangles_make(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                       vsh_triangles **triangles) {
    *triangles = NULL;
    const bool lights = scene->light_count > 0 && scene->shade.method == VSH_SHADOW_EXACT;
    const bool ao = scene->ao && scene->shade.ao_method == VSH_AO_EXACT;
    vsh_error error;
    if ((lights || ao) && vsh_scene_triangles(scene, assets, run, triangles, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    return CLI_OK;
}
