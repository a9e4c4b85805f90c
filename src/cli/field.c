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

int cli_field_make(const vsh_scene *scene, const vsh_assets *assets, const cli_box *receivers,
                   const vsh_run *run, cli_field *made) {
    const double start = cli_seconds();
    vsh_grid *grid = NULL;
    vsh_error error;
    made->field = NULL;
    if (vsh_scene_casters(scene, assets, run, &grid, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    vsh_grid_get_info(grid, &made->grid);
    const double voxelized = cli_seconds();
    vsh_field_options options = vsh_field_options_default();
    options.reach = vsh_scene_reach(scene, grid, receivers->min, receivers->max);
    const vsh_result result = vsh_field_create(grid, &options, run, &made->field, &error);
    vsh_grid_free(grid); /* the field does not need it */
    if (result != VSH_OK) {
        return cli_fail(&error);
    }
    vsh_field_get_info(made->field, &made->info);
    made->voxelize_s = voxelized - start;
    made->field_s = cli_seconds() - voxelized;
    return CLI_OK;
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
