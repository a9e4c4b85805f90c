/* From a scene's casters to what is marched and traced. */
#ifndef CLI_FIELD_H
#define CLI_FIELD_H

#include <vdbshade/vdbshade.h>

/* A world box; min > max on all axes where it is empty. */
typedef struct cli_box {
    double min[3], max[3];
} cli_box;

cli_box cli_box_empty(void);
void cli_box_grow(cli_box *box, const vsh_texels_info *info); /* by the samples' box */

/* What a layer refers to. */
typedef struct cli_layer {
    const char *name; /* the scene's, which it belongs to */
    vsh_field *field;
    vsh_triangles *triangles;
} cli_layer;

typedef struct cli_field {
    vsh_field *field;  /* of the casters in no layer */
    vsh_layer *layers; /* [layer_count]: for vsh_shade_options */
    cli_layer *owned;  /* [layer_count] */
    size_t layer_count;
    vsh_grid_info grid; /* voxels and bytes of these two are those of all */
    vsh_field_info info;
    double voxelize_s, field_s;
} cli_field;

/* Fields that reach as far as the scene's lights and AO need at receivers in a box. CLI_OK or an exit code,
 * having said why. Free them with cli_field_free() also after a failure. */
int cli_field_make(const vsh_scene *scene, const vsh_assets *assets, const cli_box *receivers,
                   const vsh_run *run, cli_field *made);

/* The same of casters that are voxelised already: `grid` stands for those in no layer. */
int cli_field_make_of(const vsh_scene *scene, const vsh_assets *assets, const vsh_grid *grid,
                      const cli_box *receivers, const vsh_run *run, cli_field *made);

/* Diagonals of the casters' box. */
#define CLI_WITHIN_DIAGONALS 4.0

/* The same for points that are not known beforehand, within a distance of the casters' box; 0:
 * CLI_WITHIN_DIAGONALS. It does not depend on the points, so that neither do their bits. */
int cli_field_make_around(const vsh_scene *scene, const vsh_assets *assets, double within, const vsh_run *run,
                          cli_field *made);

void cli_field_free(cli_field *made); /* what is known of them stays */

/* The triangles of casters in no layer where one of the scene's methods traces them, else NULL; likewise. */
int cli_triangles_make(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                       vsh_triangles **triangles);

#endif
